//! Taking points away where they crowd, and adding points where they are missing.
//!
//! An image pulls more atoms onto some features than edges of length d need, and leaves thin cells beside. A point
//! goes if its star costs less with one of its near neighbours in its place. A long edge gets a point near its
//! middle if the four cells around that cost less than the two had. Only points that features or the floor have
//! woken are considered.

use crate::fields::NominalDistance;
use crate::geometry::{Point, distance_squared};

use super::energy::Energy;
use super::moves::Mover;
use super::star::{Limits, Star};
use super::swaps::LEAST_GAIN;
use super::triangles::{CellPair, Triangles};

/// A point may go to a neighbour that is nearer than this, over d.
const SHORT: f64 = 0.8;
/// The length from which on an edge may be split, over d.
const LONG: f64 = 1.3;
/// How far from the middle of an edge a guide may be to be a place for its new point, over d.
const NEAR_MIDDLE: f64 = 0.3;

/// Takes away points that crowd. Returns how many.
pub(super) fn thin_out(triangles: &mut Triangles, energy: &Energy<'_>, mover: &mut Mover) -> usize {
    let (mut star, mut fan) = (Star::default(), Star::default());
    let mut removed = 0;
    for point in 0..triangles.points.len() as u32 {
        if !mover.may_go(point) {
            continue;
        }
        star.gather(triangles, point);
        if !star.is_closed {
            continue;
        }
        let near = (SHORT * mover.distance(point)).powi(2);
        let Some(to) = best_end(&mut star, &mut fan, energy, near) else { continue };
        // the corner that takes its place sees the star from the corner after it round to the one before
        let count = star.cells.len();
        let x = star.rim[to];
        fan_from(&star, &mut fan, to);
        let cells = |place: usize| star.cells[(to + 1 + place) % count].cell;
        triangles.collapse(point, &star.cells, to);
        fan.share_out(triangles, energy, cells, x);
        mover.remove(point);
        mover.wake_all(star.cells.iter().map(|cell| cell.first));
        removed += 1;
    }
    removed
}

/// The corner of the rim, nearer than the square root of `near`, whose taking the centre's place gains most.
fn best_end(star: &mut Star, fan: &mut Star, energy: &Energy<'_>, near: f64) -> Option<usize> {
    let count = star.cells.len();
    let is_near = |place: &usize| distance_squared(&star.rim[*place], &star.center) < near;
    let ends: Vec<usize> = (0..count).filter(is_near).collect();
    if ends.is_empty() {
        return None;
    }
    let sine = energy.sine_to_keep(star.least_sine());
    let center = star.center;
    let now = star.energy(energy, center, Limits::NONE)?;
    let mut limits = Limits { energy: now - LEAST_GAIN, sine };
    let mut end = None;
    for to in ends {
        fan_from(star, fan, to);
        if let Some(lower) = fan.energy(energy, star.rim[to], limits) {
            limits.energy = lower;
            end = Some(to);
        }
    }
    end
}

/// The star as the `to`-th corner of its rim sees it: the other corners, in turn.
fn fan_from(star: &Star, fan: &mut Star, to: usize) {
    let count = star.cells.len();
    fan.rim.clear();
    fan.rim.extend((1..count).map(|place| star.rim[(to + place) % count]));
    fan.guides.clone_from(&star.guides);
    fan.measure_rim();
}

/// Adds points where they are missing. Returns how many.
pub(super) fn fill_gaps(
    triangles: &mut Triangles,
    energy: &Energy<'_>,
    mover: &mut Mover,
    distance: &NominalDistance<2>,
) -> usize {
    let mut star = Star::default();
    let mut added = 0;
    for cell in 0..triangles.len() as u32 {
        for place in 0..3 {
            let Some(pair) = triangles.pair(cell, place) else { continue };
            if pair.cells[1] < cell {
                continue; // each pair once
            }
            let around = pair.corners();
            if !around.iter().any(|&point| mover.has_been_awake(point)) {
                continue;
            }
            let Some(x) = place_for_a_point(triangles, energy, distance, &pair, &mut star) else {
                continue;
            };
            let cells = triangles.split(&pair, x);
            star.share_out(triangles, energy, |sector| cells[sector], x);
            mover.add(distance.at(&x));
            mover.wake_all(around);
            added += 1;
            break;
        }
    }
    added
}

/// The place for a new point between a pair of cells, if their edge is long and that gains. `star` becomes the star
/// that the point would have.
fn place_for_a_point(
    triangles: &Triangles,
    energy: &Energy<'_>,
    distance: &NominalDistance<2>,
    pair: &CellPair,
    star: &mut Star,
) -> Option<Point<2>> {
    let [a, b] = pair.edge.map(|c| triangles.points[c as usize]);
    let middle: Point<2> = std::array::from_fn(|k| 0.5 * (a[k] + b[k]));
    let d = distance.at(&middle);
    if distance_squared(&a, &b) < (LONG * d).powi(2) {
        return None;
    }
    let corners = pair.corners().map(|c| triangles.points[c as usize]);
    star.rim.clear();
    star.rim.extend(corners.iter().chain(&corners[..1]));
    star.measure_rim();
    star.guides.clear();
    let (mut now, mut sine) = (-LEAST_GAIN, f64::INFINITY);
    for cell in pair.cells {
        let guides = triangles.guides_in(cell);
        let old = energy.of_cell(triangles.corners_at(cell), guides);
        now += old.cost;
        sine = sine.min(old.sine);
        star.guides.extend_from_slice(guides);
    }
    let limits = Limits { energy: now, sine: energy.sine_to_keep(sine) };
    best_middle(star, energy, middle, (NEAR_MIDDLE * d).powi(2), limits)
}

/// The place within a rim of four corners that costs least: the middle of the edge, the mean of the corners, or a
/// guide nearer to the middle than the square root of `near`; `None` if none keeps to the limits.
fn best_middle(
    star: &mut Star,
    energy: &Energy<'_>,
    middle: Point<2>,
    near: f64,
    mut limits: Limits,
) -> Option<Point<2>> {
    let mean: Point<2> =
        std::array::from_fn(|k| 0.25 * star.rim[..4].iter().map(|c| c[k]).sum::<f64>());
    let guides = star.guides.iter().map(|&guide| energy.guides[guide as usize].at.position);
    let places: Vec<Point<2>> = [middle, mean]
        .into_iter()
        .chain(guides.filter(|p| distance_squared(p, &middle) < near))
        .collect();
    let mut best = None;
    for x in places {
        if let Some(lower) = star.energy(energy, x, limits) {
            limits.energy = lower;
            best = Some(x);
        }
    }
    best
}
