//! Pieces of what is left: ragged, bent, or close to others.

use std::collections::VecDeque;

use crate::parallel::prelude::*;

use super::super::FeaturePoint;
use super::link::{Alike, Around, linked_pairs};
use super::meet::fill_in;
use super::near::is_flat;
use crate::geometry::{Bounds, PointGrid, Sets, difference, dot};

/// Points this near to a piece's are explained by it, in mean steps; and those in the flank of its valley, where noise
/// makes valleys of its own: as near as this, and weaker by this.
pub(super) const EXPLAINED: f64 = 1.6;
/// A piece explains points as far as this, in mean steps, that are so near to its plane: where sheets cross, what lies
/// between the two, and where a line ends, the fan of valleys about its tip, which is wider by a share of their distance.
pub(super) const EXPLAINED_ALONG: f64 = 4.5;
const FAN: f64 = 0.3;
const FLANK: f64 = 3.5;
const WEAKER: f64 = 0.6;
/// A piece is one layer: within this, in mean steps, no point of it stands beside another, above its plane by more than
/// a share of their distance and a part of a step; nearer than the last they are one.
const LAYER: f64 = 3.2;
const ABOVE: (f64, f64) = (0.5, 0.35);
const SAME: f64 = 0.8;

/// Adds the points that no piece explains, linked by growth from the strongest on: each next point is on the plane of
/// one that is there, and beside none. So where a line branches one branch goes on, and the other is a piece of its own.
pub(super) fn add_rest<const D: usize>(
    points: &mut Vec<FeaturePoint<D>>,
    sets: &mut Sets,
    rest: &[FeaturePoint<D>],
    bounds: &Bounds<D>,
    reach: f64,
    step: f64,
) {
    let (rest, explained) = unexplained(points, rest, bounds, step);
    fill_in(points, sets, &explained, bounds, step);
    let alike = Alike { reach, cosine: 0.8, slope: 0.4, slack: 0.35 };
    let around = Around::new(rest.len(), &linked_pairs(&rest, bounds, &alike, step));
    let mut seeds: Vec<u32> = (0..rest.len() as u32).collect();
    seeds.sort_by(|&a, &b| {
        let of = |i: u32| rest[i as usize].strength;
        of(b).total_cmp(&of(a)).then(a.cmp(&b))
    });
    let all = PointGrid::new(bounds, LAYER * step, rest.iter().map(|point| point.position));
    let mut piece = vec![u32::MAX; rest.len()];
    let mut next = VecDeque::new();
    for (number, seed) in (0..).zip(seeds) {
        if piece[seed as usize] != u32::MAX {
            continue;
        }
        piece[seed as usize] = number;
        next.push_back(seed);
        while let Some(i) = next.pop_front() {
            for &j in around.of(i) {
                if piece[j as usize] == u32::MAX
                    && !is_beside(&rest, j as usize, number, &piece, &all, step)
                {
                    piece[j as usize] = number;
                    next.push_back(j);
                }
            }
        }
    }
    let mut first = vec![u32::MAX; rest.len()];
    for (point, &number) in rest.iter().zip(&piece) {
        let own = points.len() as u32;
        sets.push();
        points.push(*point);
        let first = &mut first[number as usize];
        if *first == u32::MAX {
            *first = own;
        }
        sets.join(*first, own);
    }
}

/// The points that none of `points` explains, and those that some explain.
fn unexplained<const D: usize>(
    points: &[FeaturePoint<D>],
    rest: &[FeaturePoint<D>],
    bounds: &Bounds<D>,
    step: f64,
) -> (Vec<FeaturePoint<D>>, Vec<FeaturePoint<D>>) {
    let grid =
        PointGrid::new(bounds, EXPLAINED_ALONG * step, points.iter().map(|point| point.position));
    let is_free = |point: &FeaturePoint<D>| {
        let mut is_free = true;
        grid.near(&point.position, EXPLAINED_ALONG * step, |_, i| {
            is_free = is_free && !explains(&points[i], point, step);
        });
        is_free
    };
    let is_free: Vec<bool> = rest.par_iter().with_min_len(1 << 8).map(is_free).collect();
    let (mut free, mut explained) = (Vec::new(), Vec::new());
    for (point, is_free) in rest.iter().zip(is_free) {
        if is_free { free.push(*point) } else { explained.push(*point) }
    }
    (free, explained)
}

/// Whether a point of a piece explains another point.
pub(super) fn explains<const D: usize>(
    own: &FeaturePoint<D>,
    other: &FeaturePoint<D>,
    step: f64,
) -> bool {
    let (near, flank, along) = (EXPLAINED * step, FLANK * step, EXPLAINED_ALONG * step);
    let slope = if D == 2 { FAN } else { 0.0 };
    let offset = difference(&own.position, &other.position);
    let squared = dot(&offset, &offset);
    let above = dot(&offset, &own.normal).abs();
    squared < near * near
        || squared < along * along && above < near + slope * squared.sqrt()
        || squared < flank * flank && other.strength < WEAKER * own.strength
}

/// How many points of each set stand beside others of it, as in a second layer; by root.
pub(super) fn layered<const D: usize>(
    points: &[FeaturePoint<D>],
    roots: &[u32],
    bounds: &Bounds<D>,
    step: f64,
) -> Vec<usize> {
    let all = PointGrid::new(bounds, LAYER * step, points.iter().map(|point| point.position));
    let are_beside = all.map_blocks(LAYER * step, |block, found: &mut Vec<bool>| {
        // near a flat block no point is so far above another
        let is_flat = is_flat(block, points, step);
        found.extend(block.own().iter().map(|(_, i)| {
            !is_flat && is_beside(points, *i as usize, roots[*i as usize], roots, &all, step)
        }));
    });
    let mut counts = vec![0; roots.len()];
    roots.iter().zip(are_beside).for_each(|(&root, is)| counts[root as usize] += usize::from(is));
    counts
}

/// Whether a point would stand beside others of a piece, as in a second layer.
fn is_beside<const D: usize>(
    rest: &[FeaturePoint<D>],
    j: usize,
    number: u32,
    piece: &[u32],
    all: &PointGrid<D>,
    step: f64,
) -> bool {
    let (point, reach) = (&rest[j], LAYER * step);
    let mut is_beside = false;
    all.near(&point.position, reach, |position, k| {
        if piece[k] != number {
            return;
        }
        let offset = difference(position, &point.position);
        let length = dot(&offset, &offset).sqrt();
        let above = dot(&offset, &point.normal).abs();
        is_beside |=
            (SAME * step..=reach).contains(&length) && above > ABOVE.0 * length + ABOVE.1 * step;
    });
    is_beside
}
