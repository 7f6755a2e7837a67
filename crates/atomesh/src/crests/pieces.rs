//! Pieces of features as geometry: where the nearest place on a piece is, and on which side of it a place lies.
//!
//! Points are linked into pieces by place and by normal, so that features that cross stay two: points whose
//! neighbours do not lie on their own plane, as where features cross, belong to none, and what is straight across
//! them is joined. The normals of a piece are turned to agree.
//!
//! Between its points a piece is what a moving least squares fit of second degree says (Alexa and others 2001): it
//! averages the noise of single points, and follows curvature.

use std::collections::VecDeque;

use rayon::prelude::*;

use super::{Bins, FeaturePoint};
use crate::geometry::linear::solve;
use crate::geometry::{Bounds, Point, Sets, difference, distance_squared, dot};
use crate::image::Grid;

/// How far linked points may be apart, over the diagonal of a sample's cell.
const LINK: f64 = 1.2;
/// Within how many mean steps points tell whether a point lies on one feature alone.
const SUPPORT: f64 = 4.0;
/// The least share of the points near a point that lie on its plane.
const LEAST_SUPPORT: f64 = 0.7;
/// How far pieces on one line or plane may be apart and still be joined, in mean steps.
const BRIDGE: f64 = 8.0;
/// The deviation of the weights of a fit, and the radius of its points, in mean steps.
const FIT_WIDTH: f64 = 1.3;
const FIT_REACH: f64 = 3.25;
/// How often a foot is improved.
const FOOT_ROUNDS: usize = 3;
/// How far from the nearest point of a piece a place may be along the piece and still be on it, in mean steps.
const END: f64 = 1.2;

/// Pieces of features, in lattice coordinates.
#[derive(Clone, Debug)]
pub struct Pieces<const D: usize> {
    points: Vec<FeaturePoint<D>>,
    /// The piece of each point.
    of_points: Vec<u32>,
    /// The mean strength of each piece.
    strengths: Vec<f64>,
    bins: Bins<D>,
    /// The mean step of the image.
    step: f64,
}

/// The nearest place on a piece.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Foot<const D: usize> {
    /// The place.
    pub position: Point<D>,
    /// The piece's unit normal there; the same side all over the piece.
    pub normal: Point<D>,
    /// The piece.
    pub piece: u32,
    /// How far beyond the end of the piece the place is, along the piece; 0 if it is not.
    pub beyond: f64,
}

impl<const D: usize> Foot<D> {
    /// How far `p` is from the piece, above 0 on the side of the normal.
    pub fn signed_distance(&self, p: &Point<D>) -> f64 {
        dot(&difference(p, &self.position), &self.normal)
    }
}

impl<const D: usize> Pieces<D> {
    /// Links points, in lattice coordinates, of an image with this grid; pieces of fewer than `least_count` points
    /// are left out. The strongest piece is the first.
    pub fn new(points: Vec<FeaturePoint<D>>, grid: &Grid<D>, least_count: usize) -> Self {
        let step = grid.step.iter().sum::<f64>() / D as f64;
        let bounds = grid.bounds();
        let mut points = supported(points, &bounds, step);
        points.sort_by(|a, b| a.index.cmp(&b.index));
        let diagonal = LINK * dot(&grid.step, &grid.step).sqrt();
        let bins = Bins::of(&bounds, step, points.iter().map(|point| point.position));
        let mut sets = Sets::new(points.len());
        let near = |i: usize, reach: f64, is_one: &dyn Fn(usize) -> bool| -> Vec<u32> {
            let mut found = Vec::new();
            bins.near(&points[i].position, reach, |j| {
                if j > i && is_one(j) {
                    found.push(j as u32);
                }
            });
            found
        };
        let links: Vec<Vec<u32>> = (0..points.len())
            .into_par_iter()
            .with_min_len(1 << 8)
            .map(|i| near(i, diagonal, &|j| are_linked(&points[i], &points[j], diagonal, step)))
            .collect();
        links.iter().enumerate().for_each(|(i, all)| {
            all.iter().for_each(|&j| sets.join(i as u32, j));
        });
        let roots = sets.roots();
        let reach = BRIDGE * step;
        let bridges: Vec<Vec<u32>> = (0..points.len())
            .into_par_iter()
            .with_min_len(1 << 8)
            .map(|i| {
                near(i, reach, &|j| {
                    roots[i] != roots[j] && are_in_line(&points[i], &points[j], reach, step)
                })
            })
            .collect();
        bridges.iter().enumerate().for_each(|(i, all)| {
            all.iter().for_each(|&j| sets.join(i as u32, j));
        });
        turn(&mut points, &links, &bridges);
        Self::of_sets(points, &mut sets, &bounds, step, least_count)
    }

    fn of_sets(
        points: Vec<FeaturePoint<D>>,
        sets: &mut Sets,
        bounds: &Bounds<D>,
        step: f64,
        least_count: usize,
    ) -> Self {
        let roots = sets.roots();
        let mut sums = vec![(0usize, 0.0); points.len()];
        for (point, &root) in points.iter().zip(&roots) {
            let sum = &mut sums[root as usize];
            *sum = (sum.0 + 1, sum.1 + point.strength);
        }
        let mut order: Vec<u32> = (0..points.len() as u32)
            .filter(|&i| sums[i as usize].0 >= least_count.max(1))
            .collect();
        order.sort_by(|&a, &b| {
            let of = |i: u32| sums[i as usize].1;
            of(b).total_cmp(&of(a)).then(a.cmp(&b))
        });
        let mut number = vec![u32::MAX; points.len()];
        order.iter().zip(0..).for_each(|(&root, n)| number[root as usize] = n);
        let strengths = order.iter().map(|&i| sums[i as usize].1 / sums[i as usize].0 as f64);
        let strengths = strengths.collect();
        let (points, of_points): (Vec<_>, Vec<_>) = (points.into_iter().zip(&roots))
            .map(|(point, &root)| (point, number[root as usize]))
            .filter(|(_, piece)| *piece != u32::MAX)
            .unzip();
        let bins = Bins::of(bounds, step, points.iter().map(|point| point.position));
        Self { points, of_points, strengths, bins, step }
    }

    /// How many pieces there are.
    pub fn len(&self) -> usize {
        self.strengths.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.strengths.is_empty()
    }

    /// The mean strength of a piece.
    pub fn strength(&self, piece: u32) -> f64 {
        self.strengths[piece as usize]
    }

    /// The mean step of the image.
    pub fn step(&self) -> f64 {
        self.step
    }

    /// All points, in the order of their samples, with the piece of each.
    pub fn points(&self) -> impl ExactSizeIterator<Item = (&FeaturePoint<D>, u32)> {
        self.points.iter().zip(self.of_points.iter().copied())
    }

    /// The foot of `p` on the piece nearest to it, if one is within `reach`.
    pub fn foot(&self, p: &Point<D>, reach: f64) -> Option<Foot<D>> {
        let nearest = self.nearest(p, reach, |_| true)?;
        self.foot_from(nearest, p)
    }

    /// The foot of `p` on a piece, if that has a point within `reach`.
    pub fn foot_on(&self, piece: u32, p: &Point<D>, reach: f64) -> Option<Foot<D>> {
        let nearest = self.nearest(p, reach, |other| other == piece)?;
        self.foot_from(nearest, p)
    }

    /// The pieces that have a point within `reach` of `p`, in order.
    pub fn near(&self, p: &Point<D>, reach: f64) -> Vec<u32> {
        let mut found: Vec<u32> = Vec::new();
        self.bins.near(p, reach, |i| {
            let is_near = distance_squared(&self.points[i].position, p) <= reach * reach;
            if is_near && !found.contains(&self.of_points[i]) {
                found.push(self.of_points[i]);
            }
        });
        found.sort_unstable();
        found
    }

    fn nearest(&self, p: &Point<D>, reach: f64, wanted: impl Fn(u32) -> bool) -> Option<usize> {
        // near features the nearest point is within a few steps
        let mut within = (3.0 * self.step).min(reach);
        loop {
            let mut best = (within * within, None);
            self.bins.near(p, within, |i| {
                let found = (distance_squared(&self.points[i].position, p), Some(i));
                if wanted(self.of_points[i]) && found <= best {
                    best = found;
                }
            });
            if best.1.is_some() || within >= reach {
                return best.1;
            }
            within = (3.0 * within).min(reach);
        }
    }

    /// The foot of `p` near a point of a piece.
    fn foot_from(&self, nearest: usize, p: &Point<D>) -> Option<Foot<D>> {
        let point = &self.points[nearest];
        let piece = self.of_points[nearest];
        let (mut position, mut normal) = (point.position, point.normal);
        let mut beyond = 0.0;
        for _ in 0..FOOT_ROUNDS {
            let height = dot(&difference(p, &position), &normal);
            let x: Point<D> = std::array::from_fn(|k| p[k] - height * normal[k]);
            let along = distance_squared(&x, &point.position).sqrt();
            beyond = (self.gap(piece, &x, along) - END * self.step).max(0.0);
            if beyond > 0.0 {
                // the plane at the end goes on
                position = x;
                break;
            }
            (position, normal) = self.fit(piece, &x, &normal)?;
        }
        Some(Foot { position, normal, piece, beyond })
    }

    /// How far `x` is from the nearest point of a piece; at most `known`.
    fn gap(&self, piece: u32, x: &Point<D>, known: f64) -> f64 {
        if known <= END * self.step {
            return known;
        }
        let found = self.nearest(x, known.min(BRIDGE * self.step), |other| other == piece);
        found.map_or(known, |i| distance_squared(&self.points[i].position, x).sqrt())
    }

    /// The piece near `x`: the place straight above or below it, and the normal there.
    fn fit(&self, piece: u32, x: &Point<D>, normal: &Point<D>) -> Option<(Point<D>, Point<D>)> {
        let reach = FIT_REACH * self.step;
        let inverse = 1.0 / (FIT_WIDTH * self.step).powi(2);
        let axes = tangents(normal);
        let size = D * (D + 1) / 2;
        let mut matrix = [[0.0; 6]; 6];
        let mut right = [[0.0; 1]; 6];
        let mut count = 0;
        self.bins.near(x, reach, |i| {
            let point = &self.points[i];
            if self.of_points[i] != piece || dot(&point.normal, normal) < 0.3 {
                return;
            }
            let offset = difference(&point.position, x);
            let squared = dot(&offset, &offset);
            if squared > reach * reach {
                return;
            }
            count += 1;
            let weight = (-0.5 * squared * inverse).exp();
            let terms = terms::<D>(&offset, &axes, self.step);
            let height = dot(&offset, normal);
            for r in 0..size {
                for c in 0..size {
                    matrix[r][c] += weight * terms[r] * terms[c];
                }
                right[r][0] += weight * terms[r] * height;
            }
        });
        let size = match count {
            0 => return None,
            n if n >= 2 * size => size,
            n if n > D => D,
            _ => 1,
        };
        let largest = matrix[0][0];
        (0..size).for_each(|k| matrix[k][k] += 1e-6 * largest);
        if solve(size, matrix, &mut right) == 0.0 {
            return None;
        }
        let place = std::array::from_fn(|k| x[k] + right[0][0] * normal[k]);
        let mut turned = *normal;
        if size >= D {
            for (axis, slope) in axes.iter().take(D - 1).zip(&right[1..]) {
                (0..D).for_each(|k| turned[k] -= slope[0] / self.step * axis[k]);
            }
        }
        let length = dot(&turned, &turned).sqrt();
        Some((place, turned.map(|n| n / length)))
    }
}

/// 1, the coordinates along the axes, and their products, in mean steps.
fn terms<const D: usize>(offset: &Point<D>, axes: &[Point<D>; 2], step: f64) -> [f64; 6] {
    let u = dot(offset, &axes[0]) / step;
    if D == 2 {
        return [1.0, u, u * u, 0.0, 0.0, 0.0];
    }
    let v = dot(offset, &axes[1]) / step;
    [1.0, u, v, u * u, u * v, v * v]
}

/// Unit vectors along a line or plane; in the plane only the first counts.
pub(crate) fn tangents<const D: usize>(normal: &Point<D>) -> [Point<D>; 2] {
    let mut first = [0.0; D];
    if D == 2 {
        (first[0], first[1]) = (-normal[1], normal[0]);
        return [first, [0.0; D]];
    }
    let least = (0..D).min_by(|&a, &b| normal[a].abs().total_cmp(&normal[b].abs())).unwrap_or(0);
    first[least] = 1.0;
    let along = normal[least];
    (0..D).for_each(|k| first[k] -= along * normal[k]);
    let length = dot(&first, &first).sqrt();
    first = first.map(|x| x / length);
    let second = std::array::from_fn(|k| {
        let (a, b) = ((k + 1) % D, (k + 2) % D);
        normal[a] * first[b] - normal[b] * first[a]
    });
    [first, second]
}

/// The points most of whose neighbours lie on their planes.
fn supported<const D: usize>(
    points: Vec<FeaturePoint<D>>,
    bounds: &Bounds<D>,
    step: f64,
) -> Vec<FeaturePoint<D>> {
    let bins = Bins::of(bounds, step, points.iter().map(|point| point.position));
    let reach = SUPPORT * step;
    let is_supported = |point: &FeaturePoint<D>| {
        let (mut on, mut all) = (0usize, 0usize);
        bins.near(&point.position, reach, |j| {
            let offset = difference(&points[j].position, &point.position);
            let squared = dot(&offset, &offset);
            if squared > reach * reach {
                return;
            }
            all += 1;
            let height = dot(&offset, &point.normal).abs();
            let is_on = height <= 0.25 * squared.sqrt() + 0.35 * step;
            on += usize::from(is_on && dot(&points[j].normal, &point.normal).abs() > 0.85);
        });
        on as f64 >= LEAST_SUPPORT * all as f64
    };
    let is_kept: Vec<bool> = points.par_iter().with_min_len(1 << 8).map(is_supported).collect();
    let kept = points.into_iter().zip(is_kept);
    kept.filter(|(_, is_kept)| *is_kept).map(|(point, _)| point).collect()
}

/// Whether neighbouring points are of one piece.
fn are_linked<const D: usize>(
    a: &FeaturePoint<D>,
    b: &FeaturePoint<D>,
    reach: f64,
    step: f64,
) -> bool {
    let offset = difference(&b.position, &a.position);
    let squared = dot(&offset, &offset);
    if squared > reach * reach || dot(&a.normal, &b.normal).abs() < 0.8 {
        return false;
    }
    let height = dot(&offset, &a.normal).abs().max(dot(&offset, &b.normal).abs());
    height <= 0.4 * squared.sqrt() + 0.35 * step
}

/// Whether points of two pieces lie on one line or plane.
fn are_in_line<const D: usize>(
    a: &FeaturePoint<D>,
    b: &FeaturePoint<D>,
    reach: f64,
    step: f64,
) -> bool {
    let offset = difference(&b.position, &a.position);
    let squared = dot(&offset, &offset);
    if squared > reach * reach || dot(&a.normal, &b.normal).abs() < 0.96 {
        return false;
    }
    let height = dot(&offset, &a.normal).abs().max(dot(&offset, &b.normal).abs());
    height <= 0.1 * squared.sqrt() + 0.35 * step
}

/// Turns the normals of linked points to the same side, from the first point of each piece on.
fn turn<const D: usize>(points: &mut [FeaturePoint<D>], links: &[Vec<u32>], bridges: &[Vec<u32>]) {
    let mut around = vec![Vec::new(); points.len()];
    for (i, all) in links.iter().enumerate().chain(bridges.iter().enumerate()) {
        for &j in all {
            around[i].push(j);
            around[j as usize].push(i as u32);
        }
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
