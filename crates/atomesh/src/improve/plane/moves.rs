//! Moving points, one star at a time.
//!
//! A point tries its neighbours' centre, the valley beside it and steps along that, and steps in a few
//! directions whose length follows its success; the best place that keeps the floor wins. The star's outline does
//! not change, so its guides are shared out anew among its cells. Points without a common cell do not know
//! of each other: they are tried at the same time, by colours, with the same result at any thread count.

use rayon::prelude::*;

use crate::distance::NominalDistance;
use crate::geometry::{Point, difference, distance_squared, dot};

use super::energy::{Edge, Energy, Shape, cross};
use super::swaps::LEAST_GAIN;
use super::triangles::{Pair, Triangles};

/// The first step, the least and the greatest, over d.
const FIRST_STEP: f64 = 0.2;
const LEAST_STEP: f64 = 0.02;
const GREATEST_STEP: f64 = 0.3;
/// Directions tried.
const DIRECTIONS: usize = 4;
/// Points that one thread tries at the least.
const POINTS_PER_TASK: usize = 16;

/// What is known of the points.
pub(super) struct Mover {
    freedom: Vec<u8>,
    /// d at each point where it was first.
    distances: Vec<f64>,
    /// The length of the next step over d; 0: nothing is to be gained.
    steps: Vec<f64>,
    /// Whether a cell of the point has changed since swaps were tried, and since the point was.
    changed: Vec<bool>,
    woken: Vec<bool>,
    rounds: usize,
}

impl Mover {
    /// Points of cells with guides, or below the floor, are awake; others wake if a neighbour moves far.
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
            let is_low = super::energy::least_sine(a, b, c) < energy.sine_floor;
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

    /// Whether a swap of the pair might do what it could not before.
    pub fn is_changed(&self, pair: &Pair) -> bool {
        pair.edge.iter().chain(&pair.apices).any(|&point| self.changed[point as usize])
    }

    /// Lets the points of a swapped pair try again.
    pub fn wake(&mut self, pair: &Pair) {
        for &point in pair.edge.iter().chain(&pair.apices) {
            self.changed[point as usize] = true;
            self.woken[point as usize] = true;
            let step = &mut self.steps[point as usize];
            *step = step.max(0.5 * FIRST_STEP);
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
                star.share_out(triangles, energy, place);
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
            for &(_, a, b) in &star {
                used |= 1_u64.checked_shl(taken[a as usize].into()).unwrap_or(0);
                used |= 1_u64.checked_shl(taken[b as usize].into()).unwrap_or(0);
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
        for &(_, a, b) in &star.cells {
            for point in [a, b] {
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
        let mut best = star.energy(energy, start, f64::INFINITY, f64::NEG_INFINITY)? - LEAST_GAIN;
        let mut place = None;
        let floor = least.min(energy.sine_floor).max(1e-7);
        let turn = 0.37 * self.rounds as f64 + 0.61 * f64::from(point);
        for k in 0..star.candidate_count() {
            let mut x = star.candidate(energy, k, step, turn);
            for axis in 0..2 {
                if freedom >> axis & 1 == 0 {
                    x[axis] = start[axis];
                }
            }
            if x != start && let Some(lower) = star.energy(energy, x, best, floor) {
                best = lower;
                place = Some(x);
            }
        }
        place
    }
}

/// The cells around a point.
#[derive(Default)]
struct Star {
    center: Point<2>,
    cells: Vec<(u32, u32, u32)>,
    is_closed: bool,
    /// The corners around, one more than cells: the first again at the end if they close.
    rim: Vec<Point<2>>,
    rim_edges: Vec<Edge>,
    rim_lengths: Vec<f64>,
    guides: Vec<u32>,
    spokes: Vec<Point<2>>,
    spoke_lengths: Vec<f64>,
    spoke_edges: Vec<Edge>,
    /// The bottom of the valley across the guide nearest to the centre, and the tangent there.
    valley: Option<(Point<2>, Point<2>)>,
}

impl Star {
    /// Takes up the star of a point.
    fn gather(&mut self, triangles: &Triangles, point: u32) {
        self.is_closed = triangles.star(point, &mut self.cells);
        self.center = triangles.points[point as usize];
        self.rim.clear();
        self.guides.clear();
        for &(cell, a, _) in &self.cells {
            self.rim.push(triangles.points[a as usize]);
            self.guides.extend_from_slice(triangles.guides_in(cell));
        }
        let last = self.cells[self.cells.len() - 1].2;
        self.rim.push(triangles.points[last as usize]);
        self.rim_edges.clear();
        self.rim_edges.extend(self.rim.windows(2).map(|pair| Edge::new(pair[0], pair[1])));
        self.rim_lengths.clear();
        let lengths = self.rim.windows(2).map(|pair| distance_squared(&pair[0], &pair[1]).sqrt());
        self.rim_lengths.extend(lengths);
    }

    /// The sine of the least angle now.
    fn least_sine(&self) -> f64 {
        let sines = self.rim.windows(2).map(|pair| super::energy::least_sine(self.center, pair[0], pair[1]));
        sines.fold(1.0, f64::min)
    }

    /// The energy of the star's cells with the centre at `x`, if it is below `limit` and no cell's least sine
    /// is below `floor`.
    fn energy(&mut self, energy: &Energy<'_>, x: Point<2>, limit: f64, floor: f64) -> Option<f64> {
        self.spokes.clear();
        self.spokes.extend(self.rim.iter().map(|corner| difference(corner, &x)));
        self.spoke_lengths.clear();
        self.spoke_lengths.extend(self.spokes.iter().map(|spoke| dot(spoke, spoke).sqrt()));
        let mut sum = 0.0;
        for (i, &rim) in self.rim_lengths.iter().enumerate() {
            let area = cross(self.spokes[i], self.spokes[i + 1]);
            let shape = Shape::new(area, [self.spoke_lengths[i], self.spoke_lengths[i + 1], rim]);
            if shape.sine < floor {
                return None;
            }
            sum += energy.of_shape(shape);
        }
        if self.guides.is_empty() {
            return (sum < limit).then_some(sum);
        }
        self.spoke_edges.clear();
        self.spoke_edges.extend(self.rim.iter().map(|&corner| Edge::new(x, corner)));
        for &guide in &self.guides {
            if sum >= limit {
                return None;
            }
            let sector = self.sector(difference(&energy.guides[guide as usize].position, &x));
            let [a, b] = [&self.spoke_edges[sector], &self.spoke_edges[sector + 1]];
            sum += energy.of_guide(guide, [a, b, &self.rim_edges[sector]]);
        }
        (sum < limit).then_some(sum)
    }

    /// The cell, by its place in the star, that a point of the star lies in, given from the centre: between
    /// the spokes before and after it. Where rounding leaves none, the one that fits best.
    #[inline]
    fn sector(&self, from_center: Point<2>) -> usize {
        let mut best = (f64::NEG_INFINITY, 0);
        let mut before = cross(self.spokes[0], from_center);
        for (i, &spoke) in self.spokes.iter().enumerate().skip(1) {
            let after = cross(spoke, from_center);
            let inside = before.min(-after);
            if inside >= 0.0 {
                return i - 1;
            }
            if inside > best.0 {
                best = (inside, i - 1);
            }
            before = after;
        }
        best.1
    }

    /// Shares the guides out among the cells, for the centre at `x`.
    fn share_out(&mut self, triangles: &mut Triangles, energy: &Energy<'_>, x: Point<2>) {
        if self.guides.is_empty() {
            return;
        }
        self.spokes.clear();
        self.spokes.extend(self.rim.iter().map(|corner| difference(corner, &x)));
        self.cells.iter().for_each(|cell| triangles.guides_in_mut(cell.0).clear());
        for &guide in &self.guides {
            let sector = self.sector(difference(&energy.guides[guide as usize].position, &x));
            triangles.guides_in_mut(self.cells[sector].0).push(guide);
        }
    }

    /// How many places are tried.
    fn candidate_count(&self) -> usize {
        DIRECTIONS + if self.guides.is_empty() { 1 } else { 4 }
    }

    /// The k-th place to try.
    fn candidate(&mut self, energy: &Energy<'_>, k: usize, step: f64, turn: f64) -> Point<2> {
        let start = self.center;
        match k {
            0 => self.half_way_to_the_middle(),
            k if k <= DIRECTIONS => {
                let angle = turn + (k as f64 / DIRECTIONS as f64) * std::f64::consts::TAU;
                [start[0] + step * angle.cos(), start[1] + step * angle.sin()]
            }
            k => {
                if k == DIRECTIONS + 1 {
                    self.valley = Some(self.nearest_valley(energy));
                }
                let (bottom, tangent) = self.valley.expect("found for the first of these");
                let along = step * [0.0, 1.0, -1.0][k - DIRECTIONS - 1];
                [bottom[0] + along * tangent[0], bottom[1] + along * tangent[1]]
            }
        }
    }

    /// Half way to the mean of the corners around.
    fn half_way_to_the_middle(&self) -> Point<2> {
        let corners = if self.is_closed { &self.rim[1..] } else { &self.rim[..] };
        let count = corners.len() as f64;
        std::array::from_fn(|k| {
            0.5 * (self.center[k] + corners.iter().map(|corner| corner[k]).sum::<f64>() / count)
        })
    }

    /// The foot of the centre on the line through the nearest guide, and the line's direction.
    fn nearest_valley(&self, energy: &Energy<'_>) -> (Point<2>, Point<2>) {
        let guides = self.guides.iter().map(|&guide| &energy.guides[guide as usize]);
        let far = |p: &Point<2>| distance_squared(p, &self.center);
        let nearest = guides.min_by(|a, b| far(&a.position).total_cmp(&far(&b.position)));
        let guide = nearest.expect("a star with guides");
        let n = guide.normal;
        let off = dot(&difference(&guide.position, &self.center), &n);
        ([self.center[0] + off * n[0], self.center[1] + off * n[1]], [-n[1], n[0]])
    }
}
