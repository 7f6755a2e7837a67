//! Linking points to pieces: who lies on whose plane.

use std::collections::VecDeque;

use rayon::prelude::*;

use super::super::FeaturePoint;
use super::Cleanness;
use super::grow::{EXPLAINED_ALONG, add_rest, explains, layered};
use super::meet::join_across;
use crate::geometry::{Bounds, Point, PointGrid, Sets, difference, dot};
use crate::image::Grid;

/// How far linked points may be apart, over the diagonal of a sample's cell.
const LINK: f64 = 1.2;
/// Within how many mean steps points tell whether a point lies on one feature alone.
pub(super) const SUPPORT: f64 = 4.0;
/// The least share of the points near a point that lie on its plane.
const LEAST_SUPPORT: f64 = 0.7;
/// Points of one feature near each other have normals with at least this cosine, 21°.
const ALIKE: f64 = 0.93;
/// Points with other normals near a point are of a feature that meets the point's own.
const NEXT: Next = Next { reach: 2.0, most: 0.12 };
/// The same in space, where sheets cross along lines, and their valleys pass over into each other somewhere along these.
const NEXT_IN_SPACE: Next = Next { reach: 2.5, most: 0.12 };
/// In space points this near to a side of the image, in mean steps, say nothing: samples mirrored there turn their normals,
/// and sheets at a slant pass over into each other. Pieces are led on to sides.
const AT_SIDE: f64 = 1.0;
/// How many points are asked for the share of those on clean features.
const ASKED: usize = 20_000;
/// How many of them are asked whether others explain them, which takes longer.
const ASKED_FURTHER: usize = 2_000;
/// Sets of fewer points, in space of fewer than the square, are linked anew with what is left.
const SMALL: usize = 12;
/// Sets of which so many points stand beside others, in the plane and in space, fork, and are linked again as small ones are.
const LAYERED: [usize; 2] = [5, 150];
/// What goes on across a place where features meet, and what over a gap. Reaches are set where they are used.
const ACROSS: Alike = Alike { reach: 0.0, cosine: 0.96, slope: 0.08, slack: 0.4 };
const OVER_GAPS: Alike = Alike { reach: 0.0, cosine: 0.95, slope: 0.12, slack: 0.4 };
/// Points whose links one task finds.
const TASK: usize = 1 << 12;
/// The fewest points on a point's plane, itself among them, in the plane; twice as many in space.
const LEAST_ON: usize = 4;

/// How near points with other normals count, in mean steps, and their greatest share.
#[derive(Clone, Copy, Debug)]
struct Next {
    reach: f64,
    most: f64,
}

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
    let links = linked_pairs(&points, &bounds, &alike, step);
    links.iter().for_each(|&[i, j]| sets.join(i, j));
    let meetings: Vec<Point<D>> = others.iter().map(|point| point.position).collect();
    join_across(&mut points, &mut sets, &meetings, &ACROSS, &bounds, step);
    others.extend(take_unclear(&mut points, &mut sets, &bounds, step));
    others.sort_by_key(|point| point.index);
    add_rest(&mut points, &mut sets, &others, &bounds, reach, step);
    join_across(&mut points, &mut sets, &[], &OVER_GAPS, &bounds, step);
    let roots = sets.roots();
    let mut links = linked_pairs(&points, &bounds, &alike, step);
    links.retain(|pair| roots[pair[0] as usize] == roots[pair[1] as usize]);
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

/// The points most of whose neighbours lie on their planes, and the others.
fn supported<const D: usize>(
    points: Vec<FeaturePoint<D>>,
    bounds: &Bounds<D>,
    step: f64,
) -> (Vec<FeaturePoint<D>>, Vec<FeaturePoint<D>>) {
    let next = if D == 2 { NEXT } else { NEXT_IN_SPACE };
    let support = Support::new(&points, bounds, step, next);
    let all = (0..points.len()).into_par_iter().with_min_len(1 << 8);
    let is_kept: Vec<bool> = all.map(|i| support.of(i)).collect();
    let (mut kept, mut others) = (Vec::new(), Vec::new());
    for (point, is_kept) in points.into_iter().zip(is_kept) {
        if is_kept {
            kept.push(point);
        } else {
            others.push(point);
        }
    }
    (kept, others)
}

/// How clean features are; of many points some are asked.
pub(super) fn cleanness<const D: usize>(points: &[FeaturePoint<D>], grid: &Grid<D>) -> Cleanness {
    let step = grid.step.iter().sum::<f64>() / D as f64;
    let support = Support::new(points, &grid.bounds(), step, NEXT);
    let share = |asked: usize, is: &(dyn Fn(usize) -> bool + Sync)| {
        let stride = (points.len() / asked).max(1);
        let all = (0..points.len().div_ceil(stride)).into_par_iter().with_min_len(1 << 6);
        let count = all.clone().filter(|&i| is(i * stride)).count();
        count as f64 / all.len().max(1) as f64
    };
    let clean = share(ASKED, &|i| support.of(i));
    let unexplained = share(ASKED_FURTHER, &|i| !support.of(i) && !support.is_explained(i));
    Cleanness { clean, unexplained }
}

/// Whether points lie on one feature alone.
struct Support<'a, const D: usize> {
    points: &'a [FeaturePoint<D>],
    near: PointGrid<D>,
    step: f64,
    next: Next,
}

impl<'a, const D: usize> Support<'a, D> {
    fn new(points: &'a [FeaturePoint<D>], bounds: &Bounds<D>, step: f64, next: Next) -> Self {
        let positions = points.iter().map(|point| point.position);
        Self { points, near: PointGrid::new(bounds, SUPPORT * step, positions), step, next }
    }

    /// Whether most neighbours of a point lie on its plane.
    fn of(&self, i: usize) -> bool {
        let (point, reach) = (&self.points[i], SUPPORT * self.step);
        let (mut on, mut all, mut others, mut next) = (0usize, 0usize, 0usize, 0usize);
        self.near.near(&point.position, reach, |position, j| {
            let offset = difference(position, &point.position);
            let squared = dot(&offset, &offset);
            if squared > reach * reach {
                return;
            }
            let is_next = squared <= (self.next.reach * self.step).powi(2);
            next += usize::from(is_next);
            if dot(&self.points[j].normal, &point.normal).abs() < ALIKE {
                // of another feature, or around a bend
                others += usize::from(is_next);
                return;
            }
            all += 1;
            let height = dot(&offset, &point.normal).abs();
            on += usize::from(height <= 0.12 * squared.sqrt() + 0.3 * self.step);
        });
        on >= LEAST_ON * (D - 1)
            && others as f64 <= self.next.most * next as f64
            && on as f64 >= LEAST_SUPPORT * all as f64
    }

    /// Whether points that have support explain this one; in the plane, points of one line: where many cross there is no
    /// room for rows of atoms on each, while sheets cross along lines, which are fewer.
    fn is_explained(&self, i: usize) -> bool {
        let (mut by, mut is_one) = (None, true);
        let point = &self.points[i];
        self.near.near(&point.position, EXPLAINED_ALONG * self.step, |_, j| {
            let own = &self.points[j];
            if i == j || D > 2 && by.is_some() || !explains(own, point, self.step) || !self.of(j) {
                return;
            }
            let first = by.get_or_insert(own.normal);
            is_one &= dot(first, &own.normal).abs() >= ALIKE;
        });
        by.is_some() && is_one
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
