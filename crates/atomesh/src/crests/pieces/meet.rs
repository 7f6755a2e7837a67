//! Where features meet or have gaps: which pieces go on in each other, and the points between them.

use std::collections::HashSet;

use crate::parallel::prelude::*;

use super::super::FeaturePoint;
use super::grow::{EXPLAINED, EXPLAINED_ALONG};
use super::link::Alike;
use super::near::Columns;
use super::support::SUPPORT;
use crate::geometry::{Bins, Bounds, Point, PointGrid, Sets, difference, distance_squared, dot};

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
/// Where the mean of a piece's points within [`EXPLAINED_ALONG`] is farther than this, in mean steps, a piece has ended: at its border
/// it is 1.9.
const OUTSIDE: f64 = 2.8;
/// How often lines are led on at their ends, and the least strength there, over that of the line: half of it is where a
/// blurred line ends, and a line goes on by a step beyond its last point.
const LED_OUT: usize = 6;
const AT_END: f64 = 0.7;

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
    let meeting_grid = PointGrid::new(bounds, NEAR_MEETING * step, meetings.iter().copied());
    let grid = PointGrid::new(bounds, SUPPORT * step, points.iter().map(|point| point.position));
    let is_at_meeting = |point: &FeaturePoint<D>| {
        let (reach, mut found) = (NEAR_MEETING * step, false);
        meeting_grid.near(&point.position, reach, |place, _| {
            found |= distance_squared(place, &point.position) <= reach * reach;
        });
        found
    };
    // 0: no end
    let reaches = grid.map_blocks(SUPPORT * step, |block, reaches: &mut Vec<f64>| {
        let (mut own_root, mut columns) = (u32::MAX, None);
        for (place, i) in block.own() {
            let root = roots[*i as usize];
            if is_at_meeting(&points[*i as usize]) {
                reaches.push(BRIDGE * step);
                continue;
            }
            let columns = match &mut columns {
                Some(columns) if own_root == root => columns,
                other => {
                    own_root = root;
                    other.insert(Columns::of(block, points, |j| roots[j as usize] == root))
                }
            };
            let (sum, count) = columns.ways(place, SUPPORT * step);
            let is_lopsided = dot(&sum, &sum).sqrt() > LOPSIDED * step * count;
            reaches.push(if is_lopsided { GAP * step } else { 0.0 });
        }
    });
    let found = reaches.into_iter().enumerate().filter(|(_, reach)| *reach > 0.0);
    let mut found: Vec<(usize, f64)> = found.collect();
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

/// A piece beside a point that it explains.
struct Beside<const D: usize> {
    root: u32,
    /// The squared distance of its nearest point, and the number of that.
    nearest: (f64, usize),
    /// The sum of the ways to its points within reach, and how many these are.
    sum: Point<D>,
    count: f64,
}

/// Adds points to pieces where they have none, but points that they explain: where sheets cross, at their rims, and at the
/// ends of lines. Each is put onto the planes of the pieces that are near it.
pub(super) fn fill_in<const D: usize>(
    points: &mut Vec<FeaturePoint<D>>,
    sets: &mut Sets,
    explained: &[FeaturePoint<D>],
    bounds: &Bounds<D>,
    step: f64,
) {
    let rounds = if D == 2 { LED_OUT } else { 1 };
    for _ in 0..rounds {
        let count = points.len();
        fill_once(points, sets, explained, bounds, step);
        if points.len() == count {
            return;
        }
    }
}

/// One round of [`fill_in`], which leads an end on by a step or so.
fn fill_once<const D: usize>(
    points: &mut Vec<FeaturePoint<D>>,
    sets: &mut Sets,
    explained: &[FeaturePoint<D>],
    bounds: &Bounds<D>,
    step: f64,
) {
    let roots = sets.roots();
    let grid = PointGrid::new(bounds, SUPPORT * step, points.iter().map(|point| point.position));
    let reach = EXPLAINED_ALONG * step;
    let places = |point: &FeaturePoint<D>| {
        let mut beside: Vec<Beside<D>> = Vec::new();
        grid.near(&point.position, reach, |place, i| {
            let offset = difference(place, &point.position);
            let squared = dot(&offset, &offset);
            if squared > reach * reach {
                return;
            }
            let root = roots[i];
            let at = beside.iter().position(|piece| piece.root == root).unwrap_or_else(|| {
                beside.push(Beside { root, nearest: (squared, i), sum: [0.0; D], count: 0.0 });
                beside.len() - 1
            });
            let piece = &mut beside[at];
            piece.nearest = if (squared, i) < piece.nearest { (squared, i) } else { piece.nearest };
            (0..D).for_each(|k| piece.sum[k] += offset[k]);
            piece.count += 1.0;
        });
        beside.sort_unstable_by_key(|piece| piece.root);
        let on_plane = |piece: Beside<D>| {
            let i = piece.nearest.1;
            let plane = evened(i, points, &roots, &grid, step);
            let above = dot(&difference(&point.position, &plane.position), &plane.normal);
            let is_faint = D == 2 && point.strength < AT_END * points[i].strength;
            let is_off = is_faint || above.abs() > EXPLAINED * step;
            if is_off || dot(&piece.sum, &piece.sum).sqrt() > OUTSIDE * step * piece.count {
                return None;
            }
            let position = std::array::from_fn(|k| point.position[k] - above * plane.normal[k]);
            let strength = points[i].strength;
            Some((i as u32, FeaturePoint { index: point.index, position, strength, ..plane }))
        };
        beside.into_iter().filter_map(on_plane).collect::<Vec<_>>()
    };
    let found: Vec<_> = explained.par_iter().with_min_len(1 << 6).map(places).collect();
    let mut bins = Bins::of(bounds, step, points.iter().map(|point| point.position));
    for (i, point) in found.into_iter().flatten() {
        add_apart(points, sets, &mut bins, i, point, FILL * step);
    }
}

/// Adds a point to the set of point `i`, if none of the set is nearer to it than `spacing`.
fn add_apart<const D: usize>(
    points: &mut Vec<FeaturePoint<D>>,
    sets: &mut Sets,
    bins: &mut Bins<D>,
    i: u32,
    point: FeaturePoint<D>,
    spacing: f64,
) {
    let (mut is_free, root) = (true, sets.root(i));
    bins.near(&point.position, spacing, |k| {
        is_free &= distance_squared(&points[k].position, &point.position) >= spacing * spacing
            || sets.root(k as u32) != root;
    });
    if is_free {
        bins.push(&point.position);
        sets.push();
        sets.join(i, points.len() as u32);
        points.push(point);
    }
}

/// Adds points between joined pieces, in the sets of the pieces.
fn fill<const D: usize>(
    points: &mut Vec<FeaturePoint<D>>,
    sets: &mut Sets,
    bridges: &[[u32; 2]],
    bounds: &Bounds<D>,
    step: f64,
) {
    if bridges.is_empty() {
        return;
    }
    let spacing = FILL * step;
    let mut bins = Bins::of(bounds, step, points.iter().map(|point| point.position));
    for &[i, j] in bridges {
        let (a, mut b) = (points[i as usize], points[j as usize]);
        if dot(&a.normal, &b.normal) < 0.0 {
            b.normal = b.normal.map(|n| -n); // finders leave the sign open
        }
        let length = distance_squared(&a.position, &b.position).sqrt();
        let count = (length / spacing) as usize + 1;
        for n in 1..count {
            let t = n as f64 / count as f64;
            let mix = |x: &Point<D>, y: &Point<D>| -> Point<D> {
                std::array::from_fn(|k| (1.0 - t) * x[k] + t * y[k])
            };
            let (position, normal) = (mix(&a.position, &b.position), mix(&a.normal, &b.normal));
            let length = dot(&normal, &normal).sqrt();
            let point = FeaturePoint {
                index: a.index,
                position,
                normal: normal.map(|x| x / length),
                strength: (1.0 - t) * a.strength + t * b.strength,
            };
            add_apart(points, sets, &mut bins, i, point, spacing);
        }
    }
}
