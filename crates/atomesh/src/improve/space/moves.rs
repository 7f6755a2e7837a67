//! Points move so that their facets come onto valleys.
//!
//! Two moves are tried for each point. The first fits its facets to the valley that they lie along, by least squares
//! ([`Valley::pull`]); if it is small, it is taken for what it is, since what it gains is of second order and would be
//! lost in the shape's energy. The second falls straight down to the valley's bottom.

use super::align::{Aligner, NEAR, STIFFNESS, Scale};
use super::heal::Effort;
use super::patch::{NONE, Patch};
use super::shape::shape;
use super::smooth::facing;
use super::valley::{Contrast, LEAST_DEPTH, System, worth};
use crate::geometry::{Point, distance_squared, dot};

/// What a move must gain, and the share of the edges' length that it must go.
const LEAST_GAIN: f64 = 1e-5;
const LEAST_MOVE: f64 = 0.002;
/// A fit is small up to this share of the edges' length, and may cost this much of shape.
const FINE: f64 = 0.05;
const FINE_LOSS: f64 = 0.02;
/// How far a point falls into a valley, in the edges' length.
const REACH: f64 = 0.5;
/// What the depth at a point itself weighs against that of its facets: it stands for those that cross the valley.
const OWN: f64 = 1.0;
/// Facets of a lesser mean depth, between the least and the greatest, are left out of account.
const DEEP: f64 = 0.45;

/// What a point has before it moves.
struct Start {
    scale: Scale,
    worth: f64,
    cost: f64,
    /// The greatest cosine that moves may leave: the floor, or what there is.
    limit: f64,
    /// The mean square of the lengths around.
    size: f64,
    /// The move that fits its facets.
    fit: Option<Point<3>>,
}

impl Aligner<'_> {
    /// Moves points near valleys so that their facets come onto them.
    pub fn moves(&mut self, patch: &mut Patch, open: &[bool], effort: &mut Effort) {
        let mut room = Room::default();
        for point in 0..patch.points.len() as u32 {
            if patch.freedom[point as usize] != 0
                && open[point as usize]
                && let Some(to) = self.better_place(patch, point, &mut room)
            {
                patch.move_point(point, to, &room.star);
                self.depths[point as usize] = self.valley.depth(&to);
                effort.moves += 1;
            }
        }
    }

    /// A place where a point's facets are worth more.
    fn better_place(&self, patch: &mut Patch, point: u32, room: &mut Room) -> Option<Point<3>> {
        let start = self.start(patch, point, room)?;
        let freedom = patch.freedom[point as usize];
        if let Some(shift) = start.fit {
            let is_fine = dot(&shift, &shift) < FINE * FINE * start.size;
            let place = self.first_better(room, &start, &shift, [1.0, 0.4], is_fine);
            if place.is_some() {
                return place;
            }
        }
        let mut shift = self.valley.fall(&room.at, REACH * start.size.sqrt())?;
        (0..3).filter(|k| freedom >> k & 1 == 0).for_each(|k| shift[k] = 0.0);
        self.first_better(room, &start, &shift, [1.0, 0.6], false)
    }

    /// What a point has where it is; `None` if no facet of it is near a valley.
    fn start(&self, patch: &mut Patch, point: u32, room: &mut Room) -> Option<Start> {
        room.gather(patch, point);
        let mut contrast = Contrast::NONE;
        let corners = room.star.iter().flat_map(|&cell| patch.corners[cell as usize]);
        corners.for_each(|c| contrast.include(self.depths[c as usize]));
        if contrast.high < LEAST_DEPTH {
            return None;
        }
        room.find_rims(patch, point, |p| contrast.of(self.depths[p as usize]) > NEAR);
        if room.rims.len() < 2 {
            return None;
        }
        room.means.clear();
        for rim in &room.rims {
            let mean = self.valley.mean_of(&[room.at, rim[0], rim[1]], &mut contrast);
            room.means.push(mean);
        }
        room.keep_deep(&contrast);
        let size = room.size_squared();
        let scale = Scale { area: 1.0 / size, contrast };
        let mut total = OWN * contrast.of(self.depths[point as usize]).powi(2);
        let mut system = System::default();
        for (rim, mean) in room.rims.iter().zip(&room.means) {
            let facet = [room.at, rim[0], rim[1]];
            self.valley.pull(&facet, *mean, &contrast, &mut system);
            total += scale.area * worth(&facet, *mean, &contrast);
        }
        let cost = room.star.iter().map(|&cell| self.cost_now(patch, cell)).sum();
        let cosines = room.star.iter().map(|&cell| patch.shapes[cell as usize].cosine);
        let limit = cosines.fold(self.floor, f64::max);
        let fit = system.solve(patch.freedom[point as usize]);
        Some(Start { scale, worth: total, cost, limit, size, fit })
    }

    /// The first of some shares of a move that is better than none.
    fn first_better(
        &self,
        room: &Room,
        start: &Start,
        shift: &Point<3>,
        shares: [f64; 2],
        is_fine: bool,
    ) -> Option<Point<3>> {
        if dot(shift, shift) < LEAST_MOVE * LEAST_MOVE * start.size {
            return None;
        }
        let places = shares.map(|share| std::array::from_fn(|k| room.at[k] + share * shift[k]));
        places.into_iter().find(|to| {
            let Some(cost) = cost_at(room, to, start.limit) else { return false };
            if is_fine {
                return cost < start.cost + FINE_LOSS;
            }
            self.worth_at(room, to, &start.scale) - cost > start.worth - start.cost + LEAST_GAIN
        })
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

/// The cost of a point's cells if it were elsewhere; `None` if a cosine were above `limit`.
fn cost_at(room: &Room, at: &Point<3>, limit: f64) -> Option<f64> {
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

/// What lies around one point.
#[derive(Default)]
pub(super) struct Room {
    /// Where it is.
    at: Point<3>,
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
        self.at = patch.points[point as usize];
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
    fn size_squared(&self) -> f64 {
        let sum: f64 = self.facing.iter().flatten().map(|p| distance_squared(p, &self.at)).sum();
        sum / (3 * self.facing.len().max(1)) as f64
    }
}
