//! Points move so that their facets come onto valleys.
//!
//! Two moves are tried for each point. The first fits its facets to the valley that they lie along, by least squares
//! ([`DepthField::fit_facet`]). A small fit is taken even if it costs a little shape, since what it gains is of second
//! order and would be lost in the shape's energy. The second move goes straight down to the valley's bottom.

use super::align::{Aligner, NEAR, STIFFNESS, Scale};
use super::depth::{Contrast, LEAST_DEPTH, worth};
use super::fit::MoveFit;
use super::shape::shape;
use super::slivers::Effort;
use super::smooth::opposite_facet;
use super::tetrahedra::{NONE, Tetrahedra};
use crate::geometry::{Point, distance_squared, dot};

/// What a move must gain, and how far it must go, over the edges' length.
const LEAST_GAIN: f64 = 1e-5;
const LEAST_MOVE: f64 = 0.002;
/// A fit is small up to this share of the edges' length. It may then cost this much shape.
const FINE: f64 = 0.05;
const FINE_LOSS: f64 = 0.02;
/// How far a point may go straight down to a valley's bottom, over the edges' length.
const REACH: f64 = 0.5;
/// The weight of the depth at a point itself, which stands for its facets that cross the valley.
const OWN: f64 = 1.0;
/// Facets of a lesser mean depth, relative to the contrast, do not count.
const DEEP: f64 = 0.45;

/// What a point has before it moves.
struct Start {
    scale: Scale,
    worth: f64,
    cost: f64,
    /// The greatest cosine that moves may leave: the floor, or what there is.
    cosine_limit: f64,
    /// The mean square of the lengths around.
    size: f64,
    /// The move that fits its facets.
    fit: Option<Point<3>>,
}

impl Aligner<'_> {
    /// Moves points near valleys so that their facets come onto them.
    pub fn moves(&mut self, tetrahedra: &mut Tetrahedra, active: &[bool], effort: &mut Effort) {
        let mut around = Surroundings::default();
        for point in 0..tetrahedra.points.len() as u32 {
            if tetrahedra.freedom[point as usize] != 0
                && active[point as usize]
                && let Some(to) = self.better_place(tetrahedra, point, &mut around)
            {
                tetrahedra.move_point(point, to, &around.star);
                self.depths[point as usize] = self.field.depth(&to);
                effort.moves += 1;
            }
        }
    }

    /// A place where a point's facets are worth more.
    fn better_place(
        &self,
        tetrahedra: &mut Tetrahedra,
        point: u32,
        around: &mut Surroundings,
    ) -> Option<Point<3>> {
        let start = self.start(tetrahedra, point, around)?;
        let freedom = tetrahedra.freedom[point as usize];
        if let Some(shift) = start.fit {
            let is_fine = dot(&shift, &shift) < FINE * FINE * start.size;
            let place = self.first_better(around, &start, &shift, [1.0, 0.4], is_fine);
            if place.is_some() {
                return place;
            }
        }
        let mut shift = self.field.shift_to_bottom(&around.at, REACH * start.size.sqrt())?;
        (0..3).filter(|k| freedom >> k & 1 == 0).for_each(|k| shift[k] = 0.0);
        self.first_better(around, &start, &shift, [1.0, 0.6], false)
    }

    /// What a point has where it is; `None` if no facet of it is near a valley.
    fn start(
        &self,
        tetrahedra: &mut Tetrahedra,
        point: u32,
        around: &mut Surroundings,
    ) -> Option<Start> {
        around.gather(tetrahedra, point);
        let mut contrast = Contrast::NONE;
        let corners = around.star.iter().flat_map(|&cell| tetrahedra.corners[cell as usize]);
        corners.for_each(|c| contrast.include(self.depths[c as usize]));
        if contrast.high < LEAST_DEPTH {
            return None;
        }
        around.find_far_edges(tetrahedra, point, |p| {
            contrast.relative(self.depths[p as usize]) > NEAR
        });
        if around.far_edges.len() < 2 {
            return None;
        }
        around.means.clear();
        for &[a, b] in &around.far_edges {
            let mean = self.field.mean_depth_within(&[around.at, a, b], &mut contrast);
            around.means.push(mean);
        }
        around.keep_deep(&contrast);
        let size = around.size_squared();
        let scale = Scale { area: 1.0 / size, contrast };
        let mut total = OWN * contrast.relative(self.depths[point as usize]).powi(2);
        let mut fit = MoveFit::default();
        for (&[a, b], mean) in around.far_edges.iter().zip(&around.means) {
            let facet = [around.at, a, b];
            self.field.fit_facet(&facet, *mean, &contrast, &mut fit);
            total += scale.area * worth(&facet, *mean, &contrast);
        }
        let cost = around.star.iter().map(|&cell| self.cost_now(tetrahedra, cell)).sum();
        let cosines = around.star.iter().map(|&cell| tetrahedra.shapes[cell as usize].cosine);
        let cosine_limit = cosines.fold(self.cosine_limit, f64::max);
        let fit = fit.solve(tetrahedra.freedom[point as usize]);
        Some(Start { scale, worth: total, cost, cosine_limit, size, fit })
    }

    /// The first of some shares of a move that is better than no move.
    fn first_better(
        &self,
        around: &Surroundings,
        start: &Start,
        shift: &Point<3>,
        shares: [f64; 2],
        is_fine: bool,
    ) -> Option<Point<3>> {
        if dot(shift, shift) < LEAST_MOVE * LEAST_MOVE * start.size {
            return None;
        }
        let places = shares.map(|share| std::array::from_fn(|k| around.at[k] + share * shift[k]));
        places.into_iter().find(|to| {
            let Some(cost) = cost_at(around, to, start.cosine_limit) else { return false };
            if is_fine {
                return cost < start.cost + FINE_LOSS;
            }
            self.worth_at(around, to, &start.scale) - cost > start.worth - start.cost + LEAST_GAIN
        })
    }

    /// The worth of a point's facets, and of its own place, if it were elsewhere.
    fn worth_at(&self, around: &Surroundings, at: &Point<3>, scale: &Scale) -> f64 {
        let facets = around.far_edges.iter().map(|&[a, b]| {
            let facet = [*at, a, b];
            scale.area * self.field.worth(&facet, &scale.contrast)
        });
        OWN * scale.contrast.relative(self.field.depth(at)).powi(2) + facets.sum::<f64>()
    }
}

/// The cost of a point's cells if it were elsewhere; `None` if a cosine were above `cosine_limit`.
fn cost_at(around: &Surroundings, at: &Point<3>, cosine_limit: f64) -> Option<f64> {
    let mut sum = 0.0;
    for [p, q, r] in &around.opposite {
        let shape = shape(p, q, r, at);
        if shape.cosine > cosine_limit {
            return None;
        }
        sum += STIFFNESS * (1.0 - shape.quality);
    }
    Some(sum)
}

/// What lies around one point.
#[derive(Default)]
pub(super) struct Surroundings {
    /// Where it is.
    at: Point<3>,
    /// Its cells.
    star: Vec<u32>,
    /// The facets of its cells opposite it.
    opposite: Vec<[Point<3>; 3]>,
    /// Of its own facets, those that lie in a valley: their edges opposite the point.
    far_edges: Vec<[Point<3>; 2]>,
    /// The mean depths along these facets.
    means: Vec<f64>,
}

impl Surroundings {
    fn gather(&mut self, tetrahedra: &mut Tetrahedra, point: u32) {
        self.at = tetrahedra.points[point as usize];
        self.star.clear();
        tetrahedra.star(point, &mut self.star);
    }

    /// Finds the facets around the point, and of its own those whose far corners are near a valley.
    fn find_far_edges(
        &mut self,
        tetrahedra: &Tetrahedra,
        point: u32,
        is_near: impl Fn(u32) -> bool,
    ) {
        self.opposite.clear();
        self.far_edges.clear();
        for &cell in &self.star {
            self.opposite.push(opposite_facet(tetrahedra, cell, point));
            let corners = &tetrahedra.corners[cell as usize];
            let k = tetrahedra.place(cell, point);
            for n in 1..4 {
                let beyond = tetrahedra.neighbours[cell as usize][(k + n) & 3];
                // each facet from one side, none of the hull
                if beyond != NONE && beyond > cell {
                    let ends = [n % 3 + 1, (n + 1) % 3 + 1].map(|m| corners[(k + m) & 3]);
                    if is_near(ends[0]) && is_near(ends[1]) {
                        self.far_edges.push(ends.map(|c| tetrahedra.points[c as usize]));
                    }
                }
            }
        }
    }

    /// Drops facets that are worth next to nothing.
    fn keep_deep(&mut self, contrast: &Contrast) {
        let mut kept = 0;
        for n in 0..self.far_edges.len() {
            if contrast.relative(self.means[n]) > DEEP {
                (self.far_edges[kept], self.means[kept]) = (self.far_edges[n], self.means[n]);
                kept += 1;
            }
        }
        self.far_edges.truncate(kept);
        self.means.truncate(kept);
    }

    /// The mean square of the distances to the far points.
    fn size_squared(&self) -> f64 {
        let sum: f64 = self.opposite.iter().flatten().map(|p| distance_squared(p, &self.at)).sum();
        sum / (3 * self.opposite.len().max(1)) as f64
    }
}
