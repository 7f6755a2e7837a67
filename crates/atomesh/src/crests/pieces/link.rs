//! Linking points to pieces: who lies on whose plane.

use std::collections::VecDeque;

use rayon::prelude::*;

use super::super::{FeaturePoint, PointGrid};
use super::meet::{bridges, fill};
use crate::geometry::{Bounds, Point, Sets, difference, dot};
use crate::image::Grid;

/// How far linked points may be apart, over the diagonal of a sample's cell.
const LINK: f64 = 1.2;
/// Within how many mean steps points tell whether a point lies on one feature alone.
pub(super) const SUPPORT: f64 = 4.0;
/// The least share of the points near a point that lie on its plane.
const LEAST_SUPPORT: f64 = 0.7;
/// Points of one feature near each other have normals with at least this cosine, 21°.
const ALIKE: f64 = 0.93;
/// Points with other normals within this, in mean steps, are of a feature that meets the point's own.
const NEXT: f64 = 2.0;
/// The greatest share of them.
const MOST_OTHERS: f64 = 0.12;
/// The fewest points on a point's plane, itself among them, in the plane; twice as many in space.
const LEAST_ON: usize = 4;

/// The points of pieces, their normals turned to agree, with some more where pieces were joined; and the sets that
/// make a piece each.
pub(super) fn linked_pieces<const D: usize>(
    points: Vec<FeaturePoint<D>>,
    grid: &Grid<D>,
    step: f64,
) -> (Vec<FeaturePoint<D>>, Sets) {
    let bounds = grid.bounds();
    let (mut points, meetings) = supported(points, &bounds, step);
    points.sort_by_key(|point| point.index);
    let mut sets = Sets::new(points.len());
    let links = links(&points, &bounds, LINK * dot(&grid.step, &grid.step).sqrt(), step);
    for (i, all) in links.iter().enumerate() {
        all.iter().for_each(|&j| sets.join(i as u32, j));
    }
    let roots = sets.roots();
    let bridges = bridges(&points, &roots, &meetings, &bounds, step);
    bridges.iter().for_each(|&[i, j]| sets.join(i, j));
    turn(&mut points, &links, &bridges);
    fill(&mut points, &mut sets, &bridges, &bounds, step);
    (points, sets)
}

/// For each point the later ones that it is linked to.
fn links<const D: usize>(
    points: &[FeaturePoint<D>],
    bounds: &Bounds<D>,
    reach: f64,
    step: f64,
) -> Vec<Vec<u32>> {
    let grid = PointGrid::new(bounds, 1.5 * step, points.iter().map(|point| point.position));
    let alike = Alike { reach, cosine: 0.8, slope: 0.4, slack: 0.35 };
    let of = |i: usize| {
        let mut found = Vec::new();
        grid.near(&points[i].position, reach, |_, j| {
            if j > i && alike.holds(&points[i], &points[j], step) {
                found.push(j as u32);
            }
        });
        found
    };
    (0..points.len()).into_par_iter().with_min_len(1 << 8).map(of).collect()
}

/// The points most of whose neighbours lie on their planes, and the places of the others.
fn supported<const D: usize>(
    points: Vec<FeaturePoint<D>>,
    bounds: &Bounds<D>,
    step: f64,
) -> (Vec<FeaturePoint<D>>, Vec<Point<D>>) {
    let bins = PointGrid::new(bounds, 1.5 * step, points.iter().map(|point| point.position));
    let reach = SUPPORT * step;
    let is_supported = |point: &FeaturePoint<D>| {
        let (mut on, mut all, mut others, mut next) = (0usize, 0usize, 0usize, 0usize);
        bins.near(&point.position, reach, |_, j| {
            let offset = difference(&points[j].position, &point.position);
            let squared = dot(&offset, &offset);
            if squared > reach * reach {
                return;
            }
            let is_next = squared <= (NEXT * step).powi(2);
            next += usize::from(is_next);
            if dot(&points[j].normal, &point.normal).abs() < ALIKE {
                // of another feature, or around a bend
                others += usize::from(is_next);
                return;
            }
            all += 1;
            let height = dot(&offset, &point.normal).abs();
            on += usize::from(height <= 0.12 * squared.sqrt() + 0.3 * step);
        });
        on >= LEAST_ON * (D - 1)
            && others as f64 <= MOST_OTHERS * next as f64
            && on as f64 >= LEAST_SUPPORT * all as f64
    };
    let is_kept: Vec<bool> = points.par_iter().with_min_len(1 << 8).map(is_supported).collect();
    let (mut kept, mut others) = (Vec::new(), Vec::new());
    for (point, is_kept) in points.into_iter().zip(is_kept) {
        if is_kept {
            kept.push(point);
        } else {
            others.push(point.position);
        }
    }
    (kept, others)
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
fn turn<const D: usize>(points: &mut [FeaturePoint<D>], links: &[Vec<u32>], bridges: &[[u32; 2]]) {
    let mut around = vec![Vec::new(); points.len()];
    let links = links.iter().enumerate();
    let links = links.flat_map(|(i, all)| all.iter().map(move |&j| [i as u32, j]));
    for [i, j] in links.chain(bridges.iter().copied()) {
        around[i as usize].push(j);
        around[j as usize].push(i);
    }
    let mut is_turned = vec![false; points.len()];
    let mut next = VecDeque::new();
    for first in 0..points.len() {
        if is_turned[first] {
            continue;
        }
        is_turned[first] = true;
        next.push_back(first);
        while let Some(i) = next.pop_front() {
            let normal = points[i].normal;
            for &j in &around[i] {
                let j = j as usize;
                if !is_turned[j] {
                    is_turned[j] = true;
                    if dot(&normal, &points[j].normal) < 0.0 {
                        points[j].normal = points[j].normal.map(|n| -n);
                    }
                    next.push_back(j);
                }
            }
        }
    }
}
