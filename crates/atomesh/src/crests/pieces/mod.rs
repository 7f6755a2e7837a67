//! Pieces of features as geometry: where the nearest place on a piece is, and on which side of it a place lies.
//!
//! Points are linked into pieces by place and by normal, so that features that cross stay two: points whose
//! neighbours do not lie on their own plane, as where features cross, belong to none, and what is straight across
//! them is joined. The normals of a piece are turned to agree.
//!
//! Between its points a piece is what a moving least squares fit of second degree says (Alexa and others 2001): it
//! averages the noise of single points, and follows curvature.

mod link;
mod meet;

use std::collections::HashSet;

use super::{FeaturePoint, PointGrid};
use crate::geometry::linear::solve;
use crate::geometry::{Bounds, Point, Sets, difference, distance_squared, dot};
use crate::image::Grid;
use link::linked_pieces;

/// The deviation of the weights of a fit, and the radius of its points, in mean steps.
const FIT_WIDTH: f64 = 1.3;
const FIT_REACH: f64 = 3.25;
/// A normal that turns less than this, as one minus a cosine, is the same.
const SAME: f64 = 1e-5;
/// The width of cubes in which one point stands for all of a piece, in mean steps.
const COARSE: f64 = 4.0;
/// How often a foot is improved.
const FOOT_ROUNDS: usize = 3;
/// How far from the nearest point of a piece a place may be along the piece and still be on it, in mean steps: in the
/// image, and within this of the image's sides, where filters see too little.
const END: f64 = 1.2;
const END_AT_SIDE: f64 = 6.0;
/// How far from its nearest point a piece is looked for, in mean steps.
const GREATEST_GAP: f64 = 26.0;

/// Pieces of features, in lattice coordinates.
#[derive(Clone, Debug)]
pub struct Pieces<const D: usize> {
    points: Vec<FeaturePoint<D>>,
    /// The piece of each point.
    of_points: Vec<u32>,
    /// The mean strength of each piece.
    strengths: Vec<f64>,
    grid: PointGrid<D>,
    /// A point of each piece in each cube of some steps, for asking which pieces are near.
    coarse: PointGrid<D>,
    of_coarse: Vec<u32>,
    bounds: Bounds<D>,
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
        let (points, mut sets) = linked_pieces(points, grid, step);
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
        let grid = PointGrid::new(bounds, 1.5 * step, points.iter().map(|point| point.position));
        let order = grid.order();
        let points: Vec<FeaturePoint<D>> = order.iter().map(|&i| points[i]).collect();
        let of_points: Vec<u32> = order.iter().map(|&i| of_points[i]).collect();
        let grid = PointGrid::new(bounds, 1.5 * step, points.iter().map(|point| point.position));
        let (coarse, of_coarse) = coarse(&points, &of_points, bounds, step);
        Self { points, of_points, strengths, grid, coarse, of_coarse, bounds: *bounds, step }
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

    /// How far pieces are led on to the sides of the box, in mean steps.
    pub(crate) fn led_on(&self) -> f64 {
        END_AT_SIDE
    }

    /// All points, near ones together, with the piece of each.
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

    /// All pieces that have a point within `reach` of `p`, and some that are a little farther, in order.
    pub fn near(&self, p: &Point<D>, reach: f64) -> Vec<u32> {
        let mut found: Vec<u32> = Vec::new();
        let reach = reach + COARSE * self.step * (D as f64).sqrt();
        self.coarse.near(p, reach, |place, i| {
            let is_near = distance_squared(place, p) <= reach * reach;
            if is_near && !found.contains(&self.of_coarse[i]) {
                found.push(self.of_coarse[i]);
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
            self.grid.near(p, within, |_, i| {
                let found = (distance_squared(&self.points[i].position, p), Some(i));
                if wanted(self.of_points[i]) && found <= best {
                    best = found;
                }
            });
            if best.1.is_some() || within >= reach {
                return best.1;
            }
            within = (1.7 * within).min(reach);
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
            let gap = self.gap(piece, &x, along);
            beyond = (gap - self.end_at(&x)).max(0.0);
            if beyond > 0.0 {
                // the plane at the end goes on
                position = x;
                break;
            }
            let before = normal;
            (position, normal) = self.fit(piece, &x, &normal, gap)?;
            if dot(&before, &normal) > 1.0 - SAME
                && distance_squared(&position, &x) < SAME * self.step
            {
                break; // on the piece already, and turned as it is
            }
        }
        Some(Foot { position, normal, piece, beyond })
    }

    /// How far from its nearest point a piece still is at `x`.
    fn end_at(&self, x: &Point<D>) -> f64 {
        let near = END_AT_SIDE * self.step;
        let is_at_side =
            (0..D).any(|k| x[k] < self.bounds.min[k] + near || x[k] > self.bounds.max[k] - near);
        self.step * if is_at_side { END_AT_SIDE } else { END }
    }

    /// How far `x` is from the nearest point of a piece; at most `known`.
    fn gap(&self, piece: u32, x: &Point<D>, known: f64) -> f64 {
        if known <= END * self.step {
            return known;
        }
        let found = self.nearest(x, known.min(GREATEST_GAP * self.step), |other| other == piece);
        found.map_or(known, |i| distance_squared(&self.points[i].position, x).sqrt())
    }

    /// The piece near `x`, whose nearest point is `gap` away: the place straight above or below `x`, and the normal there.
    fn fit(
        &self,
        piece: u32,
        x: &Point<D>,
        normal: &Point<D>,
        gap: f64,
    ) -> Option<(Point<D>, Point<D>)> {
        let is_beside = gap > END * self.step; // beyond the last point, near a side of the box
        let extra = if is_beside { gap } else { 0.0 };
        let reach = FIT_REACH * self.step + extra;
        let inverse = 1.0 / (FIT_WIDTH * self.step + extra).powi(2);
        let axes = tangents(normal);
        let size = D * (D + 1) / 2;
        let mut matrix = [[0.0; 6]; 6];
        let mut right = [[0.0; 1]; 6];
        let mut count = 0;
        self.grid.near(x, reach, |_, i| {
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
            n if n >= 2 * size && !is_beside => size,
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

/// The first point of each piece in each cube of some steps, and their pieces.
fn coarse<const D: usize>(
    points: &[FeaturePoint<D>],
    of_points: &[u32],
    bounds: &Bounds<D>,
    step: f64,
) -> (PointGrid<D>, Vec<u32>) {
    let mut seen = HashSet::new();
    let is_first = |&i: &usize| {
        let cube = points[i].position.map(|x| (x / (COARSE * step)) as i64);
        seen.insert((cube, of_points[i]))
    };
    let first: Vec<usize> = (0..points.len()).filter(is_first).collect();
    let grid = PointGrid::new(bounds, COARSE * step, first.iter().map(|&i| points[i].position));
    (grid, first.iter().map(|&i| of_points[i]).collect())
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

#[cfg(test)]
mod tests {
    use super::*;

    const STEP: f64 = 1.0;

    fn at<const D: usize>(grid: &Grid<D>, position: Point<D>, normal: Point<D>) -> FeaturePoint<D> {
        let sample: [usize; D] =
            std::array::from_fn(|k| (position[k].round().max(0.0) as usize).min(grid.shape[k] - 1));
        FeaturePoint {
            index: (0..D).rev().fold(0, |index, k| index * grid.shape[k] + sample[k]),
            position,
            normal,
            strength: 1.0,
        }
    }

    /// Points along a line, one a sample.
    fn line(grid: &Grid<2>, through: Point<2>, normal: Point<2>) -> Vec<FeaturePoint<2>> {
        let along = [-normal[1], normal[0]];
        (-200..200)
            .map(|i| std::array::from_fn(|k| through[k] + f64::from(i) * along[k]))
            .filter(|p| grid.bounds().contains(p))
            // as finders leave the sign of a normal open
            .enumerate()
            .map(|(i, p)| at(grid, p, normal.map(|n| if i % 3 == 0 { -n } else { n })))
            .collect()
    }

    #[test]
    fn a_foot_on_a_circle_is_on_the_circle() {
        let grid = Grid { shape: [60, 60], step: [STEP; 2] };
        let (centre, radius) = ([29.3, 30.1], 12.0);
        let points = (0..80).map(|i| {
            let (sine, cosine) = (f64::from(i) * std::f64::consts::TAU / 80.0).sin_cos();
            let normal = [cosine, sine];
            let position = std::array::from_fn(|k| centre[k] + radius * normal[k]);
            at(&grid, position, normal)
        });
        let pieces = Pieces::new(points.collect(), &grid, 10);
        assert_eq!(pieces.len(), 1);
        for (angle, from) in [(0.3f64, 14.5), (1.9, 10.2), (4.0, 12.0)] {
            let p = [centre[0] + from * angle.cos(), centre[1] + from * angle.sin()];
            let foot = pieces.foot(&p, 10.0).unwrap();
            let off = (foot.position[0] - centre[0]).hypot(foot.position[1] - centre[1]) - radius;
            // a fit of second degree to a circle: the fourth derivative is left, σ⁴/8R³
            assert!(off.abs() < 2e-3, "{off}");
            assert_eq!(foot.beyond, 0.0);
            let height = foot.signed_distance(&p);
            assert!((height.abs() - (from - radius).abs()).abs() < 5e-3, "{height} {from}");
        }
        // all normals are on one side
        let sides: Vec<bool> = (pieces.points())
            .map(|(p, _)| dot(&p.normal, &difference(&p.position, &centre)) > 0.0)
            .collect();
        assert!(sides.iter().all(|&side| side == sides[0]));
    }

    #[test]
    fn lines_that_cross_are_two_pieces_whatever_the_middle_says() {
        let grid = Grid { shape: [80, 80], step: [STEP; 2] };
        let middle = [40.3, 39.6];
        for degrees in [35.0f64, 60.0, 90.0] {
            let (sine, cosine) = degrees.to_radians().sin_cos();
            let normals = [[0.0, 1.0], [sine, cosine]];
            let mut points: Vec<FeaturePoint<2>> =
                normals.iter().flat_map(|&normal| line(&grid, middle, normal)).collect();
            // where they cross a finder sees the bisector
            let bisector = [0.5 * degrees.to_radians().sin(), 0.5 * (1.0 + cosine)];
            let length = bisector[0].hypot(bisector[1]);
            for point in &mut points {
                if distance_squared(&point.position, &middle) < 6.0 {
                    point.normal = bisector.map(|n| n / length);
                }
            }
            let pieces = Pieces::new(points, &grid, 10);
            assert_eq!(pieces.len(), 2, "{degrees}°");
            // both go through the crossing
            for piece in 0..2 {
                let foot = pieces.foot_on(piece, &middle, 10.0).unwrap();
                assert!(
                    foot.beyond == 0.0 && foot.signed_distance(&middle).abs() < 0.3,
                    "{foot:?}"
                );
            }
        }
    }

    #[test]
    fn a_piece_ends_where_its_points_end_but_is_led_on_to_sides() {
        let grid = Grid { shape: [60, 40], step: [STEP; 2] };
        let all = line(&grid, [30.0, 20.4], [0.0, 1.0]);
        let some = all.into_iter().filter(|p| (3.0..40.0).contains(&p.position[0])).collect();
        let pieces = Pieces::new(some, &grid, 10);
        assert!(pieces.foot(&[45.0, 21.0], 10.0).unwrap().beyond > 3.0);
        let foot = pieces.foot(&[0.0, 20.0], 10.0).unwrap();
        assert_eq!(foot.beyond, 0.0);
        assert!((foot.position[1] - 20.4).abs() < 1e-6);
        assert_eq!(pieces.near(&[20.0, 22.0], 3.0), [0]);
        assert!(pieces.near(&[55.0, 4.0], 1.0).is_empty());
    }

    #[test]
    fn few_points_and_clutter_make_no_piece() {
        let grid = Grid { shape: [60, 40], step: [STEP; 2] };
        let short = line(&grid, [30.0, 20.4], [0.0, 1.0]).into_iter().take(8).collect();
        assert!(Pieces::new(short, &grid, 10).is_empty());
        let clutter = (0..200).map(|i| {
            let angle = f64::from(i) * 2.4;
            at(&grid, [f64::from(i * 7 % 59), f64::from(i * 11 % 39)], [angle.cos(), angle.sin()])
        });
        assert!(Pieces::new(clutter.collect(), &grid, 10).is_empty());
        assert!(Pieces::<2>::new(Vec::new(), &grid, 1).is_empty());
    }
}
