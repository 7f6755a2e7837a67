//! The pairs engine: energy and gradient from neighbour lists. The default.
//!
//! d and β are read at the atoms and kept until one has moved far, so that energy and gradient belong to
//! one function and a line search can trust them. Lists reach farther than the cut-off by a skin and
//! hold until an atom has moved half of it; a thin skin, made anew often, costs less than a thick one.
//!
//! Lists are found in a tree of boxes over atoms of which those that follow each other are near each other.
//! Where the caller's order is such ([`compact_order`]) it is taken as it is, and memory is read and
//! written in runs; else the engine keeps an order of its own, and makes it anew once atoms have moved so
//! much that the boxes have grown. Cost: O(n) in atoms.

use rayon::prelude::*;

use crate::energy::pair;
use crate::fields::NominalDistance;
use crate::geometry::{Bounds, Point, compact_order, distance_squared};

use crate::fields::{HeldCell, ImageWeight, ScalarField};

use super::engine::{Energy, Engine};
use super::kernel::{Graded, Scale, Uniform, add_pairs};
use super::lanes::{LANES, Lanes, Plain};
use super::neighbors::{CHUNK, Chunk, NeighborLists};
use super::tree::{Scaling, Tree};

/// How far lists reach beyond the cut-off, in nominal distances, or farther if atoms are to move farther.
const SKIN: f64 = 0.2;
/// How far an atom may move, over its nominal distance, before d and β are read anew.
const STALE: f64 = 0.25;
/// How much the tree's boxes may grow before atoms are put in order anew, and how much larger than cubes of
/// eight atoms they may be for the caller's order to be taken.
const LOOSE: f64 = 1.5;

/// How many atoms are reckoned with while the samples of as many are on their way.
const AHEAD: usize = 8;

/// The engine that sums over pairs of near atoms, with an analytic gradient.
///
/// Departure from the paper: a pair's nominal distance is the mean of its atoms', d_ij = (dᵢ + dⱼ)/2,
/// which is symmetric and equals the paper's d(xⱼ) to first order since |∇d| ≪ 1.
pub struct PairsEngine<'a, const D: usize> {
    potential: &'a ScalarField<D>,
    weight: &'a ImageWeight<D>,
    distance: &'a NominalDistance<D>,
    tree: Tree<D>,
    scaling: Scaling<D>,
    /// The girth of the tree's boxes when atoms were last put in order.
    girth: f64,
    /// The atom at each place of the tree, and, unless that is the caller's order, the place of each atom.
    order: Vec<u32>,
    place: Vec<u32>,
    lists: NeighborLists,
    skin: f64,
    /// d at the atoms, β at them if it varies, where they were when these were read, if one varies, and
    /// where they were when the lists were built.
    distances: Vec<f64>,
    weights: Vec<f64>,
    read: Vec<Point<D>>,
    listed: Vec<Point<D>>,
    /// The gradient in the tree's order, where that is not the caller's.
    slopes: Vec<Point<D>>,
    /// The samples around each atom, in the tree's order, where they were read last: most atoms stay in
    /// their cell from one evaluation to the next, and these follow each other in memory.
    held: Vec<HeldCell>,
}

impl<'a, const D: usize> PairsEngine<'a, D> {
    /// An engine for atoms in these fields.
    pub fn new(
        potential: &'a ScalarField<D>,
        weight: &'a ImageWeight<D>,
        distance: &'a NominalDistance<D>,
    ) -> Self {
        Self {
            potential,
            weight,
            distance,
            tree: Tree::default(),
            scaling: Scaling::new(&potential.grid().bounds()),
            girth: 0.0,
            order: Vec::new(),
            place: Vec::new(),
            lists: NeighborLists::default(),
            skin: SKIN,
            distances: Vec::new(),
            weights: Vec::new(),
            read: Vec::new(),
            listed: Vec::new(),
            slopes: Vec::new(),
            held: Vec::new(),
        }
    }

    /// Whether d and β are the same everywhere.
    fn is_uniform(&self) -> bool {
        self.distance.is_constant() && self.weight.as_constant().is_some()
    }

    /// The farthest that an atom has moved from where it was, over its nominal distance.
    fn farthest_move(&self, atoms: &[Point<D>], from: &[Point<D>]) -> f64 {
        let squared = atoms
            .par_iter()
            .zip(from)
            .zip(&self.distances)
            .with_min_len(CHUNK)
            .map(|((p, q), d)| distance_squared(p, q) / (d * d))
            .reduce(|| 0.0, f64::max); // a maximum is the same in any order
        squared.sqrt()
    }

    /// Reads d and β at the atoms.
    fn read_fields(&mut self, atoms: &[Point<D>]) {
        let (distance, weight) = (self.distance, self.weight);
        let chunks = atoms.par_iter().with_min_len(CHUNK);
        chunks.map(|p| distance.at(p)).collect_into_vec(&mut self.distances);
        if weight.as_constant().is_none() {
            let chunks = atoms.par_iter().with_min_len(CHUNK);
            chunks.map(|p| weight.at(p)).collect_into_vec(&mut self.weights);
        }
        if !self.is_uniform() {
            self.read.clear();
            self.read.extend_from_slice(atoms);
        }
    }

    fn rebuild_lists(&mut self, atoms: &[Point<D>]) {
        let bounds = self.bounds(atoms);
        self.scaling = Scaling::new(&bounds);
        if self.order.len() != atoms.len() {
            // as if the caller's order were compact, until the boxes tell
            self.order = (0..atoms.len() as u32).collect();
            self.place.clear();
            self.girth = cubes_girth(atoms.len(), &bounds, &self.scaling);
        }
        self.build_tree(atoms);
        if self.tree.girth() > LOOSE * self.girth {
            self.put_in_order(atoms);
            self.build_tree(atoms);
            self.girth = self.tree.girth();
        }
        self.lists.build(&self.tree, &self.order, self.place.is_empty());
        self.listed.clear();
        self.listed.extend_from_slice(atoms);
    }

    /// The box of the atoms.
    fn bounds(&self, atoms: &[Point<D>]) -> Bounds<D> {
        let wider = |mut a: Bounds<D>, b: Bounds<D>| {
            a.join(&b);
            a
        };
        let chunks = atoms.par_chunks(CHUNK * 8).filter_map(Bounds::of);
        chunks.reduce_with(wider).unwrap_or_else(|| self.potential.grid().bounds())
    }

    fn put_in_order(&mut self, atoms: &[Point<D>]) {
        self.order = compact_order(atoms);
        self.place.resize(atoms.len(), 0);
        for (s, &i) in self.order.iter().enumerate() {
            self.place[i as usize] = s as u32;
        }
    }

    fn build_tree(&mut self, atoms: &[Point<D>]) {
        let Self { tree, order, distances, scaling, skin, .. } = self;
        let reach = pair::CUTOFF + *skin;
        tree.build(atoms.len(), |s| {
            let i = order[s] as usize;
            (scaling.place(&atoms[i]), scaling.half(reach * distances[i]))
        });
    }

    /// Energy and gradient of one chunk of atoms, each gathering over its own list.
    #[inline(always)]
    fn gather<L: Lanes>(&self, atoms: &[Point<D>], c: usize, own: Own<'_, D>) -> Energy {
        match (self.distance.is_constant(), self.weight.as_constant()) {
            (true, Some(beta)) => {
                let inverse_squared = self.distance.least().powi(-2);
                let scale = Uniform { inverse_squared, weight: 1.0 - beta };
                self.gather_with::<L, _>(atoms, c, &scale, own)
            }
            (_, beta) => {
                let (distances, weights) = (&self.distances[..], &self.weights[..]);
                let scale = Graded { distances, weight: 1.0 - beta.unwrap_or(0.0), weights };
                self.gather_with::<L, _>(atoms, c, &scale, own)
            }
        }
    }

    /// The same, a few atoms at a time: while their pairs are summed, memory brings the next ones' samples.
    #[inline(always)]
    fn gather_with<L: Lanes, S: Scale>(
        &self,
        atoms: &[Point<D>],
        c: usize,
        scale: &S,
        (slopes, held): Own<'_, D>,
    ) -> Energy {
        let members = &self.order[c * CHUNK..][..slopes.len()];
        let Chunk { lists, neighbors } = &self.lists.chunks[c];
        let has_image = self.weight.as_constant() != Some(0.0);
        let ask = |held: &[HeldCell], first: usize| {
            let some = members.iter().zip(held).skip(first).take(AHEAD);
            some.for_each(|(&i, held)| self.potential.prefetch(&atoms[i as usize], held));
        };
        if has_image {
            ask(held, 0);
        }
        let mut energy = Energy::default();
        for (few, slopes) in slopes.chunks_mut(AHEAD).enumerate() {
            let (first, end) = (few * AHEAD, few * AHEAD + slopes.len());
            let these = &members[first..end];
            if has_image {
                ask(held, end);
                energy.image += self.image_part(atoms, these, &mut held[first..end], slopes);
            } else {
                slopes.fill([0.0; D]);
            }
            let lists = (&lists[first..end], &neighbors[..]);
            energy.atomic += add_pairs::<L, _, D>(atoms, these, lists, scale, slopes);
        }
        energy
    }

    /// The same with wider registers. The operations are the same, in the same order, each rounded once,
    /// so the result is the same to the last bit.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,popcnt")]
    fn gather_avx2(&self, atoms: &[Point<D>], c: usize, own: Own<'_, D>) -> Energy {
        self.gather::<super::lanes::Avx2>(atoms, c, own)
    }

    /// The same with more registers.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,popcnt,avx512f,avx512vl,avx512dq,avx512bw")]
    fn gather_avx512(&self, atoms: &[Point<D>], c: usize, own: Own<'_, D>) -> Energy {
        self.gather::<super::lanes::Avx2>(atoms, c, own)
    }

    /// The image's part of some atoms: β b, and the gradient.
    #[inline(always)]
    fn image_part(
        &self,
        atoms: &[Point<D>],
        members: &[u32],
        held: &mut [HeldCell],
        slopes: &mut [Point<D>],
    ) -> f64 {
        let mut energy = 0.0;
        for ((slope, held), &i) in slopes.iter_mut().zip(held).zip(members) {
            let beta = self.weight.as_constant().unwrap_or_else(|| self.weights[i as usize]);
            let atom = &atoms[i as usize];
            energy += beta * self.potential.value_and_gradient_held(atom, held, slope);
            *slope = slope.map(|g| beta * g);
        }
        energy
    }

    /// Energy and gradient of all chunks, the gradient in the tree's order.
    fn gather_all(
        &self,
        atoms: &[Point<D>],
        slopes: &mut [Point<D>],
        held: &mut [HeldCell],
    ) -> Energy {
        #[cfg(target_arch = "x86_64")]
        let (wide, more) = (super::lanes::has_avx2(), super::lanes::has_avx512());
        let gather = |(c, own): (usize, Own<'_, D>)| {
            // SAFETY: the processor has been asked whether it has these instructions.
            #[cfg(target_arch = "x86_64")]
            unsafe {
                if more {
                    return self.gather_avx512(atoms, c, own);
                }
                if wide {
                    return self.gather_avx2(atoms, c, own);
                }
            }
            self.gather::<Plain>(atoms, c, own)
        };
        let chunks = slopes.par_chunks_mut(CHUNK).zip(held.par_chunks_mut(CHUNK)).enumerate();
        let parts: Vec<Energy> = chunks.map(gather).collect();
        parts.iter().fold(Energy::default(), |sum, part| Energy {
            atomic: sum.atomic + part.atomic,
            image: sum.image + part.image,
        })
    }
}

/// What belongs to the atoms of one chunk: their gradient, and the samples around them.
type Own<'a, const D: usize> = (&'a mut [Point<D>], &'a mut [HeldCell]);

/// The girth of boxes of eight atoms each, if they were cubes that fill the box.
fn cubes_girth<const D: usize>(count: usize, bounds: &Bounds<D>, scaling: &Scaling<D>) -> f64 {
    let blocks = count.div_ceil(LANES) as f64;
    let sides = bounds.extent().map(|side| f64::from(scaling.half(2.0 * side)));
    blocks * D as f64 * (sides.iter().product::<f64>() / blocks).powf(1.0 / D as f64)
}

impl<const D: usize> Engine<D> for PairsEngine<'_, D> {
    fn prepare(&mut self, atoms: &[Point<D>], next_move: f64) -> bool {
        let first = self.listed.len() != atoms.len();
        let farthest = |from| if first { f64::INFINITY } else { self.farthest_move(atoms, from) };
        let stale = first || !self.is_uniform() && farthest(&self.read) + next_move > STALE;
        let loose = stale || farthest(&self.listed) + next_move > 0.5 * self.skin;
        if !loose {
            return false;
        }
        // what cannot be told, or never happens, needs no room
        self.skin = if next_move < 1.0 { SKIN.max(2.0 * next_move) } else { SKIN };
        if stale {
            self.read_fields(atoms);
        }
        self.rebuild_lists(atoms);
        stale
    }

    fn evaluate(&mut self, atoms: &[Point<D>], gradient: &mut [Point<D>]) -> Energy {
        assert!(atoms.len() == self.order.len() && gradient.len() == atoms.len(), "not prepared");
        let mut held = std::mem::take(&mut self.held);
        held.resize(atoms.len(), HeldCell::NONE);
        if self.place.is_empty() {
            let energy = self.gather_all(atoms, gradient, &mut held);
            self.held = held;
            return energy;
        }
        let mut slopes = std::mem::take(&mut self.slopes);
        slopes.resize(atoms.len(), [0.0; D]);
        let energy = self.gather_all(atoms, &mut slopes, &mut held);
        self.held = held;
        let places = gradient.par_iter_mut().zip(&self.place).with_min_len(CHUNK);
        places.for_each(|(g, &s)| *g = slopes[s as usize]);
        self.slopes = slopes;
        energy
    }

    fn distances(&self) -> &[f64] {
        &self.distances
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64;

    use super::*;
    use crate::fields::Interpolation;
    use crate::image::Grid;

    /// Calls `check` with an engine prepared for some 3000 atoms, in a compact order or in any, in fields
    /// that vary or do not.
    fn with_engines<const D: usize>(
        check: impl Fn(&mut PairsEngine<'_, D>, &[Point<D>], /* compact */ bool),
    ) {
        let grid = Grid { shape: [40; D], step: [1.0; D] };
        let wave = |i: usize| (0.37 * i as f32).sin();
        let b = (0..grid.sample_count()).map(wave).collect();
        let potential = ScalarField::new(grid, b, Interpolation::Linear).unwrap();
        let half = (0..grid.sample_count()).map(|i| 0.5 + 0.5 * wave(i)).collect();
        let weights =
            [ImageWeight::constant(0.4).unwrap(), ImageWeight::field(grid, half).unwrap()];
        let field: Vec<f32> =
            (0..grid.sample_count()).map(|i| 2.0 + 0.04 * (i % 40) as f32).collect();
        let distances = [
            NominalDistance::constant(&grid, 2.0).unwrap(),
            NominalDistance::from_field(&grid, &field, 0.25).unwrap(),
        ];
        let mut random = Pcg64::seed_from_u64(5);
        let atoms: Vec<Point<D>> =
            (0..3001).map(|_| std::array::from_fn(|_| 39.0 * random.random::<f64>())).collect();
        let compact: Vec<Point<D>> =
            compact_order(&atoms).iter().map(|&i| atoms[i as usize]).collect();
        for (weight, distance) in weights.iter().flat_map(|w| distances.iter().map(move |d| (w, d)))
        {
            for (atoms, is_compact) in [(&compact, true), (&atoms, false)] {
                let mut engine = PairsEngine::new(&potential, weight, distance);
                engine.prepare(atoms, 0.1);
                check(&mut engine, atoms, is_compact);
            }
        }
    }

    fn a_compact_order_is_taken_as_it_is<const D: usize>() {
        with_engines::<D>(|engine, atoms, is_compact| {
            assert_eq!(engine.place.is_empty(), is_compact);
            let places = engine.order.iter().zip(0..).filter(|(i, s)| **i == *s).count();
            assert!((places == atoms.len()) == is_compact);
        });
    }

    #[test]
    fn the_callers_order_is_taken_where_it_is_compact() {
        a_compact_order_is_taken_as_it_is::<2>();
        a_compact_order_is_taken_as_it_is::<3>();
    }

    fn wide_equals_plain<const D: usize>() {
        with_engines::<D>(|engine, atoms, _| {
            let mut slopes = vec![[0.0; D]; atoms.len()];
            let mut held = vec![HeldCell::NONE; atoms.len()];
            let energy = engine.gather_all(atoms, &mut slopes, &mut held);
            let mut plain = vec![[0.0; D]; atoms.len()];
            let mut held = vec![HeldCell::NONE; atoms.len()];
            let parts = plain.chunks_mut(CHUNK).zip(held.chunks_mut(CHUNK)).enumerate();
            let sum = parts.fold(Energy::default(), |sum, (c, own)| {
                let part = engine.gather::<Plain>(atoms, c, own);
                Energy { atomic: sum.atomic + part.atomic, image: sum.image + part.image }
            });
            assert_eq!((energy, slopes), (sum, plain));
        });
    }

    #[test]
    fn wide_registers_give_the_same_bits() {
        wide_equals_plain::<2>();
        wide_equals_plain::<3>();
    }

    fn held_equals_read<const D: usize>() {
        with_engines::<D>(|engine, atoms, _| {
            let mut random = Pcg64::seed_from_u64(6);
            let mut atoms = atoms.to_vec();
            let (mut held, mut read) = (vec![[0.0; D]; atoms.len()], vec![[0.0; D]; atoms.len()]);
            for _ in 0..4 {
                let with_held = engine.evaluate(&atoms, &mut held);
                engine.held.clear();
                let with_read = engine.evaluate(&atoms, &mut read);
                assert_eq!((with_held, &held), (with_read, &read));
                // some leave their cell of samples, others stay
                let moved = atoms.as_flattened_mut().iter_mut();
                moved
                    .for_each(|x| *x = (*x + 0.3 * random.random::<f64>() - 0.15).clamp(0.0, 39.0));
            }
        });
    }

    #[test]
    fn samples_held_from_before_are_those_read_anew() {
        held_equals_read::<2>();
        held_equals_read::<3>();
    }
}
