//! Points that moves have left beside a valley.
//!
//! Where a point could come onto the valley only through cells below the floor, neither a swap nor a move alone gains
//! anything. So its surroundings are copied, and there the point goes to the valley's bottom step by step, while swaps
//! and moves of points beside the valley mend what becomes too flat; or it is merged, with the point that faces it
//! across the valley, or with one that crowds the valley already. A trial that ends with well-shaped cells, and with
//! the valley passing less between points, takes the place of the original.
//!
//! Cost: a fifth of improving, nearly all of it for trials that fail.

use super::align::{Aligner, NEAR};
use super::heal::{Effort, heal};
use super::patch::{NONE, Patch};
use super::smooth::{facing, worst_cosine};
use super::valley::Contrast;
use crate::fields::NominalDistance;
use crate::geometry::{Point, distance_squared};

/// A valley that is worth the effort is as deep as this.
const LEAST_DEPTH: f64 = 0.6;
/// A point no deeper than this is far from every valley.
const FAINT: f64 = 0.1;
/// Of the greatest depth around, the point's own is at most this.
const BESIDE: f64 = 0.88;
/// Of so many of its neighbours, and of the bottom beside it, the depth is at least this share of the greatest.
const SHALLOW: f64 = 0.75;
const DEEP_NEIGHBOURS: usize = 4;
/// How far the point is from the bottom at least, in the length of its edges, and at most, in the nominal distance.
const STRAY: f64 = 0.08;
const REACH: f64 = 0.6;
/// A point in the valley is crowded by one within this share of the length of its edges.
const CROWDED: f64 = 0.7;
/// The greatest cosine on the way, that of 2°.
const FLATTEST: f64 = 0.9994;
/// The shares of the way that are tried, and how often.
const SHARES: [f64; 4] = [1.0, 0.6, 0.35, 0.2];
const STEPS: usize = 4;
/// Where on an edge the valley is looked for.
const WAY: [f64; 5] = [0.2, 0.35, 0.5, 0.65, 0.8];
/// By how much [`Aligner::crossings`] must fall.
const GAIN: f64 = 0.06;
/// What on the way is deeper than both ends by less than this is no crossing.
const NOISE: f64 = 0.02;
/// Rounds of mending after each step.
const ROUNDS: usize = 4;

/// A copy of some cells to try things on, and where they come from.
#[derive(Clone)]
struct Trial {
    patch: Patch,
    cells: Vec<u32>,
    points: Vec<u32>,
    /// The point that is to move, and its place in the valley.
    stray: u32,
    bottom: Point<3>,
    /// The mean square of its edges.
    size: f64,
    contrast: Contrast,
    /// The greatest cosine that may be left: the floor, or what there is.
    limit: f64,
}

impl Aligner<'_> {
    /// Brings points that are left beside valleys onto them, or takes them away.
    pub fn gather_strays(
        &mut self,
        patch: &mut Patch,
        open: &[bool],
        distance: &NominalDistance<3>,
        effort: &mut Effort,
    ) {
        let (mut star, mut around) = (Vec::new(), Vec::new());
        for point in 0..patch.points.len() as u32 {
            let is_free = patch.freedom[point as usize] == 7 && open[point as usize];
            let own = self.depths[point as usize];
            if !is_free || own < FAINT {
                continue;
            }
            // look for the bottom before the neighbours, which takes longer
            let at = patch.points[point as usize];
            let Some(shift) = self.valley.fall(&at, REACH * distance.at(&at)) else { continue };
            let bottom: Point<3> = std::array::from_fn(|k| at[k] + shift[k]);
            let depth = self.valley.depth(&bottom);
            if depth < SHALLOW * LEAST_DEPTH || own > BESIDE * depth {
                continue;
            }
            let Some(size) =
                self.is_stray(patch, point, (&bottom, depth), (&mut star, &mut around))
            else {
                continue;
            };
            let trial = self.surroundings(patch, point, &around, bottom, size);
            let wanted = self.crossings(&trial) - GAIN;
            if wanted < 0.0 {
                continue;
            }
            let mut tried = Effort::default();
            let gains = |trial: &Trial| self.crossings(trial) < wanted;
            let brought = self.brought(trial.clone(), &mut tried).filter(gains);
            let after = brought.or_else(|| {
                let places =
                    [self.across(&trial, patch), self.instead(&trial)].into_iter().flatten();
                let mut merged =
                    places.filter_map(|place| trial.merged(place, self.floor, &mut tried));
                merged.find(gains)
            });
            let Some(after) = after else { continue };
            self.put_back(patch, &after);
            effort.swaps += tried.swaps;
            effort.moves += tried.moves + 1;
        }
    }

    /// Whether a point beside a valley's bottom, of a given depth there, is left behind by its neighbours: the mean
    /// square of its edges if it is.
    fn is_stray(
        &self,
        patch: &mut Patch,
        point: u32,
        (bottom, depth): (&Point<3>, f64),
        (star, around): (&mut Vec<u32>, &mut Vec<u32>),
    ) -> Option<f64> {
        star.clear();
        patch.star(point, star);
        around.clear();
        let corners = star.iter().flat_map(|&cell| patch.corners[cell as usize]);
        around.extend(corners.filter(|&c| c != point));
        around.sort_unstable();
        around.dedup();
        let own = self.depths[point as usize];
        let depths = around.iter().map(|&c| self.depths[c as usize]);
        let deepest = depths.clone().fold(depth, f64::max);
        let deep = depths.filter(|&depth| depth > SHALLOW * deepest).count();
        if deepest < LEAST_DEPTH || depth < SHALLOW * deepest || deep < DEEP_NEIGHBOURS {
            return None;
        }
        let at = patch.points[point as usize];
        let squares = around.iter().map(|&c| distance_squared(&patch.points[c as usize], &at));
        let size = squares.sum::<f64>() / around.len() as f64;
        if distance_squared(&at, bottom) < STRAY * STRAY * size {
            return None;
        }
        let crossing = |&c: &u32| {
            let ends = own.max(self.depths[c as usize]);
            self.crossing(patch, [point, c], ends)
        };
        (around.iter().map(crossing).sum::<f64>() > GAIN).then_some(size)
    }

    /// A copy of the cells of a point and of its neighbours.
    fn surroundings(
        &self,
        patch: &mut Patch,
        point: u32,
        around: &[u32],
        bottom: Point<3>,
        size: f64,
    ) -> Trial {
        let mut cells = Vec::with_capacity(256);
        let mut of_one = Vec::with_capacity(40);
        for &neighbour in around {
            of_one.clear();
            patch.star(neighbour, &mut of_one);
            cells.extend_from_slice(&of_one);
        }
        cells.sort_unstable();
        cells.dedup();
        let mut points: Vec<u32> =
            cells.iter().flat_map(|&cell| patch.corners[cell as usize]).collect();
        points.sort_unstable();
        points.dedup();
        let local = |c: u32| points.binary_search(&c).unwrap_or(0) as u32;
        let corners = cells.iter().map(|&c| patch.corners[c as usize].map(local)).collect();
        let take = |of: &[u8]| points.iter().map(|&p| of[p as usize]).collect::<Vec<u8>>();
        let at = points.iter().map(|&p| patch.points[p as usize]).collect();
        let mut small = Patch::new(at, take(&patch.freedom), take(&patch.sides), corners);
        let mut contrast = Contrast::NONE;
        points.iter().for_each(|&p| contrast.include(self.depths[p as usize]));
        for (freedom, &p) in small.freedom.iter_mut().zip(&points) {
            // what is in the valley stays
            if contrast.of(self.depths[p as usize]) > NEAR {
                *freedom = 0;
            }
        }
        let stray = local(point);
        small.freedom[stray as usize] = 0;
        let limit = small.shapes.iter().fold(self.floor, |limit, shape| limit.max(shape.cosine));
        Trial { patch: small, cells, points, stray, bottom, size, contrast, limit }
    }

    /// How much the valley passes between points instead of through them: the sum over edges of how much deeper it is
    /// on the way than at both ends.
    fn crossings(&self, trial: &Trial) -> f64 {
        let patch = &trial.patch;
        let mut edges: Vec<[u32; 2]> = Vec::with_capacity(400);
        for cell in patch.cells() {
            for i in 0..3 {
                for j in i + 1..4 {
                    edges.push([cell[i].min(cell[j]), cell[i].max(cell[j])]);
                }
            }
        }
        edges.sort_unstable();
        edges.dedup();
        let depths: Vec<f64> = patch.points.iter().map(|p| self.valley.depth(p)).collect();
        let crossing = |&edge: &[u32; 2]| {
            let [a, b] = edge.map(|c| depths[c as usize]);
            self.crossing(patch, edge, a.max(b))
        };
        edges.iter().map(crossing).sum()
    }

    /// How much deeper the valley is on an edge than at both ends.
    fn crossing(&self, patch: &Patch, [a, b]: [u32; 2], ends: f64) -> f64 {
        let on_way = WAY.iter().map(|&share| self.on_way(patch, a, b, share));
        (on_way.fold(ends, f64::max) - ends - NOISE).max(0.0)
    }

    /// The trial with the stray at the valley's bottom, mended on the way; `None` if it does not come there, or cells
    /// are not sound then.
    fn brought(&self, mut trial: Trial, effort: &mut Effort) -> Option<Trial> {
        let (patch, stray) = (&mut trial.patch, trial.stray);
        let (mut star, mut facets) = (Vec::new(), Vec::new());
        for _ in 0..STEPS {
            star.clear();
            patch.star(stray, &mut star);
            facets.clear();
            facets.extend(star.iter().map(|&cell| facing(patch, cell, stray)));
            let at = patch.points[stray as usize];
            let places = SHARES
                .map(|share| std::array::from_fn(|k| at[k] + share * (trial.bottom[k] - at[k])));
            let possible = |to: &&Point<3>| worst_cosine(&facets, to, FLATTEST) < FLATTEST;
            let to = places.iter().find(possible)?;
            let is_there = *to == places[0];
            patch.move_point(stray, *to, &star);
            heal(patch, self.floor, ROUNDS, effort);
            if is_there {
                return is_sound(patch, trial.limit).then_some(trial);
            }
        }
        None
    }

    /// The point that faces the stray across the valley, and the bottom between them, where both may become one.
    fn across(&self, trial: &Trial, whole: &Patch) -> Option<(u32, Point<3>)> {
        let (patch, stray) = (&trial.patch, trial.stray);
        let faces = |&c: &u32| {
            let ends = self.depth_of(trial, c).max(self.depth_of(trial, stray));
            let is_free = whole.freedom[trial.points[c as usize] as usize] == 7;
            is_free && self.crossing(patch, [stray, c], ends) > 0.0
        };
        let into = trial.nearest(faces, 1.0)?;
        let [p, q] = [stray, into].map(|c| patch.points[c as usize]);
        let middle = std::array::from_fn(|k| 0.5 * (p[k] + q[k]));
        let shift = self.valley.fall(&middle, REACH * trial.size.sqrt()).unwrap_or_default();
        Some((into, std::array::from_fn(|k| middle[k] + shift[k])))
    }

    /// A point in the valley so near that the stray may be left out for it.
    fn instead(&self, trial: &Trial) -> Option<(u32, Point<3>)> {
        let is_deep = |&c: &u32| trial.contrast.of(self.depth_of(trial, c)) > SHALLOW;
        let into = trial.nearest(is_deep, CROWDED)?;
        Some((into, trial.patch.points[into as usize]))
    }

    fn depth_of(&self, trial: &Trial, point: u32) -> f64 {
        self.depths[trial.points[point as usize] as usize]
    }

    /// Puts a trial in the place of what it was made of.
    fn put_back(&mut self, patch: &mut Patch, trial: &Trial) {
        for (&point, at) in trial.points.iter().zip(&trial.patch.points) {
            patch.points[point as usize] = *at;
            self.depths[point as usize] = self.valley.depth(at);
        }
        let new: Vec<[u32; 4]> =
            (trial.patch.cells()).map(|cell| cell.map(|c| trial.points[c as usize])).collect();
        let stray = trial.points[trial.stray as usize];
        patch.replace(&trial.cells, &new);
        if !new.iter().flatten().any(|&c| c == stray) {
            patch.forget(stray);
        }
    }
}

impl Trial {
    /// The nearest neighbour of the stray of some kind, within a share of the length of its edges.
    fn nearest(&self, is_one: impl Fn(&u32) -> bool, share: f64) -> Option<u32> {
        let at = &self.patch.points[self.stray as usize];
        let square = |c: u32| distance_squared(&self.patch.points[c as usize], at);
        let star = self.patch.cells().filter(|cell| cell.contains(&self.stray)).flatten().copied();
        let found = star.filter(|&c| c != self.stray && is_one(&c));
        let nearest = found.min_by(|&a, &b| square(a).total_cmp(&square(b)).then(a.cmp(&b)))?;
        (square(nearest) <= share * share * self.size).then_some(nearest)
    }

    /// The trial with the stray merged into a neighbour at a place, mended; `None` if cells are not sound then.
    fn merged(&self, (into, to): (u32, Point<3>), floor: f64, effort: &mut Effort) -> Option<Self> {
        let (patch, stray) = (&self.patch, self.stray);
        let cells = patch.cells().filter(|cell| !(cell.contains(&stray) && cell.contains(&into)));
        let cells = cells.map(|cell| cell.map(|c| if c == stray { into } else { c })).collect();
        let mut points = patch.points.clone();
        points[into as usize] = to;
        let mut small = Patch::new(points, patch.freedom.clone(), patch.sides.clone(), cells);
        small.freedom[into as usize] = 0;
        // the rim is the same, so if no cell is turned over they fill the same space
        if small.shapes.iter().any(|shape| shape.quality <= 0.0) || rim(&small) != rim(patch) {
            return None;
        }
        heal(&mut small, floor, 2 * ROUNDS, effort);
        is_sound(&small, self.limit).then(|| Self { patch: small, ..self.clone() })
    }
}

/// How many facets nothing lies beyond.
fn rim(patch: &Patch) -> usize {
    let alive = (0..patch.slot_count()).filter(|&cell| patch.is_alive(cell));
    alive.flat_map(|cell| patch.neighbours[cell as usize]).filter(|&n| n == NONE).count()
}

/// Whether no cell has a greater cosine.
fn is_sound(patch: &Patch, limit: f64) -> bool {
    let mut alive = (0..patch.slot_count()).filter(|&cell| patch.is_alive(cell));
    alive.all(|cell| patch.shapes[cell as usize].cosine <= limit)
}
