//! Points near each other, looked at together: as columns of numbers, for loops without branches; and whether they lie on
//! one plane, so that most questions about them have one answer.

use super::super::FeaturePoint;
use crate::geometry::{Block, Point, dot};

/// The normals of the points of a flat block differ from their mean by at most 0.1: the cosine of the angle.
const OWN_ALIKE: f64 = 0.995;
/// The cosine of half of the angle by which normals may differ of points of one feature near each other.
const ALL_ALIKE: f64 = 0.983;
/// The greatest thickness of a layer in which all points near a flat block are, in mean steps.
const THICKNESS: f64 = 0.299;

/// Whether the points of a block and all near it lie on one plane: any two of their normals have a cosine of 0.93 or more,
/// and seen from a point of the block none is above the plane by more than 0.3 steps and a tenth of its distance.
pub(super) fn is_flat<const D: usize>(
    block: &Block<'_, D>,
    points: &[FeaturePoint<D>],
    step: f64,
) -> bool {
    let normals = |of: usize| points[block.near[of].1 as usize].normal;
    let first = normals(block.own.start);
    let mut sum = [0.0; D];
    for i in block.own.clone() {
        let normal = normals(i);
        let sign = dot(&normal, &first).signum();
        (0..D).for_each(|k| sum[k] += sign * normal[k]);
    }
    let length = dot(&sum, &sum).sqrt();
    let mean = sum.map(|x| x / length);
    if !block.own.clone().all(|i| dot(&normals(i), &mean).abs() >= OWN_ALIKE) {
        return false;
    }
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for (i, (position, _)) in block.near.iter().enumerate() {
        let height = dot(position, &mean);
        (low, high) = (low.min(height), high.max(height));
        if high - low > THICKNESS * step || dot(&normals(i), &mean).abs() < ALL_ALIKE {
            return false;
        }
    }
    true
}

/// Places and normals of points, axis by axis.
#[derive(Clone, Debug)]
pub(super) struct Columns<const D: usize> {
    positions: [Vec<f64>; D],
    normals: [Vec<f64>; D],
}

impl<const D: usize> Columns<D> {
    /// The points near a block that are wanted.
    pub fn of(
        block: &Block<'_, D>,
        points: &[FeaturePoint<D>],
        wanted: impl Fn(u32) -> bool,
    ) -> Self {
        let empty = || std::array::from_fn(|_| Vec::with_capacity(block.near.len()));
        let mut columns = Self { positions: empty(), normals: empty() };
        for (position, number) in block.near.iter().filter(|(_, number)| wanted(*number)) {
            let normal = &points[*number as usize].normal;
            for k in 0..D {
                columns.positions[k].push(position[k]);
                columns.normals[k].push(normal[k]);
            }
        }
        columns
    }

    /// How many of the points within `reach` of a point are what; see [`Counts`].
    pub fn counts(&self, point: &FeaturePoint<D>, within: &Within) -> Counts {
        let count = self.positions[0].len();
        let positions = self.positions.each_ref().map(|column| &column[..count]);
        let normals = self.normals.each_ref().map(|column| &column[..count]);
        let (reach, next) = (within.reach * within.reach, within.next * within.next);
        let mut counts = Counts::default();
        for j in 0..count {
            let (mut squared, mut height, mut cosine) = (0.0, 0.0, 0.0);
            for k in 0..D {
                let offset = positions[k][j] - point.position[k];
                squared += offset * offset;
                height += offset * point.normal[k];
                cosine += normals[k][j] * point.normal[k];
            }
            // all of it without a branch, several points at a time
            let is_within = squared <= reach;
            let is_next = is_within & (squared <= next);
            let is_alike = cosine.abs() >= within.alike;
            let is_on = height.abs() <= within.slope * squared.sqrt() + within.slack;
            counts.next += u64::from(is_next);
            counts.others += u64::from(is_next & !is_alike);
            counts.all += u64::from(is_within & is_alike);
            counts.on += u64::from(is_within & is_alike & is_on);
        }
        counts
    }

    /// The sum of the ways from a place to the points within `reach` of it, and how many these are.
    pub fn ways(&self, place: &Point<D>, reach: f64) -> (Point<D>, f64) {
        let count = self.positions[0].len();
        let (mut sums, mut counts) = ([[0.0; LANES]; D], [0.0; LANES]);
        let mut add = |lane: usize, at: usize| {
            let offset: Point<D> = std::array::from_fn(|k| self.positions[k][at] - place[k]);
            let share = if dot(&offset, &offset) <= reach * reach { 1.0 } else { 0.0 };
            (0..D).for_each(|k| sums[k][lane] += share * offset[k]);
            counts[lane] += share;
        };
        let whole = count - count % LANES;
        for start in (0..whole).step_by(LANES) {
            (0..LANES).for_each(|lane| add(lane, start + lane));
        }
        (whole..count).for_each(|at| add(at - whole, at));
        (sums.map(|lanes| lanes.iter().sum()), counts.iter().sum())
    }
}

/// Sums that are added to side by side, so that none waits for another.
const LANES: usize = 4;

/// Which points near a point count.
#[derive(Clone, Copy, Debug)]
pub(super) struct Within {
    /// How far points may be.
    pub reach: f64,
    /// How far points may be that are next to it.
    pub next: f64,
    /// The least cosine between normals that are alike.
    pub alike: f64,
    /// How far points on the point's plane may be off it, over their distance, and in addition to it.
    pub slope: f64,
    pub slack: f64,
}

/// How many points near a point are what.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Counts {
    /// Next to it.
    pub next: u64,
    /// Of these, with another normal.
    pub others: u64,
    /// Within reach, with a like normal.
    pub all: u64,
    /// Of these, on the point's plane.
    pub on: u64,
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::geometry::{Bounds, PointGrid, difference};
    use rand::{RngExt, SeedableRng};

    /// Points a sample apart on two sheets (lines) that cross, some off them, and a few at random: some blocks are flat.
    pub fn crossing_sheets<const D: usize>(
        noise: f64,
        seed: u64,
    ) -> (Vec<FeaturePoint<D>>, Bounds<D>) {
        let mut random = rand_pcg::Pcg64::seed_from_u64(seed);
        let size = if D == 2 { 120.0 } else { 40.0 };
        let bounds = Bounds { min: [0.0; D], max: [size; D] };
        let mut between = |low: f64, high: f64| low + (high - low) * random.random::<f64>();
        let mut points = Vec::new();
        for slope in [0.1, -0.7] {
            let length = f64::hypot(1.0, slope);
            for index in 0..(size as usize).pow(D as u32 - 1) {
                let mut position = [0.0; D];
                let mut rest = index;
                for x in &mut position[..D - 1] {
                    *x = (rest % size as usize) as f64;
                    rest /= size as usize;
                }
                position[D - 1] = 0.5 * size + slope * (position[0] - 0.4 * size);
                let mut normal = [0.0; D];
                (normal[0], normal[D - 1]) = (-slope / length, 1.0 / length);
                (0..D).for_each(|k| position[k] += noise * between(-1.0, 1.0));
                normal[0] += noise * between(-1.0, 1.0);
                let unit = dot(&normal, &normal).sqrt();
                let sign = if index % 3 == 0 { -1.0 } else { 1.0 };
                let normal = normal.map(|n| sign * n / unit);
                points.push(FeaturePoint {
                    index,
                    position: bounds.clamp(&position),
                    normal,
                    strength: 1.0,
                });
            }
        }
        for index in 0..40 {
            let position = std::array::from_fn(|_| between(0.0, size));
            let normal = std::array::from_fn(|k| if k == index % D { 1.0 } else { 0.0 });
            points.push(FeaturePoint { index, position, normal, strength: 0.5 });
        }
        (points, bounds)
    }

    /// What is said of flat blocks is so of each point of them with all near it; how many blocks are.
    fn flat_blocks_are_flat<const D: usize>(noise: f64) -> (usize, usize) {
        let (points, bounds) = crossing_sheets::<D>(noise, 5);
        let reach = 4.0;
        let grid = PointGrid::new(&bounds, reach, points.iter().map(|point| point.position));
        let found = grid.map_blocks(reach, |block, found: &mut Vec<bool>| {
            let is_flat = is_flat(block, &points, 1.0);
            found.extend(block.own().iter().map(|_| is_flat));
        });
        for (i, own) in points.iter().enumerate().filter(|(i, _)| found[*i]) {
            for other in &points {
                let offset = difference(&other.position, &own.position);
                let length = dot(&offset, &offset).sqrt();
                if length <= reach {
                    assert!(dot(&own.normal, &other.normal).abs() >= 0.93, "{i}");
                    assert!(dot(&offset, &own.normal).abs() <= 0.3 + 0.1 * length, "{i}");
                    assert!(dot(&offset, &other.normal).abs() <= 0.3 + 0.19 * length, "{i}");
                }
            }
        }
        (found.iter().filter(|is| **is).count(), points.len())
    }

    #[test]
    fn points_of_flat_blocks_lie_on_one_plane_with_all_near_them() {
        for (found, all) in [flat_blocks_are_flat::<2>(0.02), flat_blocks_are_flat::<3>(0.02)] {
            assert!(4 * found > all && found < all, "{found} of {all}");
        }
        // noise leaves few
        for (found, all) in [flat_blocks_are_flat::<2>(0.2), flat_blocks_are_flat::<3>(0.2)] {
            assert!(4 * found < all, "{found} of {all}");
        }
    }
}
