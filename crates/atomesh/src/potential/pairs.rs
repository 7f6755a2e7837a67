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
const SKIN: f64 = 0.3;

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
    /// β at the atoms, where it is not constant.
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
        if self.weight.as_constant().is_none() {
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
    fn gather(&self, first: usize, chunk: &Chunk, gradient: &mut [Point<D>]) -> Energy {
        let mut energy = Energy::default();
        for (a, g) in gradient.iter_mut().enumerate() {
            let i = first + a;
            let list = &chunk.neighbors[chunk.starts[a] as usize..chunk.starts[a + 1] as usize];
            let atom = std::array::from_fn(|k| self.packed[i][k]);
            let mut slope = [0.0; D];
            let b = self.potential.value_and_gradient(&atom, &mut slope);
            let (beta, (pairs, pull)) = match self.weight.as_constant() {
                Some(beta) => (beta, self.pairs_of(i, list, |_| 1.0 - beta)),
                None => {
                    let beta = self.weights[i];
                    (beta, self.pairs_of(i, list, |j| 1.0 - 0.5 * (beta + self.weights[j])))
                }
            };
            energy.atomic += 0.5 * pairs;
            energy.image += beta * b;
            *g = std::array::from_fn(|k| pull[k] + beta * slope[k]);
        }
        energy
    }

    /// Σ w φ(r/d) over the list of atom i, and its gradient.
    #[inline]
    fn pairs_of(&self, i: usize, list: &[u32], weight: impl Fn(usize) -> f64) -> (f64, Point<D>) {
        let atom = &self.packed[i];
        let mut energy = 0.0;
        let mut pull = [0.0; D];
        for &j in list {
            let other = &self.packed[j as usize];
            let mut v = [0.0; D];
            let mut r_squared = 0.0;
            for k in 0..D {
                v[k] = atom[k] - other[k];
                r_squared += v[k] * v[k];
            }
            let d = 0.5 * (atom[3] + other[3]);
            let reach = pair::CUTOFF * d;
            if r_squared < reach * reach {
                let w = weight(j as usize);
                let r = r_squared.sqrt();
                let u = r / d;
                energy += w * pair::energy_inside(u);
                // two atoms at one place push nowhere
                let slope = if r > 0.0 { -w * pair::force_inside(u) / (d * r) } else { 0.0 };
                for k in 0..D {
                    pull[k] += slope * v[k];
                }
            }
        }
        (energy, pull)
    }
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
        let parts: Vec<Energy> = gradient
            .par_chunks_mut(CHUNK)
            .zip(&this.lists.chunks)
            .enumerate()
            .map(|(c, (gradient, chunk))| this.gather(c * CHUNK, chunk, gradient))
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
