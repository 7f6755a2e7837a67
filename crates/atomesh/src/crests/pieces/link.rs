//! Linking points to pieces: who lies on whose plane.

use std::collections::VecDeque;

use crate::parallel::prelude::*;

use super::super::FeaturePoint;
use super::grow::{add_rest, layered};
use super::meet::join_across;
use super::near::is_flat;
use super::support::supported;
use crate::geometry::{Block, Bounds, Point, PointGrid, Sets, difference, distance_squared, dot};
use crate::image::Grid;

/// How far linked points may be apart, over the diagonal of a sample's cell.
const LINK: f64 = 1.2;
/// In space points this near to a side of the image, in mean steps, say nothing: samples mirrored there turn their normals,
/// and sheets at a slant pass over into each other. Pieces are led on to sides.
const AT_SIDE: f64 = 1.0;
/// Sets of fewer points, in space of fewer than the square, are linked anew with what is left.
const SMALL: usize = 12;
/// Sets of which so many points stand beside others, in the plane and in space, fork, and are linked again as small ones are.
const LAYERED: [usize; 2] = [5, 150];
/// What goes on across a place where features meet, and what over a gap. Reaches are set where they are used.
const ACROSS: Alike = Alike { reach: 0.0, cosine: 0.96, slope: 0.08, slack: 0.4 };
const OVER_GAPS: Alike = Alike { reach: 0.0, cosine: 0.95, slope: 0.12, slack: 0.4 };
/// Points whose links one task finds.
const TASK: usize = 1 << 12;

/// The points of pieces, their normals turned to agree, with some more where pieces were joined; and the sets that
/// make a piece each.
pub(super) fn linked_pieces<const D: usize>(
    points: Vec<FeaturePoint<D>>,
    grid: &Grid<D>,
    step: f64,
) -> (Vec<FeaturePoint<D>>, Sets) {
    let bounds = grid.bounds();
    let reach = LINK * dot(&grid.step, &grid.step).sqrt();
    let alike = Alike { reach, cosine: 0.8, slope: 0.4, slack: 0.35 };
    let points = if D > 2 { off_sides(points, &bounds, AT_SIDE * step) } else { points };
    let (mut points, mut others) = supported(points, &bounds, step);
    points.sort_by_key(|point| point.index);
    let mut sets = Sets::new(points.len());
    let links = spanning_pairs(&points, None, &bounds, &alike, step);
    links.iter().for_each(|&[i, j]| sets.join(i, j));
    drop(links);
    let meetings: Vec<Point<D>> = others.iter().map(|point| point.position).collect();
    join_across(&mut points, &mut sets, &meetings, &ACROSS, &bounds, step);
    others.extend(take_unclear(&mut points, &mut sets, &bounds, step));
    others.sort_by_key(|point| point.index);
    add_rest(&mut points, &mut sets, &others, &bounds, reach, step);
    join_across(&mut points, &mut sets, &[], &OVER_GAPS, &bounds, step);
    let roots = sets.roots();
    let links = spanning_pairs(&points, Some(&roots), &bounds, &alike, step);
    turn(&mut points, &links);
    (points, sets)
}

/// The points farther than `near` from all sides of the box.
fn off_sides<const D: usize>(
    mut points: Vec<FeaturePoint<D>>,
    bounds: &Bounds<D>,
    near: f64,
) -> Vec<FeaturePoint<D>> {
    points.retain(|point| {
        let p = &point.position;
        (0..D).all(|k| p[k] >= bounds.min[k] + near && p[k] <= bounds.max[k] - near)
    });
    points
}

/// Takes out the points of sets too small to say how a feature goes on, and of those that are no single line or sheet.
fn take_unclear<const D: usize>(
    points: &mut Vec<FeaturePoint<D>>,
    sets: &mut Sets,
    bounds: &Bounds<D>,
    step: f64,
) -> Vec<FeaturePoint<D>> {
    let roots = sets.roots();
    let mut counts = vec![0usize; roots.len()];
    roots.iter().for_each(|&root| counts[root as usize] += 1);
    let least = SMALL.pow(D as u32 - 1);
    let layered = layered(points, &roots, bounds, step);
    let is_unclear = |i: usize| {
        let root = roots[i] as usize;
        counts[root] < least || layered[root] >= LAYERED[D - 2]
    };
    let (mut kept, mut small) = (Vec::new(), Vec::new());
    let mut kept_sets = Sets::default();
    let mut number = vec![u32::MAX; roots.len()];
    for (i, point) in points.drain(..).enumerate() {
        if is_unclear(i) {
            small.push(point);
            continue;
        }
        let own = kept.len() as u32;
        kept.push(point);
        kept_sets.push();
        let first = &mut number[roots[i] as usize];
        if *first == u32::MAX {
            *first = own;
        }
        kept_sets.join(*first, own);
    }
    (*points, *sets) = (kept, kept_sets);
    small
}

/// The pairs of points that are on one line or plane, each with its earlier point first, in the order of these.
pub(super) fn linked_pairs<const D: usize>(
    points: &[FeaturePoint<D>],
    bounds: &Bounds<D>,
    alike: &Alike,
    step: f64,
) -> Vec<[u32; 2]> {
    let grid = PointGrid::new(bounds, alike.reach, points.iter().map(|point| point.position));
    let of = |start: usize| {
        let mut found = Vec::new();
        for i in start..points.len().min(start + TASK) {
            grid.near(&points[i].position, alike.reach, |_, j| {
                if j > i && alike.holds(&points[i], &points[j], step) {
                    found.push([i as u32, j as u32]);
                }
            });
        }
        found
    };
    let tasks = (0..points.len().div_ceil(TASK)).into_par_iter().map(|task| of(task * TASK));
    tasks.collect::<Vec<_>>().concat()
}

/// Pairs of points that are on one line or plane, of the same root if roots are given: not all, but as many as connect
/// what all of them connect.
fn spanning_pairs<const D: usize>(
    points: &[FeaturePoint<D>],
    roots: Option<&[u32]>,
    bounds: &Bounds<D>,
    alike: &Alike,
    step: f64,
) -> Vec<[u32; 2]> {
    let grid = PointGrid::new(bounds, alike.reach, points.iter().map(|point| point.position));
    let is_wanted = |i: u32, j: u32| roots.is_none_or(|of| of[i as usize] == of[j as usize]);
    let of = |block: &Block<'_, D>, pairs: &mut Vec<[u32; 2]>| {
        let is_flat = is_flat(block, points, step);
        let are_linked = |a: usize, b: usize| {
            let [(p, i), (q, j)] = [block.near[a], block.near[b]];
            let is_near = distance_squared(&p, &q) <= alike.reach * alike.reach;
            is_near
                && is_wanted(i, j)
                && (is_flat || alike.holds(&points[i as usize], &points[j as usize], step))
        };
        let (first, count) = (block.own.start, block.own.len());
        let mut parts = Sets::new(count);
        for a in 1..count {
            for b in 0..a {
                let [of_a, of_b] = [a, b].map(|i| parts.root(i as u32));
                if of_a != of_b && are_linked(first + a, first + b) {
                    parts.join(of_a, of_b);
                    pairs.push([block.near[first + b].1, block.near[first + a].1]);
                }
            }
        }
        let part_of = parts.roots();
        // with each point of another block one pair for each part: the pair's other block has those of higher numbers
        let mut last = vec![usize::MAX; count];
        for (other, &(_, number)) in block.near.iter().enumerate() {
            if block.own.contains(&other) {
                continue;
            }
            for a in 0..count {
                let (own, part) = (block.near[first + a].1, part_of[a] as usize);
                if own < number && last[part] != other && are_linked(first + a, other) {
                    last[part] = other;
                    pairs.push([own, number]);
                }
            }
        }
    };
    grid.visit_blocks(alike.reach, of).concat()
}

/// The points linked to each, and where those of each begin in the list.
pub(super) struct Around {
    starts: Vec<u32>,
    linked: Vec<u32>,
}

impl Around {
    /// Lists the pairs of `count` points by each of the two.
    pub(super) fn new(count: usize, pairs: &[[u32; 2]]) -> Self {
        let mut starts = vec![0; count + 1];
        pairs.iter().flatten().for_each(|&i| starts[i as usize + 1] += 1);
        (0..count).for_each(|i| starts[i + 1] += starts[i]);
        let (mut next, mut linked) = (starts.clone(), vec![0; 2 * pairs.len()]);
        for &[i, j] in pairs {
            for (of, other) in [(i, j), (j, i)] {
                let next = &mut next[of as usize];
                linked[*next as usize] = other;
                *next += 1;
            }
        }
        Self { starts, linked }
    }

    /// The points linked to one.
    pub(super) fn of(&self, i: u32) -> &[u32] {
        let i = i as usize;
        &self.linked[self.starts[i] as usize..self.starts[i + 1] as usize]
    }
}

/// How far two points may be apart and differ and still be of one piece.
#[derive(Clone, Copy, Debug)]
pub(super) struct Alike {
    /// Their greatest distance.
    pub reach: f64,
    /// The least cosine between their normals.
    pub cosine: f64,
    /// How far one may be off the other's plane, over their distance, and in addition to it, in mean steps.
    pub slope: f64,
    pub slack: f64,
}

impl Alike {
    /// Whether two points are on one line or plane.
    pub fn holds<const D: usize>(
        &self,
        a: &FeaturePoint<D>,
        b: &FeaturePoint<D>,
        step: f64,
    ) -> bool {
        let offset = difference(&b.position, &a.position);
        let squared = dot(&offset, &offset);
        if squared > self.reach * self.reach || dot(&a.normal, &b.normal).abs() < self.cosine {
            return false;
        }
        let height = dot(&offset, &a.normal).abs().max(dot(&offset, &b.normal).abs());
        height <= self.slope * squared.sqrt() + self.slack * step
    }
}

/// Turns the normals of linked points to the same side, from the first point of each piece on.
fn turn<const D: usize>(points: &mut [FeaturePoint<D>], links: &[[u32; 2]]) {
    let around = Around::new(points.len(), links);
    let mut is_turned = vec![false; points.len()];
    let mut next = VecDeque::new();
    for first in 0..points.len() {
        if is_turned[first] {
            continue;
        }
        is_turned[first] = true;
        next.push_back(first as u32);
        while let Some(i) = next.pop_front() {
            let normal = points[i as usize].normal;
            for &linked in around.of(i) {
                let j = linked as usize;
                if !is_turned[j] {
                    is_turned[j] = true;
                    if dot(&normal, &points[j].normal) < 0.0 {
                        points[j].normal = points[j].normal.map(|n| -n);
                    }
                    next.push_back(linked);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::near::tests::crossing_sheets;
    use super::*;

    fn spanning_pairs_connect_what_all_pairs_do<const D: usize>() {
        let alike = Alike { reach: 1.2 * (D as f64).sqrt(), cosine: 0.8, slope: 0.4, slack: 0.35 };
        for noise in [0.02, 0.15] {
            let (points, bounds) = crossing_sheets::<D>(noise, 9);
            let all = linked_pairs(&points, &bounds, &alike, 1.0);
            let roots: Vec<u32> = (0..points.len() as u32).map(|i| i % 2).collect();
            for roots in [None, Some(&roots[..])] {
                let wanted =
                    |[i, j]: &[u32; 2]| roots.is_none_or(|of| of[*i as usize] == of[*j as usize]);
                let some = spanning_pairs(&points, roots, &bounds, &alike, 1.0);
                let numbers = |pairs: &mut dyn Iterator<Item = [u32; 2]>| {
                    let mut sets = Sets::new(points.len());
                    pairs.for_each(|[i, j]| sets.join(i, j));
                    sets.numbers()
                };
                let expected = numbers(&mut all.iter().copied().filter(wanted));
                assert_eq!(numbers(&mut some.iter().copied()), expected);
                assert!(some.len() <= all.len() && some.iter().all(wanted));
            }
        }
    }

    #[test]
    fn fewer_pairs_connect_the_same_points() {
        spanning_pairs_connect_what_all_pairs_do::<2>();
        spanning_pairs_connect_what_all_pairs_do::<3>();
    }
}
