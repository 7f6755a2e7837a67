//! Dark traces on grey: fault traces as in Hale (2001), Fig. 1, and a straight slit.

use super::random::Random;
use super::truth::{Geometry, Role, TrueFeature};
use super::{Canvas, Sketch, grey};
use crate::geometry::{Bounds, Point};
use std::f64::consts::{PI, TAU};

/// The distance from its middle, in samples, beyond which a line is darker than its surroundings by less than 1e-6.
const REACH: f64 = 7.0;
/// Points of a trace that crosses the box; it is smooth at this resolution.
const STEPS: usize = 128;

/// One trace before it is a feature.
struct Trace<const D: usize> {
    geometry: Geometry<D>,
    bounds: Bounds<D>,
    /// The share of full darkness.
    strength: f64,
}

/// A few long curved traces from side to side, crossed by others, and many short ones.
pub(super) fn sketch<const D: usize>(canvas: &Canvas<D>, random: &mut Random) -> Sketch<D> {
    let mut paths = Vec::new();
    for share in [0.22, 0.62] {
        let start = [0.0, share + random.between(-0.1, 0.1)];
        let heading = random.between(-0.35, 0.35);
        paths.push((walk(start, heading, 1.5, random), random.between(0.85, 1.0)));
    }
    for share in [0.12, 0.3, 0.7, 0.88] {
        // from the top downward or from the bottom upward
        let down = random.sign();
        let start = [share + random.between(-0.1, 0.1), 0.5 - 0.5 * down];
        let heading = down * TAU / 4.0 + random.between(-0.35, 0.35);
        let length = random.between(0.3, 1.2);
        paths.push((walk(start, heading, length, random), random.between(0.85, 1.0)));
    }
    for _ in 0..12 {
        let start = [random.between(0.05, 0.95), random.between(0.05, 0.95)];
        let heading = random.between(0.0, TAU);
        let length = random.between(0.08, 0.25);
        paths.push((walk(start, heading, length, random), random.between(0.6, 1.0)));
    }
    let margin = REACH * canvas.step;
    let traces: Vec<Trace<D>> = paths
        .into_iter()
        .filter_map(|(shares, strength)| {
            let points: Vec<Point<D>> = shares
                .iter()
                .map(|s| canvas.at(&std::array::from_fn(|k| s.get(k).copied().unwrap_or(0.5))))
                .collect();
            let mut bounds = Bounds::of(&points)?;
            for k in 0..D {
                bounds.min[k] -= margin;
                bounds.max[k] += margin;
            }
            Some(Trace { geometry: Geometry::Path { points }, bounds, strength })
        })
        .collect();
    let features = traces
        .iter()
        .map(|t| TrueFeature { role: Role::Fault, geometry: t.geometry.clone() })
        .collect();
    let canvas = *canvas;
    let shade = move |p: &Point<D>| {
        let mut least = grey::BACKGROUND;
        for trace in traces.iter().filter(|t| t.bounds.contains(p)) {
            let line = canvas.line(trace.geometry.distance(p));
            least = least.min(grey::BACKGROUND + trace.strength * (line - grey::BACKGROUND));
        }
        least
    };
    Sketch { features, layers: None, shade: Box::new(shade) }
}

/// A smooth curve in the unit square: heading and curvature wander, and it ends at the border.
fn walk(start: [f64; 2], heading: f64, length: f64, random: &mut Random) -> Vec<[f64; 2]> {
    let bend = random.between(-0.6, 0.6);
    let wave = random.between(0.0, 0.25);
    let (period, phase) = (random.between(0.3, 0.7), random.between(0.0, TAU));
    let step = 1.0 / STEPS as f64;
    let mut points = vec![start];
    let mut at = start;
    for i in 0..(length / step) as usize {
        let s = i as f64 * step;
        let angle = heading + bend * s + wave * (TAU * s / period + phase).sin();
        let next = [at[0] + step * angle.cos(), at[1] + step * angle.sin()];
        if next.iter().any(|x| !(0.0..=1.0).contains(x)) {
            break;
        }
        points.push(next);
        at = next;
    }
    points
}

/// A straight slit through the middle of the box, half as long as its least extent.
pub(super) fn slit<const D: usize>(canvas: &Canvas<D>, random: &mut Random) -> Sketch<D> {
    let angle = random.between(0.0, PI);
    let mut normal = [0.0; D];
    (normal[0], normal[1]) = (-angle.sin(), angle.cos());
    let center = canvas.at(&[0.5; D]);
    let geometry = Geometry::Disk { center, normal, radius: 0.25 * canvas.least_extent() };
    let features = vec![TrueFeature { role: Role::Slit, geometry: geometry.clone() }];
    let canvas = *canvas;
    Sketch { features, layers: None, shade: Box::new(move |p| canvas.line(geometry.distance(p))) }
}
