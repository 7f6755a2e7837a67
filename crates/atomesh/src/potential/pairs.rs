//! The pairs engine: energy and gradient from neighbour lists. The default.
//!
//! d and β are read at the atoms when the lists are built and kept until they are rebuilt, so that
//! energy and gradient belong to one function and a line search can trust them. Lists reach farther
//! than the cut-off by a skin and hold until an atom has moved half of it. Cost: O(n) in atoms.

use rayon::prelude::*;

use crate::distance::NominalDistance;
use crate::geometry::{Point, distance_squared};
use crate::pair;

use super::engine::{Energy, Engine, ImageWeight};
use super::image::ImagePotential;
use super::neighbors::{CHUNK, Chunk, NeighborLists, Reach};

/// How far lists reach beyond the cut-off, in nominal distances.
const SKIN: f64 = 0.5;

/// An atom as the inner loop reads it: coordinates, then the nominal distance, then β; in 3-D the first
/// four fill half a cache line.
type Packed = [f64; 4];

/// The engine that sums over pairs of near atoms, with an analytic gradient.
///
/// Departure from the paper: a pair's nominal distance is the mean of its atoms', d_ij = (dᵢ + dⱼ)/2,
/// which is symmetric and equals the paper's d(xⱼ) to first order since |∇d| ≪ 1.
pub struct PairsEngine<'a, const D: usize> {
    potential: &'a ImagePotential<D>,
    weight: &'a ImageWeight<D>,
    distance: &'a NominalDistance<D>,
    lists: NeighborLists,
    packed: Vec<Packed>,
    distances: Vec<f64>,
    /// β at the atoms; empty where both d and β are constant.
    weights: Vec<f64>,
    /// Where the atoms were when the lists were built.
    listed: Vec<Point<D>>,
}

impl<'a, const D: usize> PairsEngine<'a, D> {
    /// An engine for atoms in these fields.
    pub fn new(
        potential: &'a ImagePotential<D>,
        weight: &'a ImageWeight<D>,
        distance: &'a NominalDistance<D>,
    ) -> Self {
        Self {
            potential,
            weight,
            distance,
            lists: NeighborLists::default(),
            packed: Vec::new(),
            distances: Vec::new(),
            weights: Vec::new(),
            listed: Vec::new(),
        }
    }

    /// The farthest that an atom has moved since the lists were built, over its nominal distance.
    fn farthest_move(&self, atoms: &[Point<D>]) -> f64 {
        let squared = atoms
            .par_iter()
            .zip(&self.listed)
            .zip(&self.distances)
            .with_min_len(CHUNK)
            .map(|((p, q), d)| distance_squared(p, q) / (d * d))
            .reduce(|| 0.0, f64::max); // a maximum is the same in any order
        squared.sqrt()
    }

    fn rebuild(&mut self, atoms: &[Point<D>]) {
        let distance = self.distance;
        atoms.par_iter().map(|p| distance.at(p)).collect_into_vec(&mut self.distances);
        if !(self.distance.is_constant() && self.weight.as_constant().is_some()) {
            let weight = self.weight;
            atoms.par_iter().map(|p| weight.at(p)).collect_into_vec(&mut self.weights);
        }
        let scale = pair::CUTOFF + SKIN;
        let range: Vec<f64> = self.distances.par_iter().map(|d| scale * d).collect();
        let slope = scale * self.distance.greatest_slope();
        self.lists.build(atoms, &Reach { range: &range, slope });
        self.listed.clear();
        self.listed.extend_from_slice(atoms);
    }

    fn pack(&mut self, atoms: &[Point<D>]) {
        self.packed.resize(atoms.len(), [0.0; 4]);
        self.packed.par_iter_mut().with_min_len(CHUNK).zip(atoms).zip(&self.distances).for_each(
            |((packed, p), &d)| {
                packed[..D].copy_from_slice(p);
                packed[3] = d;
            },
        );
    }

    /// Energy and gradient of one chunk of atoms, each gathering over its own list.
    #[inline(always)]
    fn gather(&self, first: usize, chunk: &Chunk, gradient: &mut [Point<D>]) -> Energy {
        match (self.distance.is_constant(), self.weight.as_constant()) {
            (true, Some(beta)) => self.gather_with(
                first,
                chunk,
                gradient,
                &Uniform { inverse: 1.0 / self.distance.least(), weight: 1.0 - beta },
            ),
            _ => self.gather_with(first, chunk, gradient, &Graded { weights: &self.weights }),
        }
    }

    /// The same with wider registers. The operations are the same, in the same order, each rounded once,
    /// so the result is the same to the last bit.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn gather_avx2(&self, first: usize, chunk: &Chunk, gradient: &mut [Point<D>]) -> Energy {
        self.gather(first, chunk, gradient)
    }

    #[inline(always)]
    fn gather_with(
        &self,
        first: usize,
        chunk: &Chunk,
        gradient: &mut [Point<D>],
        scale: &impl Scale,
    ) -> Energy {
        let mut energy = Energy::default();
        for (a, g) in gradient.iter_mut().enumerate() {
            let i = first + a;
            let list = &chunk.neighbors[chunk.starts[a] as usize..chunk.starts[a + 1] as usize];
            let (pairs, pull) = pairs_of::<D>(&self.packed, i, list, scale);
            let atom = std::array::from_fn(|k| self.packed[i][k]);
            let mut slope = [0.0; D];
            let b = self.potential.value_and_gradient(&atom, &mut slope);
            let beta = self.weight.as_constant().unwrap_or_else(|| self.weights[i]);
            energy.atomic += 0.5 * pairs;
            energy.image += beta * b;
            *g = std::array::from_fn(|k| pull[k] + beta * slope[k]);
        }
        energy
    }
}

/// Neighbours that the inner loop takes at a time.
const LANES: usize = 8;

/// What scales a pair's distance and energy.
trait Scale {
    /// 1/d and the weight 1 − β of the pair.
    fn of(&self, i: usize, j: usize, packed: &[Packed]) -> (f64, f64);
}

/// d and β the same everywhere.
struct Uniform {
    inverse: f64,
    weight: f64,
}

impl Scale for Uniform {
    #[inline(always)]
    fn of(&self, _: usize, _: usize, _: &[Packed]) -> (f64, f64) {
        (self.inverse, self.weight)
    }
}

/// d, and β where there are weights, from atom to atom.
struct Graded<'a> {
    weights: &'a [f64],
}

impl Scale for Graded<'_> {
    #[inline(always)]
    fn of(&self, i: usize, j: usize, packed: &[Packed]) -> (f64, f64) {
        let weight = 1.0 - 0.5 * (self.weights[i] + self.weights[j]);
        (2.0 / (packed[i][3] + packed[j][3]), weight)
    }
}

/// Σ w φ(r/d) over the list of atom i, and its gradient: [`LANES`] neighbours side by side, without a
/// branch on the cut-off.
#[inline(always)]
fn pairs_of<const D: usize>(
    packed: &[Packed],
    i: usize,
    list: &[u32],
    scale: &impl Scale,
) -> (f64, Point<D>) {
    let atom = packed[i];
    let mut energy = [0.0; LANES];
    let mut pull = [[0.0; LANES]; D];
    for block in list.chunks(LANES) {
        // lanes without a neighbour stay beyond the cut-off
        let mut v = [[FAR; LANES]; D];
        let (mut inverse, mut weight) = ([1.0; LANES], [0.0; LANES]);
        for (l, &j) in block.iter().enumerate() {
            let other = &packed[j as usize];
            for k in 0..D {
                v[k][l] = atom[k] - other[k];
            }
            (inverse[l], weight[l]) = scale.of(i, j as usize, packed);
        }
        for l in 0..LANES {
            let mut r_squared = 0.0;
            for axis in &v {
                r_squared += axis[l] * axis[l];
            }
            let u = (r_squared * (inverse[l] * inverse[l])).sqrt();
            let w = if u < pair::CUTOFF { weight[l] } else { 0.0 };
            let u = u.min(pair::CUTOFF);
            energy[l] += w * pair::energy_inside(u);
            // two atoms at one place push nowhere: v is 0
            let slope = -w * pair::force_inside(u) / u.max(NEAR) * (inverse[l] * inverse[l]);
            for k in 0..D {
                pull[k][l] += slope * v[k][l];
            }
        }
    }
    (sum(&energy), pull.map(|lanes| sum(&lanes)))
}

/// Beyond any cut-off, and small enough that its square is finite.
const FAR: f64 = 1e100;
/// Below any distance of two atoms that are not at one place.
const NEAR: f64 = 1e-200;

/// The sum of the lanes, in a fixed order.
#[inline(always)]
fn sum(lanes: &[f64; LANES]) -> f64 {
    let [a, b, c, d, e, f, g, h] = *lanes;
    ((a + e) + (c + g)) + ((b + f) + (d + h))
}

impl<const D: usize> Engine<D> for PairsEngine<'_, D> {
    fn prepare(&mut self, atoms: &[Point<D>], next_move: f64) -> bool {
        let first = self.listed.len() != atoms.len();
        if !first && self.farthest_move(atoms) + next_move <= 0.5 * SKIN {
            return false;
        }
        self.rebuild(atoms);
        first || !self.distance.is_constant() || self.weight.as_constant().is_none()
    }

    fn evaluate(&mut self, atoms: &[Point<D>], gradient: &mut [Point<D>]) -> Energy {
        self.pack(atoms);
        let this = &*self;
        #[cfg(target_arch = "x86_64")]
        let wide = std::arch::is_x86_feature_detected!("avx2");
        let parts: Vec<Energy> = gradient
            .par_chunks_mut(CHUNK)
            .zip(&this.lists.chunks)
            .enumerate()
            .map(|(c, (gradient, chunk))| {
                #[cfg(target_arch = "x86_64")]
                if wide {
                    // SAFETY: the processor has been asked whether it has these instructions.
                    return unsafe { this.gather_avx2(c * CHUNK, chunk, gradient) };
                }
                this.gather(c * CHUNK, chunk, gradient)
            })
            .collect();
        parts.iter().fold(Energy::default(), |sum, part| Energy {
            atomic: sum.atomic + part.atomic,
            image: sum.image + part.image,
        })
    }

    fn distances(&self) -> &[f64] {
        &self.distances
    }
}
