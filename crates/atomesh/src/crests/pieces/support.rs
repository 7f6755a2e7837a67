//! Which points lie on one feature alone: those most of whose neighbours lie on their planes.

use crate::parallel::prelude::*;

use super::super::FeaturePoint;
use super::Cleanness;
use super::grow::{EXPLAINED_ALONG, explains};
use super::near::{Columns, Counts, Within, is_flat};
use crate::geometry::{Block, Bounds, Point, PointGrid, distance_squared, dot};
use crate::image::Grid;

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
/// How many points are asked for the share of those on clean features.
const ASKED: usize = 20_000;
/// How many of them are asked whether others explain them, which takes longer.
const ASKED_FURTHER: usize = 2_000;
/// The fewest points on a point's plane, itself among them, in the plane; twice as many in space.
const LEAST_ON: u64 = 4;

/// How near points with other normals count, in mean steps, and their greatest share.
#[derive(Clone, Copy, Debug)]
struct Next {
    reach: f64,
    most: f64,
}

/// The points most of whose neighbours lie on their planes, and the others.
pub(super) fn supported<const D: usize>(
    points: Vec<FeaturePoint<D>>,
    bounds: &Bounds<D>,
    step: f64,
) -> (Vec<FeaturePoint<D>>, Vec<FeaturePoint<D>>) {
    let next = if D == 2 { NEXT } else { NEXT_IN_SPACE };
    let support = Support::new(&points, bounds, step, next);
    let is_kept = support.of_all();
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
        let all = points.len().div_ceil(stride);
        let numbers = (0..all).into_par_iter().with_min_len(1 << 6);
        let count = numbers.filter(|&i| is(i * stride)).count();
        count as f64 / all.max(1) as f64
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

    /// Whether most neighbours of each point lie on its plane.
    fn of_all(&self) -> Vec<bool> {
        self.near.map_blocks(SUPPORT * self.step, |block, found: &mut Vec<bool>| {
            if is_flat(block, self.points, self.step) {
                // all neighbours do
                found.extend(block.own().iter().map(|(place, _)| self.has_enough(block, place)));
                return;
            }
            let columns = Columns::of(block, self.points, |_| true);
            let is_on = |i: u32| self.is_on(&self.points[i as usize], &columns);
            found.extend(block.own().iter().map(|(_, i)| is_on(*i)));
        })
    }

    /// Whether most neighbours of a point lie on its plane.
    fn of(&self, i: usize) -> bool {
        let (point, mut near) = (&self.points[i], Vec::new());
        self.near.near(&point.position, SUPPORT * self.step, |position, j| {
            near.push((*position, j as u32));
        });
        let block = Block { own: 0..0, near: &near };
        self.is_on(point, &Columns::of(&block, self.points, |_| true))
    }

    /// Whether most of the points near a point, of which the columns are, lie on its plane.
    fn is_on(&self, point: &FeaturePoint<D>, near: &Columns<D>) -> bool {
        let within = Within {
            reach: SUPPORT * self.step,
            next: self.next.reach * self.step,
            alike: ALIKE,
            slope: 0.12,
            slack: 0.3 * self.step,
        };
        let Counts { next, others, all, on } = near.counts(point, &within);
        on >= LEAST_ON * (D - 1) as u64
            && others as f64 <= self.next.most * next as f64
            && on as f64 >= LEAST_SUPPORT * all as f64
    }

    /// Whether there are as many points near a place as must lie on its plane.
    fn has_enough(&self, block: &Block<'_, D>, place: &Point<D>) -> bool {
        let (reach, least) = (SUPPORT * self.step, LEAST_ON as usize * (D - 1));
        let is_near =
            |(other, _): &&(Point<D>, u32)| distance_squared(other, place) <= reach * reach;
        block.near.iter().filter(is_near).nth(least - 1).is_some()
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

#[cfg(test)]
mod tests {
    use super::super::near::tests::crossing_sheets;
    use super::*;
    use crate::geometry::difference;

    /// The definition, point by point.
    fn is_supported<const D: usize>(points: &[FeaturePoint<D>], i: usize, next: Next) -> bool {
        let own = &points[i];
        let (mut on, mut all, mut others, mut beside) = (0, 0, 0, 0);
        for point in points {
            let offset = difference(&point.position, &own.position);
            let length = dot(&offset, &offset).sqrt();
            if length > SUPPORT {
                continue;
            }
            let is_alike = dot(&point.normal, &own.normal).abs() >= ALIKE;
            if length <= next.reach {
                beside += 1;
                others += usize::from(!is_alike);
            }
            if is_alike {
                all += 1;
                on += usize::from(dot(&offset, &own.normal).abs() <= 0.12 * length + 0.3);
            }
        }
        on >= LEAST_ON as usize * (D - 1)
            && others as f64 <= next.most * f64::from(beside)
            && f64::from(on as u32) >= LEAST_SUPPORT * f64::from(all)
    }

    fn support_is_as_defined<const D: usize>(next: Next) {
        for noise in [0.0, 0.03, 0.15] {
            let (points, bounds) = crossing_sheets::<D>(noise, 3);
            let support = Support::new(&points, &bounds, 1.0, next);
            let found = support.of_all();
            assert!(found.contains(&true) && found.contains(&false));
            for (i, found) in found.into_iter().enumerate() {
                assert_eq!(found, is_supported(&points, i, next), "{noise}: {i}");
                assert!(i % 7 > 0 || support.of(i) == found, "{noise}: {i}");
            }
        }
    }

    #[test]
    fn support_of_all_points_is_that_of_each() {
        support_is_as_defined::<2>(NEXT);
        support_is_as_defined::<3>(NEXT_IN_SPACE);
    }
}
