//! Pieces of features as geometry: where the nearest place on a piece is, and on which side of it a place lies.
//!
//! Points are linked into pieces by place and by normal, so that features that cross stay two: points whose
//! neighbours do not lie on their own plane, as where features cross, belong to none at first, and what is straight
//! across them is joined. What is left, ragged and bent, is linked by growth from its strongest points on. The
//! normals of a piece are turned to agree.
//!
//! Between its points a piece is what moving least squares fits of second degree say (Alexa and others 2001): they
//! average the noise of single points, and follow curvature. They are made once, at points some two samples apart
//! ([`Patch`](patch::Patch)); a place is asked of the nearest.

mod grow;
mod link;
mod meet;
mod near;
mod patch;
mod support;

use crate::parallel::prelude::*;

use super::FeaturePoint;
use crate::geometry::{Bounds, Point, PointGrid, Sets, difference, distance_squared, dot};
use crate::image::Grid;
use link::linked_pieces;
use patch::{Cloud, Patch};
use support::cleanness;

/// The width of cubes in which one patch stands for all of a piece, in mean steps, and how far from a patch's middle
/// its piece still is what it says.
const PATCH: f64 = 2.0;
const PATCH_REACH: f64 = 2.6;
/// The width of cubes in which one point stands for all of a piece, in mean steps.
const COARSE: f64 = 4.0;
/// The width of the rows in which these are looked for, about as far as pieces are asked for, in mean steps.
const COARSE_ROW: f64 = 16.0;
/// How often a foot is looked for on the patch nearest to the last.
const FOOT_ROUNDS: usize = 3;
/// How far from the nearest point of a piece a place may be along the piece and still be on it, in mean steps: in the
/// image, and within this of the image's sides, where filters see too little, in the plane and in space.
const END: f64 = 1.2;
const END_AT_SIDE: [f64; 2] = [6.0, 4.0];
/// How far from its nearest point a piece is looked for, in mean steps.
const GREATEST_GAP: f64 = 26.0;
/// A point is at the end or border of its piece if the mean of the points within some steps is farther than this.
const RIM_REACH: f64 = 3.0;
const RIM: f64 = 0.4;

/// Pieces of features, in lattice coordinates.
#[derive(Clone, Debug)]
pub struct Pieces<const D: usize> {
    points: Vec<FeaturePoint<D>>,
    /// The piece of each point.
    of_points: Vec<u32>,
    /// The mean strength of each piece.
    strengths: Vec<f64>,
    grid: PointGrid<D>,
    patches: Vec<Patch<D>>,
    /// The piece of each patch, and whether the patch is at the end or border of its piece.
    of_patches: Vec<(u32, bool)>,
    patch_grid: PointGrid<D>,
    /// A point of each piece in each cube of some steps, for asking which pieces are near.
    coarse: PointGrid<D>,
    of_coarse: Vec<u32>,
    bounds: Bounds<D>,
    /// The mean step of the image.
    step: f64,
}

/// Whether features can be followed as lines or sheets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cleanness {
    /// The share of points that lie on a line or sheet of their own: most points near them lie on their own plane.
    pub clean: f64,
    /// The share of points that neither do, nor lie beside points that do, as where lines or sheets end or cross.
    pub unexplained: f64,
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
        mut points: Vec<FeaturePoint<D>>,
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
        let of_all: Vec<u32> = roots.iter().map(|&root| number[root as usize]).collect();
        let mut pieces = of_all.iter();
        points.retain(|_| pieces.next() != Some(&u32::MAX));
        let of_points: Vec<u32> = of_all.into_iter().filter(|&piece| piece != u32::MAX).collect();
        let grid =
            PointGrid::new(bounds, patch::REACH * step, points.iter().map(|point| point.position));
        let cloud = Cloud { points: &points, pieces: &of_points, grid: &grid, step };
        let (patches, of_patches) = patches(&cloud);
        let patch_grid = PointGrid::new(bounds, 2.0 * PATCH * step, patches.iter().map(|p| p.at));
        let first = firsts(&points, &of_points, COARSE * step);
        let positions = first.iter().map(|&i| points[i].position);
        let coarse = PointGrid::new(bounds, COARSE_ROW * step, positions);
        let of_coarse = first.iter().map(|&i| of_points[i]).collect();
        Self {
            points,
            of_points,
            strengths,
            grid,
            patches,
            of_patches,
            patch_grid,
            coarse,
            of_coarse,
            bounds: *bounds,
            step,
        }
    }

    /// How clean the features are that points, in lattice coordinates, lie on. Of many points some are asked.
    pub fn cleanness(points: &[FeaturePoint<D>], grid: &Grid<D>) -> Cleanness {
        cleanness(points, grid)
    }

    /// How many points all pieces have.
    pub(crate) fn point_count(&self) -> usize {
        self.points.len()
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
        END_AT_SIDE[D - 2]
    }

    /// All points, with the piece of each.
    pub fn points(&self) -> impl ExactSizeIterator<Item = (&FeaturePoint<D>, u32)> {
        self.points.iter().zip(self.of_points.iter().copied())
    }

    /// Places on all pieces some two steps apart, with the piece of each.
    pub(crate) fn places(&self) -> impl ExactSizeIterator<Item = (Point<D>, u32)> {
        self.patches.iter().zip(&self.of_patches).map(|(patch, (piece, _))| (patch.at, *piece))
    }

    /// Places on all pieces, one in each cube of [`Self::sparse`].
    pub(crate) fn sparse_places(&self) -> impl Iterator<Item = Point<D>> {
        self.coarse.positions()
    }

    /// The width of these cubes.
    pub(crate) fn sparse(&self) -> f64 {
        COARSE * self.step
    }

    /// The width of the cubes in each of which a piece has one of [`Self::places`], if it has points there.
    pub(crate) fn width(&self) -> f64 {
        PATCH * self.step
    }

    /// How far apart [`Self::places`] are at most, in mean steps.
    pub(crate) fn apart(&self) -> f64 {
        PATCH * (D as f64).sqrt()
    }

    /// The foot of `p` on the piece nearest to it, if one is within `reach`.
    pub fn foot(&self, p: &Point<D>, reach: f64) -> Option<Foot<D>> {
        let nearest = self.nearest_patch(p, reach, |_| true)?;
        Some(self.foot_from(nearest, p))
    }

    /// The foot of `p` on a piece, if that has a place within `reach`.
    pub fn foot_on(&self, piece: u32, p: &Point<D>, reach: f64) -> Option<Foot<D>> {
        let nearest = self.nearest_patch(p, reach, |other| other == piece)?;
        Some(self.foot_from(nearest, p))
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

    /// The patch of wanted pieces whose middle is nearest, of those that may be within `reach`.
    fn nearest_patch(
        &self,
        p: &Point<D>,
        reach: f64,
        wanted: impl Fn(u32) -> bool,
    ) -> Option<usize> {
        let wanted = |i: usize| wanted(self.of_patches[i].0);
        let found = self.patch_grid.nearest(p, reach + PATCH * self.step, wanted);
        found.map(|(patch, _)| patch)
    }

    /// The foot of `p` on a patch, or on those beside it.
    fn foot_from(&self, mut nearest: usize, p: &Point<D>) -> Foot<D> {
        let (piece, mut is_rim) = self.of_patches[nearest];
        let (mut position, mut normal) = self.patches[nearest].foot(p, self.step);
        let near = (PATCH_REACH * self.step).powi(2);
        let mut is_far = distance_squared(&position, &self.patches[nearest].at) > near;
        for _ in 1..FOOT_ROUNDS {
            if !is_far {
                break;
            }
            let next = self.nearest_patch(&position, 2.0 * PATCH * self.step, |i| i == piece);
            let Some(next) = next.filter(|&next| next != nearest) else { break };
            nearest = next;
            is_rim = self.of_patches[nearest].1;
            (position, normal) = self.patches[nearest].foot(p, self.step);
            is_far = distance_squared(&position, &self.patches[nearest].at) > near;
        }
        if !is_rim && !is_far {
            return Foot { position, normal, piece, beyond: 0.0 };
        }
        let gap = self.gap(piece, &position);
        let beyond = (gap - self.end_at(&position)).max(0.0);
        if beyond == 0.0 && gap > END * self.step {
            // beyond the last point, near a side of the box: led on by more of the piece
            let cloud = Cloud {
                points: &self.points,
                pieces: &self.of_points,
                grid: &self.grid,
                step: self.step,
            };
            let normal_there = self.patches[nearest].normal;
            if let Some(wide) = Patch::fit(&cloud, piece, &position, &normal_there, gap) {
                (position, normal) = wide.flat_foot(p, self.step);
            }
        }
        Foot { position, normal, piece, beyond }
    }

    /// How far from its nearest point a piece still is at `x`.
    fn end_at(&self, x: &Point<D>) -> f64 {
        let near = END_AT_SIDE[D - 2] * self.step;
        let is_at_side =
            (0..D).any(|k| x[k] < self.bounds.min[k] + near || x[k] > self.bounds.max[k] - near);
        self.step * if is_at_side { END_AT_SIDE[D - 2] } else { END }
    }

    /// Whether a piece has a point within `reach` of `x`: not so where it was led on.
    pub(crate) fn has_point_near(&self, piece: u32, x: &Point<D>, reach: f64) -> bool {
        self.gap(piece, x) <= reach
    }

    /// How far `x` is from the nearest point of a piece.
    fn gap(&self, piece: u32, x: &Point<D>) -> f64 {
        let most = GREATEST_GAP * self.step;
        let is_own = |i: usize| self.of_points[i] == piece;
        self.grid.nearest(x, most, is_own).map_or(most, |(_, squared)| squared.sqrt())
    }
}

/// Patches at one point of each piece in each small cube, with their pieces and whether they are at a rim.
fn patches<const D: usize>(cloud: &Cloud<'_, D>) -> (Vec<Patch<D>>, Vec<(u32, bool)>) {
    let reach = RIM_REACH * cloud.step;
    let of = |&i: &usize| {
        let (point, piece) = (&cloud.points[i], cloud.pieces[i]);
        let patch = Patch::fit_twice(cloud, piece, &point.position, &point.normal)?;
        let (mut sum, mut count) = ([0.0; D], 0.0);
        cloud.grid.near(&patch.at, reach, |place, j| {
            let offset = difference(place, &patch.at);
            if cloud.pieces[j] == piece && dot(&offset, &offset) <= reach * reach {
                (0..D).for_each(|k| sum[k] += offset[k]);
                count += 1.0;
            }
        });
        let is_rim = dot(&sum, &sum).sqrt() > RIM * cloud.step * count;
        Some((patch, (piece, is_rim)))
    };
    let first = firsts(cloud.points, cloud.pieces, PATCH * cloud.step);
    let found: Vec<_> = first.par_iter().with_min_len(1 << 7).filter_map(of).collect();
    found.into_iter().unzip()
}

/// The first point of each piece in each cube of this width.
fn firsts<const D: usize>(points: &[FeaturePoint<D>], of_points: &[u32], width: f64) -> Vec<usize> {
    let place = |(i, point): (usize, &FeaturePoint<D>)| {
        (point.position.map(|x| (x / width) as i32), of_points[i], i as u32)
    };
    let mut places: Vec<([i32; D], u32, u32)> = points.par_iter().enumerate().map(place).collect();
    places.par_sort_unstable();
    places.dedup_by_key(|(cube, piece, _)| (*cube, *piece));
    let mut first: Vec<usize> = places.into_iter().map(|(_, _, i)| i as usize).collect();
    first.par_sort_unstable();
    first
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
    fn a_line_that_forks_is_two_pieces_of_one_layer_each() {
        let grid = Grid { shape: [100, 60], step: [STEP; 2] };
        let mut points = line(&grid, [50.0, 30.2], [0.0, 1.0]);
        // a branch rises by a twelfth from x = 40 on
        let slant = [-1.0 / 145f64.sqrt(), 12.0 / 145f64.sqrt()];
        let branch = line(&grid, [40.0, 30.2], slant);
        points.extend(branch.into_iter().filter(|p| p.position[0] > 52.0));
        let pieces = Pieces::new(points, &grid, 10);
        assert_eq!(pieces.len(), 2);
        for (point, piece) in pieces.points() {
            let beside = pieces.points().any(|(other, of)| {
                let offset = difference(&other.position, &point.position);
                of == piece && offset[1].abs() > 1.5 && offset[0].abs() < 1.0
            });
            assert!(!beside, "{:?}", point.position);
        }
    }

    #[test]
    fn points_between_joined_pieces_are_turned_as_these_whatever_their_signs() {
        let grid = Grid { shape: [60, 40], step: [STEP; 2] };
        let mut points = line(&grid, [30.0, 20.4], [0.0, 1.0]);
        points.retain(|p| !(29.5..31.5).contains(&p.position[0]));
        for point in &mut points {
            let sign = if point.position[0] < 30.0 { 1.0 } else { -1.0 };
            point.normal = [0.0, sign];
        }
        let pieces = Pieces::new(points, &grid, 10);
        assert_eq!(pieces.len(), 1);
        assert!(pieces.points().any(|(p, _)| (29.5..31.5).contains(&p.position[0])));
        assert!(pieces.points().all(|(p, _)| p.normal[1].abs() > 0.999));
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
