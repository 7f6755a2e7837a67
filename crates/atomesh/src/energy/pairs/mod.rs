//! The pairs engine: energy and gradient from neighbour lists. The default.
//!
//! d and β are read at the atoms and kept until one has moved far, so that energy and gradient belong to
//! one function and a line search can trust them. Lists reach farther than the cut-off by a skin and
//! hold until an atom has moved half of it; a thin skin, rebuilt often, costs less than a thick one.
//!
//! Lists are found in a tree of boxes over atoms in a compact order ([`compact_order`]). If the caller's
//! order is compact it is kept, and memory is read and written in runs; else the engine keeps its own
//! order, and renews it once atoms have moved so much that the boxes have grown. Cost: O(n) in atoms.

mod gather;
#[cfg(test)]
mod tests;

use crate::parallel::prelude::*;

use crate::fields::{FieldsView, HeldCell};
use crate::geometry::{Bounds, Point, compact_order, distance_squared};

use super::engine::{Energy, Engine};
use super::lanes::LANES;
use super::neighbors::{CHUNK, NeighborLists};
use super::pair;
use super::tree::{Scaling, Tree};

/// How far lists reach beyond the cut-off, over the nominal distance; farther if a longer move is announced.
const SKIN: f64 = 0.2;
/// How far an atom may move, over its nominal distance, before d and β are read again.
const STALE: f64 = 0.25;
/// How much the tree's boxes may grow before the order is renewed, and how much larger than cubes of eight
/// atoms they may be for the caller's order to be kept.
const LOOSE: f64 = 1.5;

/// The engine that sums over pairs of near atoms, with an analytic gradient.
///
/// Departure from the paper: a pair's nominal distance is the mean of its atoms', d_ij = (dᵢ + dⱼ)/2,
/// which is symmetric and equals the paper's d(xⱼ) to first order since |∇d| ≪ 1.
pub struct PairsEngine<'a, const D: usize> {
    fields: FieldsView<'a, D>,
    tree: Tree<D>,
    scaling: Scaling<D>,
    /// The girth of the tree's boxes when atoms were last put in order.
    girth: f64,
    /// The atom at each place of the tree, and, unless that is the caller's order, the place of each atom.
    order: Vec<u32>,
    place: Vec<u32>,
    lists: NeighborLists,
    skin: f64,
    /// d at the atoms.
    distances: Vec<f64>,
    /// β at the atoms, if it varies.
    weights: Vec<f64>,
    /// Where the atoms were when d and β were read, if one of these varies.
    read: Vec<Point<D>>,
    /// Where they were when the lists were built.
    listed: Vec<Point<D>>,
    /// The gradient in the tree's order, where that is not the caller's.
    slopes: Vec<Point<D>>,
    /// The samples around each atom as last read, in the tree's order: most atoms stay in their cell of
    /// samples from one evaluation to the next, and these follow each other in memory.
    held: Vec<HeldCell>,
}

impl<'a, const D: usize> PairsEngine<'a, D> {
    /// An engine for atoms in these fields.
    pub fn new(fields: FieldsView<'a, D>) -> Self {
        Self {
            fields,
            tree: Tree::default(),
            scaling: Scaling::new(&fields.potential.grid().bounds()),
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
        self.fields.distance.is_constant() && self.fields.weight.as_constant().is_some()
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
        let FieldsView { distance, weight, .. } = self.fields;
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
        chunks.reduce_with(wider).unwrap_or_else(|| self.fields.potential.grid().bounds())
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
}

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
        // a move of a nominal distance or more never happens: no skin is made for it
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
