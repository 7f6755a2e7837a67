//! Facets turn onto features: swaps first, then moves.
//!
//! Both raise Σ over facets of [`Valley::worth`] / d² − stiffness · Σ over cells of (1 − q), d being the length of
//! the edges around, and leave no cell below the floor that was not below it before.

use super::heal::{Effort, remove_edge, remove_facet, through_facet};
use super::patch::{NONE, Patch};
use super::ring::Ring;
use super::shape::shape;
use super::smooth::facing;
use super::valley::{Contrast, LEAST_DEPTH, System, Valley, worth};
use crate::geometry::{Point, distance_squared};

/// What a cell's shape weighs against a facet's depth.
pub(super) const STIFFNESS: f64 = 0.08;
/// What a swap must gain, so that none goes in circles.
const GAIN: f64 = 1e-3;
/// What a move must gain, and the share of the edges' length that it must go.
const LEAST_GAIN: f64 = 1e-5;
const LEAST_MOVE: f64 = 0.002;
const FINE: f64 = 0.05;
const FINE_LOSS: f64 = 0.02;
/// How far a point falls into a valley, in the edges' length.
const REACH: f64 = 0.5;
/// A valley crosses an edge where it is deeper than at both ends by this.
const DEEPER: f64 = 0.05;

/// Where on an edge valleys are looked for.
const SHARES: [f64; 5] = [0.17, 0.33, 0.5, 0.67, 0.83];
/// A point this deep, between the least and the greatest depth around, may be a corner of a facet in the valley.
const NEAR: f64 = 0.2;

/// What the depth at a point itself weighs against that of its facets.
const OWN: f64 = 1.0;
/// Facets of a lesser mean depth, between the least and the greatest, are left out of account.
const DEEP: f64 = 0.45;

/// What alignment works with.
pub(super) struct Aligner<'a> {
    valley: &'a Valley<'a>,
    /// The greatest cosine that swaps and moves may leave.
    floor: f64,
    /// The depth at each point of the patch.
    depths: Vec<f64>,
}

/// By what facets are measured in one place: over the square of a length, between two depths.
#[derive(Clone, Copy)]
struct Scale {
    area: f64,
    contrast: Contrast,
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
    fn cost_now(&self, patch: &Patch, cell: u32) -> f64 {
        STIFFNESS * (1.0 - patch.shapes[cell as usize].quality)
    }

    /// Takes out edges that a valley crosses between their ends, and puts edges that lie in one through facets.
    pub fn swap(&mut self, patch: &mut Patch, open: &[bool], effort: &mut Effort) {
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
            let depth = SHARES.map(|share| self.on_way(patch, a, b, share)).into_iter();
            let depth = depth.fold(0.0, f64::max);
            if depth > (ends + DEEPER).max(LEAST_DEPTH) {
                edges.push((cell, a, b, depth));
            }
        });
        edges
    }

    /// The depth at a share of the way from a to b.
    #[inline]
    fn on_way(&self, patch: &Patch, a: u32, b: u32, share: f64) -> f64 {
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

    /// Moves points near valleys so that their facets come onto them.
    pub fn moves(&mut self, patch: &mut Patch, open: &[bool], effort: &mut Effort) {
        let mut room = Room::default();
        for point in 0..patch.points.len() as u32 {
            if patch.freedom[point as usize] != 0 && open[point as usize] {
                effort.moves += usize::from(self.move_point(patch, point, &mut room));
            }
        }
    }

    fn move_point(&mut self, patch: &mut Patch, point: u32, room: &mut Room) -> bool {
        room.gather(patch, point);
        let at = patch.points[point as usize];
        let mut contrast = Contrast::NONE;
        let corners = room.star.iter().flat_map(|&cell| patch.corners[cell as usize]);
        corners.for_each(|c| contrast.include(self.depths[c as usize]));
        if contrast.high < LEAST_DEPTH {
            return false;
        }
        let is_near = |point: u32| contrast.of(self.depths[point as usize]) > NEAR;
        room.find_rims(patch, point, is_near);
        if room.rims.len() < 2 {
            return false;
        }
        room.means.clear();
        for rim in &room.rims {
            let mean = self.valley.mean_of(&[at, rim[0], rim[1]], &mut contrast);
            room.means.push(mean);
        }
        room.keep_deep(&contrast);
        let freedom = patch.freedom[point as usize];
        let size = room.size_squared(&at);
        let mut system = System::default();
        let scale = Scale { area: 1.0 / size, contrast };
        let (mut now, mut worst) =
            (OWN * contrast.of(self.depths[point as usize]).powi(2), -1.0_f64);
        for (rim, mean) in room.rims.iter().zip(&room.means) {
            let facet = [at, rim[0], rim[1]];
            self.valley.pull(&facet, *mean, &contrast, &mut system);
            now += scale.area * worth(&facet, *mean, &contrast);
        }
        let mut cost_now = 0.0;
        for &cell in &room.star {
            cost_now += self.cost_now(patch, cell);
            worst = worst.max(patch.shapes[cell as usize].cosine);
        }
        let limit = self.floor.max(worst);
        let fitted = system.solve(freedom).map(|shift| (shift, [1.0, 0.4]));
        let fallen = || {
            let mut shift = self.valley.fall(&at, REACH * size.sqrt())?;
            (0..3).filter(|k| freedom >> k & 1 == 0).for_each(|k| shift[k] = 0.0);
            Some((shift, [1.0, 0.6]))
        };
        for n in 0..2 {
            let Some((shift, shares)) = (if n == 0 { fitted } else { fallen() }) else { continue };
            if shift.iter().map(|x| x * x).sum::<f64>() < LEAST_MOVE * LEAST_MOVE * size {
                continue;
            }
            let is_fine = n == 0 && shift.iter().map(|x| x * x).sum::<f64>() < FINE * FINE * size;
            for share in shares {
                let to = std::array::from_fn(|k| at[k] + share * shift[k]);
                let Some(cost) = self.cost_at(room, &to, limit) else { continue };
                let is_better = if is_fine {
                    cost < cost_now + FINE_LOSS
                } else {
                    self.worth_at(room, &to, &scale) - cost > now - cost_now + LEAST_GAIN
                };
                if is_better {
                    patch.move_point(point, to, &room.star);
                    self.depths[point as usize] = self.valley.depth(&to);
                    return true;
                }
            }
        }
        false
    }

    /// The cost of a point's cells if it were elsewhere; `None` if a cosine were above `limit`.
    fn cost_at(&self, room: &Room, at: &Point<3>, limit: f64) -> Option<f64> {
        let mut sum = 0.0;
        for [p, q, r] in &room.facing {
            let shape = shape(p, q, r, at);
            if shape.cosine > limit {
                return None;
            }
            sum += STIFFNESS * (1.0 - shape.quality);
        }
        Some(sum)
    }

    /// The worth of a point's facets, and of its own place, if it were elsewhere.
    fn worth_at(&self, room: &Room, at: &Point<3>, scale: &Scale) -> f64 {
        let facets = room.rims.iter().map(|rim| {
            let facet = [*at, rim[0], rim[1]];
            scale.area * self.valley.worth(&facet, &scale.contrast)
        });
        OWN * scale.contrast.of(self.valley.depth(at)).powi(2) + facets.sum::<f64>()
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

/// What lies around one point.
#[derive(Default)]
struct Room {
    star: Vec<u32>,
    /// The facets of its cells opposite it.
    facing: Vec<[Point<3>; 3]>,
    /// The far edges of its own facets, where they lie in a valley.
    rims: Vec<[Point<3>; 2]>,
    /// The mean depths along these.
    means: Vec<f64>,
}

impl Room {
    fn gather(&mut self, patch: &mut Patch, point: u32) {
        self.star.clear();
        patch.star(point, &mut self.star);
    }

    /// Finds the facets around the point, and of its own those whose far corners are near a valley.
    fn find_rims(&mut self, patch: &Patch, point: u32, is_near: impl Fn(u32) -> bool) {
        self.facing.clear();
        self.rims.clear();
        for &cell in &self.star {
            self.facing.push(facing(patch, cell, point));
            let corners = &patch.corners[cell as usize];
            let k = patch.place(cell, point);
            for n in 1..4 {
                let beyond = patch.neighbours[cell as usize][(k + n) & 3];
                // each facet from one side, none of the hull
                if beyond != NONE && beyond > cell {
                    let ends = [n % 3 + 1, (n + 1) % 3 + 1].map(|m| corners[(k + m) & 3]);
                    if is_near(ends[0]) && is_near(ends[1]) {
                        self.rims.push(ends.map(|c| patch.points[c as usize]));
                    }
                }
            }
        }
    }

    /// Forgets facets that are worth next to nothing.
    fn keep_deep(&mut self, contrast: &Contrast) {
        let mut kept = 0;
        for n in 0..self.rims.len() {
            if contrast.of(self.means[n]) > DEEP {
                (self.rims[kept], self.means[kept]) = (self.rims[n], self.means[n]);
                kept += 1;
            }
        }
        self.rims.truncate(kept);
        self.means.truncate(kept);
    }

    /// The mean square of the distances to the far points.
    fn size_squared(&self, at: &Point<3>) -> f64 {
        let sum: f64 = self.facing.iter().flatten().map(|p| distance_squared(p, at)).sum();
        sum / (3 * self.facing.len().max(1)) as f64
    }
}
