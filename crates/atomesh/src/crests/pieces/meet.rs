//! Where features meet or have gaps: which pieces go on in each other, and the points between them.

use std::collections::HashSet;

use rayon::prelude::*;

use super::super::{Bins, FeaturePoint, PointGrid};
use super::link::{Alike, SUPPORT};
use crate::geometry::{Bounds, Point, Sets, difference, distance_squared, dot};

/// How far pieces on one line or plane may be apart and still be joined, in mean steps.
const BRIDGE: f64 = 26.0;
/// How far the ends of pieces on one line or plane may be apart where no features meet, in mean steps.
const GAP: f64 = 5.0;
/// How far from where features meet the ends of pieces are, in mean steps.
const NEAR_MEETING: f64 = 6.0;
/// An end has its neighbours on one side: their mean is farther than this, in mean steps.
const LOPSIDED: f64 = 1.2;
/// The width of cubes in which one end of a piece is tried, in mean steps.
const SPARSE: f64 = 1.5;
/// How far the points between joined pieces are apart, in mean steps.
const FILL: f64 = 0.8;

/// An end of a piece.
struct End<const D: usize> {
    /// The number of the point.
    number: u32,
    /// The point, with the mean of the normals of its piece near it.
    point: FeaturePoint<D>,
    /// How far another piece may be that goes on in this one.
    reach: f64,
}

/// Joins pieces that go on in each other, with points between them. `meetings` are places where features meet.
pub(super) fn join_across<const D: usize>(
    points: &mut Vec<FeaturePoint<D>>,
    sets: &mut Sets,
    meetings: &[Point<D>],
    alike: &Alike,
    bounds: &Bounds<D>,
    step: f64,
) {
    let bridges = bridges(points, &sets.roots(), meetings, alike, bounds, step);
    bridges.iter().for_each(|&[i, j]| sets.join(i, j));
    fill(points, sets, &bridges, bounds, step);
}

/// Pairs of points, the first the lower, of pieces that go on in each other: each end of a piece with the nearest end
/// that is in line with it.
fn bridges<const D: usize>(
    points: &[FeaturePoint<D>],
    roots: &[u32],
    meetings: &[Point<D>],
    alike: &Alike,
    bounds: &Bounds<D>,
    step: f64,
) -> Vec<[u32; 2]> {
    let ends = ends(points, roots, meetings, bounds, step);
    let grid = PointGrid::new(bounds, 6.0 * step, ends.iter().map(|end| end.point.position));
    let across = |end: &End<D>| {
        let alike = Alike { reach: end.reach, ..*alike };
        let mut best = (end.reach * end.reach, None);
        grid.near(&end.point.position, end.reach, |place, j| {
            let found = (distance_squared(place, &end.point.position), Some(ends[j].number));
            if roots[end.number as usize] != roots[ends[j].number as usize]
                && found < best
                && alike.holds(&end.point, &ends[j].point, step)
            {
                best = found;
            }
        });
        best.1.map(|other| [end.number.min(other), end.number.max(other)])
    };
    let mut found: Vec<[u32; 2]> =
        ends.par_iter().with_min_len(1 << 6).filter_map(across).collect();
    found.sort_unstable();
    found.dedup();
    found
}

/// The points near which a piece ends or meets another, one in each small cube.
fn ends<const D: usize>(
    points: &[FeaturePoint<D>],
    roots: &[u32],
    meetings: &[Point<D>],
    bounds: &Bounds<D>,
    step: f64,
) -> Vec<End<D>> {
    let meeting_grid = PointGrid::new(bounds, 3.0 * step, meetings.iter().copied());
    let grid = PointGrid::new(bounds, 1.5 * step, points.iter().map(|point| point.position));
    let is_at_meeting = |point: &FeaturePoint<D>| {
        let (reach, mut found) = (NEAR_MEETING * step, false);
        meeting_grid.near(&point.position, reach, |place, _| {
            found |= distance_squared(place, &point.position) <= reach * reach;
        });
        found
    };
    let is_lopsided = |i: usize| {
        let (mut sum, mut count) = ([0.0; D], 0.0);
        grid.near(&points[i].position, SUPPORT * step, |place, j| {
            let offset = difference(place, &points[i].position);
            if roots[i] == roots[j] && dot(&offset, &offset) <= (SUPPORT * step).powi(2) {
                (0..D).for_each(|k| sum[k] += offset[k]);
                count += 1.0;
            }
        });
        dot(&sum, &sum).sqrt() > LOPSIDED * step * count
    };
    let reach = |i: usize| {
        let reach = if is_at_meeting(&points[i]) { Some(BRIDGE) } else { None };
        let reach = reach.or_else(|| is_lopsided(i).then_some(GAP))?;
        Some((i, reach * step))
    };
    let mut found: Vec<(usize, f64)> =
        (0..points.len()).into_par_iter().with_min_len(1 << 8).filter_map(reach).collect();
    let mut seen = HashSet::new();
    found.retain(|&(i, _)| {
        let cube = points[i].position.map(|x| (x / (SPARSE * step)) as i64);
        seen.insert((cube, roots[i]))
    });
    let end = |&(i, reach): &(usize, f64)| End {
        number: i as u32,
        point: evened(i, points, roots, &grid, step),
        reach,
    };
    found.par_iter().with_min_len(1 << 6).map(end).collect()
}

/// A point with the mean of the normals of its piece near it.
fn evened<const D: usize>(
    i: usize,
    points: &[FeaturePoint<D>],
    roots: &[u32],
    grid: &PointGrid<D>,
    step: f64,
) -> FeaturePoint<D> {
    let (point, reach) = (points[i], SUPPORT * step);
    let mut sum = [0.0; D];
    grid.near(&point.position, reach, |_, j| {
        let cosine = dot(&points[j].normal, &point.normal);
        let is_near = distance_squared(&points[j].position, &point.position) <= reach * reach;
        if is_near && roots[i] == roots[j] && cosine.abs() > 0.85 {
            (0..D).for_each(|k| sum[k] += cosine.signum() * points[j].normal[k]);
        }
    });
    let length = dot(&sum, &sum).sqrt();
    FeaturePoint { normal: sum.map(|x| x / length), ..point }
}

/// Adds points between joined pieces, in the sets of the pieces.
fn fill<const D: usize>(
    points: &mut Vec<FeaturePoint<D>>,
    sets: &mut Sets,
    bridges: &[[u32; 2]],
    bounds: &Bounds<D>,
    step: f64,
) {
    let spacing = FILL * step;
    let mut bins = Bins::of(bounds, step, points.iter().map(|point| point.position));
    for &[i, j] in bridges {
        let (a, b) = (points[i as usize], points[j as usize]);
        let length = distance_squared(&a.position, &b.position).sqrt();
        let count = (length / spacing) as usize + 1;
        for n in 1..count {
            let t = n as f64 / count as f64;
            let mix = |x: &Point<D>, y: &Point<D>| -> Point<D> {
                std::array::from_fn(|k| (1.0 - t) * x[k] + t * y[k])
            };
            let (position, normal) = (mix(&a.position, &b.position), mix(&a.normal, &b.normal));
            let length = dot(&normal, &normal).sqrt();
            let normal = normal.map(|x| x / length);
            let mut is_free = true;
            let root = sets.root(i);
            bins.near(&position, spacing, |k| {
                is_free &= distance_squared(&points[k].position, &position) >= spacing * spacing
                    || sets.root(k as u32) != root;
            });
            if is_free {
                bins.push(&position);
                sets.push();
                sets.join(i, points.len() as u32);
                points.push(FeaturePoint {
                    index: a.index,
                    position,
                    normal,
                    strength: (1.0 - t) * a.strength + t * b.strength,
                });
            }
        }
    }
}
