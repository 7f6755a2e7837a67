//! Facets turn onto features: swaps first, then moves ([`super::moves`]).
//!
//! Both raise Σ over facets of [`Valley::worth`] / d² − [`STIFFNESS`] · Σ over cells of (1 − q), d being the length
//! of the edges around, and leave no cell below the floor that was not below it before.

use super::heal::{Effort, remove_edge, remove_facet, through_facet};
use super::patch::{NONE, Patch};
use super::ring::Ring;
use super::valley::{Contrast, LEAST_DEPTH, Valley};
use crate::geometry::distance_squared;

/// What a cell's shape weighs against a facet's depth. On a brain at d = 6, 0.15 brought a recall of 0.696 at a mean
/// quality of 0.864, this 0.707 at 0.860.
pub(super) const STIFFNESS: f64 = 0.08;
/// What a swap must gain, so that none goes in circles.
const GAIN: f64 = 1e-3;
/// A valley crosses an edge where it is deeper than at both ends by this.
pub(super) const DEEPER: f64 = 0.05;
/// Where on an edge valleys are looked for, beside its middle.
const SHARES: [f64; 2] = [0.2, 0.8];
/// Where an edge is no deeper than this at its ends and middle, no valley is near.
const NOTHING: f64 = 0.02;
/// A point this deep, between the least and the greatest depth around, may be a corner of a facet in the valley.
pub(super) const NEAR: f64 = 0.2;

/// What alignment works with.
pub(super) struct Aligner<'a> {
    pub valley: &'a Valley<'a>,
    /// The greatest cosine that swaps and moves may leave.
    pub floor: f64,
    /// The depth at each point of the patch.
    pub depths: Vec<f64>,
}

/// By what facets are measured in one place: over the square of a length, between two depths.
#[derive(Clone, Copy)]
pub(super) struct Scale {
    pub area: f64,
    pub contrast: Contrast,
}

impl<'a> Aligner<'a> {
    pub fn new(valley: &'a Valley<'a>, floor: f64, patch: &Patch) -> Self {
        Self { valley, floor, depths: patch.points.iter().map(|p| valley.depth(p)).collect() }
    }

    fn facet(&self, patch: &Patch, corners: [u32; 3], scale: &Scale) -> f64 {
        let facet = corners.map(|c| patch.points[c as usize]);
        scale.area * self.valley.worth(&facet, &scale.contrast)
    }

    /// What a cell costs; more than anything gains if it is below the floor.
    fn cost(&self, patch: &Patch, corners: &[u32; 4]) -> f64 {
        let shape = patch.shape_of(corners);
        if shape.cosine > self.floor { f64::INFINITY } else { STIFFNESS * (1.0 - shape.quality) }
    }

    /// What a cell that is there costs; one below the floor is not held against those that replace it.
    pub fn cost_now(&self, patch: &Patch, cell: u32) -> f64 {
        STIFFNESS * (1.0 - patch.shapes[cell as usize].quality)
    }

    /// Takes out edges that a valley crosses between their ends, and puts edges that lie in one through facets.
    pub fn swap(&self, patch: &mut Patch, open: &[bool], effort: &mut Effort) {
        for (cell, a, b, depth) in self.crossed_edges(patch, open) {
            if let Some(cell) = patch.cell_with(cell, a, b) {
                let ends = [patch.place(cell, a), patch.place(cell, b)];
                effort.swaps += usize::from(self.swap_edge(patch, cell, ends, depth));
            }
        }
        for cell in 0..patch.slot_count() {
            for k in 0..4 {
                if patch.is_alive(cell) && self.is_passed(patch, cell, k, open) {
                    effort.swaps += usize::from(self.swap_facet(patch, cell, k));
                }
            }
        }
    }

    /// The edges that a valley crosses between their ends, each with a cell that has it and the depth there.
    fn crossed_edges(&self, patch: &mut Patch, open: &[bool]) -> Vec<(u32, u32, u32, f64)> {
        let mut edges = Vec::new();
        patch.each_edge(open, |patch, cell, a, b| {
            let ends = self.depths[a as usize].max(self.depths[b as usize]);
            let middle = self.on_way(patch, a, b, 0.5);
            if ends.max(middle) < NOTHING {
                return; // far from every valley
            }
            let depth =
                SHARES.iter().fold(middle, |depth, &s| depth.max(self.on_way(patch, a, b, s)));
            if depth > (ends + DEEPER).max(LEAST_DEPTH) {
                edges.push((cell, a, b, depth));
            }
        });
        edges
    }

    /// The depth at a share of the way from a to b.
    #[inline]
    pub fn on_way(&self, patch: &Patch, a: u32, b: u32, share: f64) -> f64 {
        let (p, q) = (&patch.points[a as usize], &patch.points[b as usize]);
        self.valley.depth(&std::array::from_fn(|k| p[k] + share * (q[k] - p[k])))
    }

    /// Whether the points on both sides of a facet lie in one valley.
    fn is_passed(&self, patch: &Patch, cell: u32, k: usize, open: &[bool]) -> bool {
        let depths = &self.depths;
        let d = patch.corners[cell as usize][k];
        let beyond = patch.neighbours[cell as usize][k];
        if beyond == NONE || beyond < cell || depths[d as usize] < LEAST_DEPTH {
            return false;
        }
        let e = patch.corners[beyond as usize][patch.back(cell, k)];
        let ends = 0.5 * (depths[d as usize] + depths[e as usize]);
        let is_near = |k: usize| depths[patch.corners[cell as usize][k] as usize] > 0.6 * ends;
        (open[d as usize] || open[e as usize])
            && depths[e as usize] >= LEAST_DEPTH
            && (1..4).any(|n| is_near((k + n) & 3))
            && self.on_way(patch, d, e, 0.5) > 0.8 * ends
    }

    fn swap_edge(&self, patch: &mut Patch, cell: u32, [i, j]: [usize; 2], depth: f64) -> bool {
        let Some(ring) = Ring::around(patch, cell, i, j) else { return false };
        let [a, b] = ring.ends;
        let mut contrast = Contrast::NONE;
        let around = ring.points[..ring.count].iter().chain(&ring.ends);
        around.for_each(|&p| contrast.include(self.depths[p as usize]));
        contrast.include(depth);
        let is_near = |p: &&u32| contrast.of(self.depths[**p as usize]) > NEAR;
        if ring.points[..ring.count].iter().filter(is_near).count() < 3 {
            return false;
        }
        let scale = &Scale { area: 1.0 / size_squared(patch, &ring), contrast };
        let facets = ring.points[..ring.count].iter().map(|&p| self.facet(patch, [a, b, p], scale));
        let costs = ring.cells().iter().map(|&cell| self.cost_now(patch, cell));
        let now = facets.sum::<f64>() - costs.sum::<f64>();
        let last = ring.count - 1;
        let worth = |ring: &Ring, i: usize, k: usize, j: usize| {
            let cost: f64 = ring.pair(i, k, j).iter().map(|c| self.cost(patch, c)).sum();
            if cost == f64::INFINITY {
                return f64::NEG_INFINITY;
            }
            let [x, y, z] = [i, k, j].map(|n| ring.points[n]);
            let triangle = self.facet(patch, [x, y, z], scale);
            if (i, j) == (0, last) {
                return triangle - cost;
            }
            let chord = self.facet(patch, [x, z, a], scale) + self.facet(patch, [x, z, b], scale);
            triangle + chord - cost
        };
        match ring.fill(f64::NEG_INFINITY, worth, |a, b| a + b, 0.0) {
            Some(filling) if filling.worth > now + GAIN => {
                remove_edge(patch, &ring, &filling);
                true
            }
            _ => false,
        }
    }

    fn swap_facet(&self, patch: &mut Patch, cell: u32, k: usize) -> bool {
        let Some(cells) = through_facet(patch, cell, k) else { return false };
        let cost: f64 = cells.iter().map(|corners| self.cost(patch, corners)).sum();
        if cost == f64::INFINITY {
            return false;
        }
        let [[d, p, q, e], [_, _, r, _], _] = cells;
        let at = |point: u32| &patch.points[point as usize];
        let edges =
            [p, q, r].map(|x| distance_squared(at(x), at(d)) + distance_squared(at(x), at(e)));
        let mut contrast = Contrast::NONE;
        [p, q, r, d, e].iter().for_each(|&p| contrast.include(self.depths[p as usize]));
        contrast.include(self.on_way(patch, d, e, 0.5));
        let scale = &Scale { area: 6.0 / edges.iter().sum::<f64>(), contrast };
        let facets = [p, q, r].map(|x| self.facet(patch, [d, e, x], scale));
        let beyond = patch.neighbours[cell as usize][k];
        let cost_now = self.cost_now(patch, cell) + self.cost_now(patch, beyond);
        let now = self.facet(patch, [p, q, r], scale) - cost_now;
        if facets.iter().sum::<f64>() - cost > now + GAIN {
            remove_facet(patch, cell, k);
            return true;
        }
        false
    }
}

/// The mean square of the distances between an edge's ends and the points around it.
fn size_squared(patch: &Patch, ring: &Ring) -> f64 {
    let at = |point: u32| &patch.points[point as usize];
    let around = ring.points[..ring.count].iter().map(|&p| {
        distance_squared(at(p), at(ring.ends[0])) + distance_squared(at(p), at(ring.ends[1]))
    });
    around.sum::<f64>() / (2 * ring.count) as f64
}
