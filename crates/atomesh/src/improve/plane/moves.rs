//! Moving points, one star at a time.
//!
//! A point tries its neighbours' centre, the valley beside it and steps along that, and steps in a few
//! directions. The length of its steps grows with success. The best place that keeps the floor wins. The star's
//! outline does not change, so its guides are shared out again among its cells. Points without a common cell do not
//! affect each other: they are tried in parallel, by colours, with the same result at any thread count.

use crate::parallel::prelude::*;

use crate::fields::NominalDistance;
use crate::geometry::{Point, difference, distance_squared, dot};

use super::energy::{Energy, least_sine};
use super::star::{Limits, Star, StarCell};
use super::swaps::LEAST_GAIN;
use super::triangles::{CellPair, Triangles};

/// The length of a point's first step, over d.
const FIRST_STEP: f64 = 0.2;
/// The least and the greatest length of a step, over d.
const LEAST_STEP: f64 = 0.02;
const GREATEST_STEP: f64 = 0.3;
/// Directions tried.
const DIRECTIONS: usize = 4;
/// The fewest points that a thread tries at a time.
const POINTS_PER_TASK: usize = 16;

/// Moves points, and knows for which of them trying is worth while: those that are *awake*.
pub(super) struct Mover {
    freedom: Vec<u8>,
    /// d where each point was at first.
    distances: Vec<f64>,
    /// The length of the next step over d; 0 for a point that has never been awake.
    steps: Vec<f64>,
    /// Whether a cell of the point has changed since swaps were tried.
    changed: Vec<bool>,
    /// Whether a cell of the point has changed since its moves were tried.
    woken: Vec<bool>,
    rounds: usize,
}

impl Mover {
    /// Points of cells that hold guides or are below the floor are awake; others wake if a neighbour moves far.
    pub fn new(
        triangles: &Triangles,
        freedom: &[u8],
        distance: &NominalDistance<2>,
        energy: &Energy<'_>,
    ) -> Self {
        let count = triangles.points.len();
        let mut steps = vec![0.0; count];
        for cell in 0..triangles.len() as u32 {
            let [a, b, c] = triangles.corners_at(cell);
            let is_low = least_sine(a, b, c) < energy.sine_floor;
            if is_low || !triangles.guides_in(cell).is_empty() {
                triangles.corners(cell).iter().for_each(|&c| steps[c as usize] = FIRST_STEP);
            }
        }
        let changed: Vec<bool> = steps.iter().map(|&step| step > 0.0).collect();
        Self {
            freedom: freedom.to_vec(),
            distances: triangles.points.iter().map(|p| distance.at(p)).collect(),
            steps,
            woken: changed.clone(),
            changed,
            rounds: 0,
        }
    }

    /// Whether a swap of the pair may gain although it did not before.
    pub fn is_changed(&self, pair: &CellPair) -> bool {
        pair.edge.iter().chain(&pair.apices).any(|&point| self.changed[point as usize])
    }

    /// Lets the points of a swapped pair try again.
    pub fn wake(&mut self, pair: &CellPair) {
        for &point in pair.edge.iter().chain(&pair.apices) {
            self.changed[point as usize] = true;
            self.woken[point as usize] = true;
            let step = &mut self.steps[point as usize];
            *step = step.max(0.5 * FIRST_STEP);
        }
    }

    /// d near a point.
    pub fn distance(&self, point: u32) -> f64 {
        self.distances[point as usize]
    }

    /// Whether a point may be taken away: it moves freely, and is or was awake.
    pub fn may_go(&self, point: u32) -> bool {
        self.freedom[point as usize] == 0b11 && self.has_been_awake(point)
    }

    /// Whether a point is or was awake.
    pub fn has_been_awake(&self, point: u32) -> bool {
        self.steps[point as usize] > 0.0
    }

    /// Takes a point away.
    pub fn remove(&mut self, point: u32) {
        self.freedom[point as usize] = 0;
        self.steps[point as usize] = 0.0;
    }

    /// Adds a point where the nominal distance is `distance`.
    pub fn add(&mut self, distance: f64) {
        self.freedom.push(0b11);
        self.distances.push(distance);
        self.steps.push(FIRST_STEP);
        self.changed.push(true);
        self.woken.push(true);
    }

    /// Lets points try again that may have far to go.
    pub fn wake_all(&mut self, points: impl IntoIterator<Item = u32>) {
        for point in points {
            let i = point as usize;
            (self.changed[i], self.woken[i]) = (true, true);
            self.steps[i] = FIRST_STEP;
        }
    }

    /// Moves every point that gains by it. Returns how many.
    pub fn move_all(&mut self, triangles: &mut Triangles, energy: &Energy<'_>) -> usize {
        self.rounds += 1;
        self.changed.fill(false);
        let mut moves = 0;
        let mut star = Star::default();
        for colour in self.colours(triangles) {
            for &point in &colour {
                self.woken[point as usize] = false;
            }
            let this = &*self;
            let found: Vec<Option<Point<2>>> = (colour.par_iter().with_min_len(POINTS_PER_TASK))
                .map_init(Star::default, |star, &point| {
                    star.gather(triangles, point);
                    this.best_place(star, energy, point)
                })
                .collect();
            for (&point, place) in colour.iter().zip(found) {
                let step = &mut self.steps[point as usize];
                let Some(place) = place else {
                    *step *= 0.5;
                    continue;
                };
                *step = (1.3 * *step).clamp(2.0 * LEAST_STEP, GREATEST_STEP);
                moves += 1;
                star.gather(triangles, point);
                let far = LEAST_STEP * self.distances[point as usize];
                if distance_squared(&star.center, &place) > far * far {
                    self.wake_star(&star);
                }
                let cells = std::mem::take(&mut star.cells);
                star.share_out(triangles, energy, |sector| cells[sector].cell, place);
                star.cells = cells;
                triangles.points[point as usize] = place;
            }
        }
        moves
    }

    /// Points that are awake, by colours: no two of one colour have a cell in common.
    fn colours(&self, triangles: &Triangles) -> Vec<Vec<u32>> {
        let is_awake = |&point: &u32| {
            let i = point as usize;
            self.freedom[i] != 0 && (self.woken[i] || self.steps[i] >= LEAST_STEP)
        };
        let mut taken = vec![u8::MAX; triangles.points.len()];
        let mut colours: Vec<Vec<u32>> = Vec::new();
        let mut star = Vec::new();
        for point in (0..triangles.points.len() as u32).filter(is_awake) {
            triangles.star(point, &mut star);
            let mut used = 0_u64;
            for &StarCell { first, second, .. } in &star {
                used |= 1_u64.checked_shl(taken[first as usize].into()).unwrap_or(0);
                used |= 1_u64.checked_shl(taken[second as usize].into()).unwrap_or(0);
            }
            let colour = used.trailing_ones().min(63) as usize;
            taken[point as usize] = colour as u8;
            if colour >= colours.len() {
                colours.resize(colour + 1, Vec::new());
            }
            colours[colour].push(point);
        }
        colours
    }

    /// Lets the points of a star try again.
    fn wake_star(&mut self, star: &Star) {
        for &StarCell { first, second, .. } in &star.cells {
            for point in [first, second] {
                let i = point as usize;
                self.changed[i] = true;
                self.woken[i] = true;
                self.steps[i] = self.steps[i].max(2.0 * LEAST_STEP);
            }
        }
    }

    /// The place that lowers the energy most, if any does.
    fn best_place(&self, star: &mut Star, energy: &Energy<'_>, point: u32) -> Option<Point<2>> {
        let freedom = self.freedom[point as usize];
        if !star.is_closed && freedom == 0b11 {
            return None; // a point of the hull that nothing holds would change the box
        }
        let step = self.steps[point as usize] * self.distances[point as usize];
        let least = star.least_sine();
        let start = star.center;
        let now = star.energy(energy, start, Limits::NONE)?;
        let mut limits = Limits { energy: now - LEAST_GAIN, sine: energy.sine_to_keep(least) };
        let mut place = None;
        let turn = 0.37 * self.rounds as f64 + 0.61 * f64::from(point);
        let places = Places::new(star, energy, step, turn);
        for k in 0..places.count() {
            let mut x = places.at(star, k);
            for axis in 0..2 {
                if freedom >> axis & 1 == 0 {
                    x[axis] = start[axis];
                }
            }
            if x != start
                && let Some(lower) = star.energy(energy, x, limits)
            {
                limits.energy = lower;
                place = Some(x);
            }
        }
        place
    }
}

/// The places that a point tries.
struct Places {
    /// The length of steps, and the direction of the first.
    step: f64,
    turn: f64,
    valley: Option<NearestValley>,
}

/// The valley nearest to a point, as a line.
struct NearestValley {
    /// The nearest place on it.
    foot: Point<2>,
    /// Its direction, of length 1.
    tangent: Point<2>,
}

impl Places {
    fn new(star: &Star, energy: &Energy<'_>, step: f64, turn: f64) -> Self {
        Self { step, turn, valley: nearest_valley(star, energy) }
    }

    fn count(&self) -> usize {
        DIRECTIONS + if self.valley.is_some() { 4 } else { 1 }
    }

    /// The k-th place.
    fn at(&self, star: &Star, k: usize) -> Point<2> {
        let (start, step) = (star.center, self.step);
        match &self.valley {
            Some(NearestValley { foot, tangent }) if k > DIRECTIONS => {
                let along = step * [0.0, 1.0, -1.0][k - DIRECTIONS - 1];
                [foot[0] + along * tangent[0], foot[1] + along * tangent[1]]
            }
            _ if k > 0 => {
                let angle = self.turn + k as f64 / DIRECTIONS as f64 * std::f64::consts::TAU;
                [start[0] + step * angle.cos(), start[1] + step * angle.sin()]
            }
            _ => half_way_to_the_middle(star),
        }
    }
}

/// Half way from the centre to the mean of the corners around.
fn half_way_to_the_middle(star: &Star) -> Point<2> {
    let corners = if star.is_closed { &star.rim[1..] } else { &star.rim[..] };
    let count = corners.len() as f64;
    std::array::from_fn(|k| {
        0.5 * (star.center[k] + corners.iter().map(|corner| corner[k]).sum::<f64>() / count)
    })
}

/// The line through the guide nearest to the star's centre.
fn nearest_valley(star: &Star, energy: &Energy<'_>) -> Option<NearestValley> {
    let guides = star.guides.iter().map(|&guide| &energy.guides[guide as usize]);
    let far = |p: &Point<2>| distance_squared(p, &star.center);
    let nearest = guides.min_by(|a, b| far(&a.at.position).total_cmp(&far(&b.at.position)))?;
    let n = nearest.at.normal;
    let off = dot(&difference(&nearest.at.position, &star.center), &n);
    let foot = [star.center[0] + off * n[0], star.center[1] + off * n[1]];
    Some(NearestValley { foot, tangent: [-n[1], n[0]] })
}
