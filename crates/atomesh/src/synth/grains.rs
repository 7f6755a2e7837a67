//! Grains: the Voronoi cells of well-spread points, neighbours of clearly different greys.

use super::random::Random;
use super::truth::{Geometry, Role, TrueFeature};
use super::{Canvas, Sketch};
use crate::geometry::{Point, distance_squared};

/// Grains along each axis of the box, about.
const PER_AXIS: usize = 4;
/// Candidates of which the most remote becomes the next centre (Mitchell 1991).
const CANDIDATES: usize = 12;
/// Grey levels to choose from.
const LEVELS: [f64; 12] =
    [30.0, 48.0, 66.0, 84.0, 102.0, 120.0, 138.0, 156.0, 174.0, 192.0, 210.0, 228.0];

/// About 4 grains along each axis.
pub(super) fn sketch<const D: usize>(canvas: &Canvas<D>, random: &mut Random) -> Sketch<D> {
    let centers = centers(canvas, random);
    let greys = greys(&centers, random);
    let step = canvas.step;
    let shaded = centers.clone();
    Sketch {
        features: vec![TrueFeature {
            role: Role::Boundary,
            geometry: Geometry::Grains { centers },
        }],
        layers: None,
        shade: Box::new(move |p| shade(p, &shaded, &greys, step)),
    }
}

/// Points that keep apart: each the most remote of a few candidates.
fn centers<const D: usize>(canvas: &Canvas<D>, random: &mut Random) -> Vec<Point<D>> {
    let count = PER_AXIS.pow(D as u32);
    let mut centers: Vec<Point<D>> = Vec::with_capacity(count);
    for _ in 0..count {
        let mut best = (f64::NEG_INFINITY, [0.0; D]);
        for _ in 0..CANDIDATES {
            let candidate = canvas.at(&std::array::from_fn(|_| random.unit()));
            let remote = centers
                .iter()
                .map(|c| distance_squared(c, &candidate))
                .fold(f64::INFINITY, f64::min);
            if remote > best.0 {
                best = (remote, candidate);
            }
        }
        centers.push(best.1);
    }
    centers
}

/// A level for each centre, as far as may be from those of the centres nearest to it.
fn greys<const D: usize>(centers: &[Point<D>], random: &mut Random) -> Vec<f64> {
    // as many as a grain usually has neighbours: 6 in 2-D, 14 in 3-D
    let neighbours = (1 << (D + 1)) - 2;
    let mut greys: Vec<f64> = Vec::with_capacity(centers.len());
    for (i, center) in centers.iter().enumerate() {
        let mut near: Vec<usize> = (0..i).collect();
        near.sort_by(|&a, &b| {
            let remote = |k: usize| distance_squared(&centers[k], center);
            remote(a).total_cmp(&remote(b))
        });
        near.truncate(neighbours);
        let start = (random.unit() * LEVELS.len() as f64) as usize;
        let mut best = (f64::NEG_INFINITY, 0.0);
        for k in 0..LEVELS.len() {
            let level = LEVELS[(start + k) % LEVELS.len()];
            let contrast =
                near.iter().map(|&j| (greys[j] - level).abs()).fold(f64::INFINITY, f64::min);
            if contrast > best.0 {
                best = (contrast, level);
            }
        }
        greys.push(best.1);
    }
    greys
}

/// The grey of the grain at `p`, mixed with the next one's within half a sample of their boundary.
fn shade<const D: usize>(p: &Point<D>, centers: &[Point<D>], greys: &[f64], step: f64) -> f64 {
    let (mut own, mut next) = ((f64::INFINITY, 0), (f64::INFINITY, 0));
    for (i, center) in centers.iter().enumerate() {
        let remote = distance_squared(p, center);
        if remote < own.0 {
            next = own;
            own = (remote, i);
        } else if remote < next.0 {
            next = (remote, i);
        }
    }
    let apart = distance_squared(&centers[own.1], &centers[next.1]).sqrt();
    let share = (0.5 + (next.0 - own.0) / (2.0 * apart * step)).clamp(0.0, 1.0);
    greys[own.1] * share + greys[next.1] * (1.0 - share)
}
