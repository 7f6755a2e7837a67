//! Strays: points that moves have left beside a valley.
//!
//! Where a point could come onto the valley only through cells below the floor, neither a swap nor a move alone gains
//! anything. So the point gets a trial, on a copy of its surroundings. There it goes to the valley's bottom step by
//! step, while swaps and moves of points beside the valley mend what becomes too flat. Or it is merged, with the point
//! that faces it across the valley, or with one that crowds the valley already. A trial that ends with well-shaped
//! cells, and with the valley passing less between points, takes the place of the original.
//!
//! Cost: a fifth of improving, nearly all of it for trials that fail.

use super::align::{Aligner, NEAR};
use super::depth::Contrast;
use super::slivers::{Effort, remove_slivers};
use super::smooth::{opposite_facet, worst_cosine};
use super::tetrahedra::{NONE, Tetrahedra};
use crate::fields::NominalDistance;
use crate::geometry::{Point, distance_squared};
use std::collections::HashSet;

/// The least depth of a valley that is worth the effort.
const LEAST_DEPTH: f64 = 0.6;
/// A point no deeper than this is far from every valley.
const FAINT: f64 = 0.1;
/// The greatest depth of a point beside a valley, over that of the valley's bottom.
const BESIDE: f64 = 0.88;
/// The least depth of a stray's deep neighbours, and of the bottom beside it, over the greatest depth around.
const SHALLOW: f64 = 0.75;
/// The least number of a stray's deep neighbours.
const DEEP_NEIGHBOURS: usize = 4;
/// The least distance of a stray from the bottom, over the length of its edges.
const STRAY: f64 = 0.08;
/// The greatest distance of a stray from the bottom, over d.
const REACH: f64 = 0.6;
/// A point in the valley is crowded by one within this share of the length of its edges.
const CROWDED: f64 = 0.7;
/// The greatest cosine on the way to the bottom, that of 2°.
const FLATTEST: f64 = 0.9994;
/// The shares of the way that are tried in each step.
const SHARES: [f64; 4] = [1.0, 0.6, 0.35, 0.2];
/// The most steps.
const STEPS: usize = 4;
/// Where on an edge the valley is looked for.
const WAY: [f64; 5] = [0.2, 0.35, 0.5, 0.65, 0.8];
/// By how much [`Aligner::crossings`] must fall.
const GAIN: f64 = 0.06;
/// An edge that is deeper on the way than at both ends by less than this is not crossed.
const NOISE: f64 = 0.02;
/// Rounds of mending after each step.
const ROUNDS: usize = 4;

/// A point beside a valley that its neighbours have left behind.
struct Stray {
    point: u32,
    /// Its place at the valley's bottom.
    bottom: Point<3>,
    /// The mean square of its edges.
    size: f64,
}

/// The cells of a point, and its neighbours, ascending.
#[derive(Default)]
struct Neighbourhood {
    cells: Vec<u32>,
    points: Vec<u32>,
}

impl Neighbourhood {
    fn gather(&mut self, tetrahedra: &mut Tetrahedra, point: u32) {
        self.cells.clear();
        tetrahedra.star(point, &mut self.cells);
        self.points.clear();
        let corners = self.cells.iter().flat_map(|&cell| tetrahedra.corners[cell as usize]);
        self.points.extend(corners.filter(|&c| c != point));
        self.points.sort_unstable();
        self.points.dedup();
    }
}

/// A copy of a stray's surroundings, to try things on. Its points are numbered anew.
#[derive(Clone)]
struct Trial {
    tetrahedra: Tetrahedra,
    /// The cells that are copied.
    cells: Vec<u32>,
    /// The original's number of each point.
    points: Vec<u32>,
    /// The stray, its place at the valley's bottom, and the mean square of its edges.
    stray: u32,
    bottom: Point<3>,
    size: f64,
    contrast: Contrast,
    /// The greatest cosine that may be left: the floor's, or a greater one that is there already.
    cosine_limit: f64,
}

/// A way to leave a stray out: it is merged into another point, which comes to a place.
struct Merge {
    into: u32,
    at: Point<3>,
}

impl Aligner<'_> {
    /// Brings points that are left beside valleys onto them, or takes them away.
    pub fn bring_strays(
        &mut self,
        tetrahedra: &mut Tetrahedra,
        active: &[bool],
        distance: &NominalDistance<3>,
        effort: &mut Effort,
    ) {
        let mut around = Neighbourhood::default();
        for point in 0..tetrahedra.points.len() as u32 {
            if tetrahedra.freedom[point as usize] != 7 || !active[point as usize] {
                continue;
            }
            let Some(stray) = self.stray_at(tetrahedra, point, distance, &mut around) else {
                continue;
            };
            let trial = self.trial_of(tetrahedra, &stray, &around.points);
            if trial.points.iter().any(|&point| tetrahedra.is_on_held[point as usize]) {
                continue; // the copy does not know which facets stay
            }
            let mut tried = Effort::default();
            let Some(better) = self.better(&trial, tetrahedra, &mut tried) else { continue };
            self.put_back(tetrahedra, &better);
            effort.swaps += tried.swaps;
            effort.moves += tried.moves + 1;
        }
    }

    /// The stray that a point is, if it is one.
    fn stray_at(
        &self,
        tetrahedra: &mut Tetrahedra,
        point: u32,
        distance: &NominalDistance<3>,
        around: &mut Neighbourhood,
    ) -> Option<Stray> {
        let own = self.depths[point as usize];
        if own < FAINT {
            return None;
        }
        // look for the bottom before the neighbours, which takes longer
        let at = tetrahedra.points[point as usize];
        let shift = self.field.shift_to_bottom(&at, REACH * distance.at(&at))?;
        let bottom: Point<3> = std::array::from_fn(|k| at[k] + shift[k]);
        let depth = self.field.depth(&bottom);
        if depth < SHALLOW * LEAST_DEPTH || own > BESIDE * depth {
            return None;
        }
        around.gather(tetrahedra, point);
        let around = &around.points;
        let depths = around.iter().map(|&c| self.depths[c as usize]);
        let deepest = depths.clone().fold(depth, f64::max);
        let deep = depths.filter(|&depth| depth > SHALLOW * deepest).count();
        if deepest < LEAST_DEPTH || depth < SHALLOW * deepest || deep < DEEP_NEIGHBOURS {
            return None;
        }
        let squares = around.iter().map(|&c| distance_squared(&tetrahedra.points[c as usize], &at));
        let size = squares.sum::<f64>() / around.len() as f64;
        if distance_squared(&at, &bottom) < STRAY * STRAY * size {
            return None;
        }
        let crossing = |&c: &u32| {
            let ends = own.max(self.depths[c as usize]);
            self.crossing(tetrahedra, [point, c], ends)
        };
        (around.iter().map(crossing).sum::<f64>() > GAIN).then_some(Stray { point, bottom, size })
    }

    /// What a trial comes to if it is better than the original: the stray at the bottom, or else merged.
    fn better(&self, trial: &Trial, whole: &Tetrahedra, tried: &mut Effort) -> Option<Trial> {
        let wanted = self.crossings(trial) - GAIN;
        if wanted < 0.0 {
            return None;
        }
        let gains = |trial: &Trial| self.crossings(trial) < wanted;
        self.brought(trial.clone(), tried).filter(gains).or_else(|| {
            let merges = [self.across(trial, whole), self.instead(trial)].into_iter().flatten();
            let merged = |merge| trial.merged(&merge, self.cosine_limit, tried);
            merges.filter_map(merged).find(gains)
        })
    }

    /// A copy of the cells of a stray and of its neighbours.
    fn trial_of(&self, tetrahedra: &mut Tetrahedra, stray: &Stray, around: &[u32]) -> Trial {
        let mut cells = Vec::with_capacity(256);
        let mut of_one = Vec::with_capacity(40);
        for &neighbour in around {
            of_one.clear();
            tetrahedra.star(neighbour, &mut of_one);
            cells.extend_from_slice(&of_one);
        }
        cells.sort_unstable();
        cells.dedup();
        let mut points: Vec<u32> =
            cells.iter().flat_map(|&cell| tetrahedra.corners[cell as usize]).collect();
        points.sort_unstable();
        points.dedup();
        let local = |c: u32| points.binary_search(&c).unwrap_or(0) as u32;
        let corners = cells.iter().map(|&c| tetrahedra.corners[c as usize].map(local)).collect();
        let take = |of: &[u8]| points.iter().map(|&p| of[p as usize]).collect::<Vec<u8>>();
        let at = points.iter().map(|&p| tetrahedra.points[p as usize]).collect();
        let mut small = Tetrahedra::new(
            at,
            take(&tetrahedra.freedom),
            take(&tetrahedra.sides),
            corners,
            &HashSet::new(),
        );
        let mut contrast = Contrast::NONE;
        points.iter().for_each(|&p| contrast.include(self.depths[p as usize]));
        for (freedom, &p) in small.freedom.iter_mut().zip(&points) {
            // what is in the valley stays
            if contrast.relative(self.depths[p as usize]) > NEAR {
                *freedom = 0;
            }
        }
        let &Stray { point, bottom, size } = stray;
        let stray = local(point);
        small.freedom[stray as usize] = 0;
        let cosines = small.shapes.iter().map(|shape| shape.cosine);
        let cosine_limit = cosines.fold(self.cosine_limit, f64::max);
        Trial { tetrahedra: small, cells, points, stray, bottom, size, contrast, cosine_limit }
    }

    /// How much the valley passes between points instead of through them: the sum over edges of how much deeper it is
    /// on the way than at both ends.
    fn crossings(&self, trial: &Trial) -> f64 {
        let tetrahedra = &trial.tetrahedra;
        let mut edges: Vec<[u32; 2]> = Vec::with_capacity(400);
        for cell in tetrahedra.cells() {
            for i in 0..3 {
                for j in i + 1..4 {
                    edges.push([cell[i].min(cell[j]), cell[i].max(cell[j])]);
                }
            }
        }
        edges.sort_unstable();
        edges.dedup();
        let depths: Vec<f64> = tetrahedra.points.iter().map(|p| self.field.depth(p)).collect();
        let crossing = |&edge: &[u32; 2]| {
            let [a, b] = edge.map(|c| depths[c as usize]);
            self.crossing(tetrahedra, edge, a.max(b))
        };
        edges.iter().map(crossing).sum()
    }

    /// How much deeper the valley is on an edge than at both ends.
    fn crossing(&self, tetrahedra: &Tetrahedra, edge: [u32; 2], ends: f64) -> f64 {
        let [a, b] = edge;
        let depth_on_edge = WAY.iter().map(|&share| self.depth_on_edge(tetrahedra, a, b, share));
        (depth_on_edge.fold(ends, f64::max) - ends - NOISE).max(0.0)
    }

    /// The trial with the stray at the valley's bottom, mended on the way; `None` if it does not come there, or cells
    /// are not sound then.
    fn brought(&self, mut trial: Trial, effort: &mut Effort) -> Option<Trial> {
        let (tetrahedra, stray) = (&mut trial.tetrahedra, trial.stray);
        let (mut star, mut facets) = (Vec::new(), Vec::new());
        for _ in 0..STEPS {
            star.clear();
            tetrahedra.star(stray, &mut star);
            facets.clear();
            facets.extend(star.iter().map(|&cell| opposite_facet(tetrahedra, cell, stray)));
            let at = tetrahedra.points[stray as usize];
            let places = SHARES
                .map(|share| std::array::from_fn(|k| at[k] + share * (trial.bottom[k] - at[k])));
            let possible = |to: &&Point<3>| worst_cosine(&facets, to, FLATTEST) < FLATTEST;
            let to = places.iter().find(possible)?;
            let is_there = *to == places[0];
            tetrahedra.move_point(stray, *to, &star);
            remove_slivers(tetrahedra, self.cosine_limit, ROUNDS, effort);
            if is_there {
                return is_sound(tetrahedra, trial.cosine_limit).then_some(trial);
            }
        }
        None
    }

    /// The point that faces the stray across the valley, and the bottom between them, where both may become one.
    fn across(&self, trial: &Trial, whole: &Tetrahedra) -> Option<Merge> {
        let (tetrahedra, stray) = (&trial.tetrahedra, trial.stray);
        let faces = |&c: &u32| {
            let ends = self.depth_of(trial, c).max(self.depth_of(trial, stray));
            let is_free = whole.freedom[trial.points[c as usize] as usize] == 7;
            is_free && self.crossing(tetrahedra, [stray, c], ends) > 0.0
        };
        let into = trial.nearest(faces, 1.0)?;
        let [p, q] = [stray, into].map(|c| tetrahedra.points[c as usize]);
        let middle = std::array::from_fn(|k| 0.5 * (p[k] + q[k]));
        let shift =
            self.field.shift_to_bottom(&middle, REACH * trial.size.sqrt()).unwrap_or_default();
        Some(Merge { into, at: std::array::from_fn(|k| middle[k] + shift[k]) })
    }

    /// A point in the valley so near that the stray may be left out for it.
    fn instead(&self, trial: &Trial) -> Option<Merge> {
        let is_deep = |&c: &u32| trial.contrast.relative(self.depth_of(trial, c)) > SHALLOW;
        let into = trial.nearest(is_deep, CROWDED)?;
        Some(Merge { into, at: trial.tetrahedra.points[into as usize] })
    }

    fn depth_of(&self, trial: &Trial, point: u32) -> f64 {
        self.depths[trial.points[point as usize] as usize]
    }

    /// Puts a trial in the place of what it was made of.
    fn put_back(&mut self, tetrahedra: &mut Tetrahedra, trial: &Trial) {
        for (&point, at) in trial.points.iter().zip(&trial.tetrahedra.points) {
            tetrahedra.points[point as usize] = *at;
            self.depths[point as usize] = self.field.depth(at);
        }
        let new: Vec<[u32; 4]> =
            (trial.tetrahedra.cells()).map(|cell| cell.map(|c| trial.points[c as usize])).collect();
        let stray = trial.points[trial.stray as usize];
        tetrahedra.replace(&trial.cells, &new);
        if !new.iter().flatten().any(|&c| c == stray) {
            tetrahedra.forget(stray);
        }
    }
}

impl Trial {
    /// The nearest neighbour of the stray of some kind, within a share of the length of its edges.
    fn nearest(&self, is_one: impl Fn(&u32) -> bool, share: f64) -> Option<u32> {
        let at = &self.tetrahedra.points[self.stray as usize];
        let square = |c: u32| distance_squared(&self.tetrahedra.points[c as usize], at);
        let star =
            self.tetrahedra.cells().filter(|cell| cell.contains(&self.stray)).flatten().copied();
        let found = star.filter(|&c| c != self.stray && is_one(&c));
        let nearest = found.min_by(|&a, &b| square(a).total_cmp(&square(b)).then(a.cmp(&b)))?;
        (square(nearest) <= share * share * self.size).then_some(nearest)
    }

    /// The trial with the stray merged, and mended; `None` if cells are not sound then.
    fn merged(&self, merge: &Merge, cosine_limit: f64, effort: &mut Effort) -> Option<Self> {
        let &Merge { into, at } = merge;
        let (tetrahedra, stray) = (&self.tetrahedra, self.stray);
        let cells =
            tetrahedra.cells().filter(|cell| !(cell.contains(&stray) && cell.contains(&into)));
        let cells = cells.map(|cell| cell.map(|c| if c == stray { into } else { c })).collect();
        let mut points = tetrahedra.points.clone();
        points[into as usize] = at;
        let mut small = Tetrahedra::new(
            points,
            tetrahedra.freedom.clone(),
            tetrahedra.sides.clone(),
            cells,
            &HashSet::new(),
        );
        small.freedom[into as usize] = 0;
        // the rim is the same, so if no cell is turned over they fill the same space
        if small.shapes.iter().any(|shape| shape.quality <= 0.0) || rim(&small) != rim(tetrahedra) {
            return None;
        }
        remove_slivers(&mut small, cosine_limit, 2 * ROUNDS, effort);
        is_sound(&small, self.cosine_limit).then(|| Self { tetrahedra: small, ..self.clone() })
    }
}

/// How many facets nothing lies beyond.
fn rim(tetrahedra: &Tetrahedra) -> usize {
    let alive = (0..tetrahedra.slot_count()).filter(|&cell| tetrahedra.is_alive(cell));
    alive.flat_map(|cell| tetrahedra.neighbours[cell as usize]).filter(|&n| n == NONE).count()
}

/// Whether no cell has a greater cosine.
fn is_sound(tetrahedra: &Tetrahedra, cosine_limit: f64) -> bool {
    let mut alive = (0..tetrahedra.slot_count()).filter(|&cell| tetrahedra.is_alive(cell));
    alive.all(|cell| tetrahedra.shapes[cell as usize].cosine <= cosine_limit)
}
