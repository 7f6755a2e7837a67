//! b along facets.

use rayon::prelude::*;

use super::{FacetTest, FeaturesError};
use crate::crests::{FeaturePoint, PointGrid};
use crate::fields::ScalarField;
use crate::geometry::{Bounds, Point, difference, distance_squared, dot};
use crate::mesh::{Facet, Mesh};
use crate::watch::{Phase, Watch, check};

/// Facets between two looks at the watch, a fixed number so that results do not depend on threads.
const BLOCK: usize = 1 << 16;

/// Most parts into which an edge of a facet is divided.
const MOST_PARTS: f64 = 64.0;

/// A facet lies on a crest whose normal is within this of its own, 30°, as cosine.
const ALONG: f64 = 0.866;

/// How far along a feature one of its points stands for it, in steps: half the diagonal of a sample's cell in space.
const STANDS_FOR: f64 = 0.87;

/// The facets between two cells of a mesh, each with the mean and the greatest b along it.
///
/// Facets on the hull are left out: nothing is on their other side.
#[derive(Clone, Debug, PartialEq)]
pub struct FacetField<const D: usize> {
    facets: Vec<Facet<D>>,
    mean: Vec<f64>,
    greatest: Vec<f64>,
}

impl<const D: usize> FacetField<D> {
    /// b read between samples along the facets of a mesh in the potential's lattice coordinates.
    ///
    /// The mean is that of the values at the middles of equal parts. Parts of an edge (2-D) are at most half a step long,
    /// the sides of parts of a triangle (3-D) at most one step, with no more than 64 along a side. Along a valley one step
    /// wide and −1 deep the mean is right to 0.01. The greatest is that of these values and those at the corners.
    ///
    /// # Errors
    /// [`FeaturesError::Cancelled`] if the watch ends the work.
    pub fn along(
        mesh: &Mesh<D>,
        potential: &ScalarField<D>,
        watch: &mut dyn Watch,
    ) -> Result<Self, FeaturesError> {
        let step = potential.grid().least_step();
        let longest = if D == 2 { 0.5 * step } else { step };
        Self::read(mesh, watch, |corners, _| {
            mean_and_greatest(corners, longest, |p| potential.value(p))
        })
    }

    /// What `of` reads along each facet, given its corners and normal: the mean and the greatest value.
    fn read(
        mesh: &Mesh<D>,
        watch: &mut dyn Watch,
        of: impl Fn(&[Point<D>; D], &Point<D>) -> (f64, f64) + Sync,
    ) -> Result<Self, FeaturesError> {
        let facets = inner_facets(mesh);
        let mut values = Vec::with_capacity(facets.len());
        let blocks = facets.len().div_ceil(BLOCK).max(1);
        for (done, block) in facets.chunks(BLOCK).enumerate() {
            check(watch, Phase::Measure, done as f64 / blocks as f64, None)?;
            let along = block.par_iter().with_min_len(1 << 8).map(|facet| {
                let corners = facet.corners.map(|corner| mesh.points()[corner as usize]);
                of(&corners, &mesh.facet_normal(&facet.corners))
            });
            values.par_extend(along);
        }
        let (mean, greatest) = values.into_iter().unzip();
        Ok(Self { facets, mean, greatest })
    }

    /// b along facets from its values at the mesh's points alone: the mean and the greatest of those at the
    /// corners. What lies between is not seen: a facet with its corners on two features seems to lie on one.
    ///
    /// # Errors
    /// [`FeaturesError::PointCount`] if there is not one value for each point.
    pub fn from_points(mesh: &Mesh<D>, values: &[f32]) -> Result<Self, FeaturesError> {
        let (found, expected) = (values.len(), mesh.points().len());
        if found != expected {
            return Err(FeaturesError::PointCount { found, expected });
        }
        let facets = inner_facets(mesh);
        let of = |facet: &Facet<D>| facet.corners.map(|corner| f64::from(values[corner as usize]));
        let mean = facets.iter().map(|facet| of(facet).iter().sum::<f64>() / D as f64).collect();
        let greatest =
            facets.iter().map(|facet| of(facet).into_iter().fold(-1.0, f64::max)).collect();
        Ok(Self { facets, mean, greatest })
    }

    /// How much of each facet lies on crests of an image, given by points about a step apart: in place of the greatest b
    /// there is −1 times the share of the facet that is within `reach` of a crest and turned as it is, within 30°; in
    /// place of the mean of b, that times the mean strength of the crests there. A facet that has no crest at its middle
    /// nor halfway from there to its corners counts as one that lies on none.
    ///
    /// All in the mesh's coordinates; `step` is the mean step of samples there.
    ///
    /// # Errors
    /// [`FeaturesError::Cancelled`] if the watch ends the work.
    pub fn on_crests(
        mesh: &Mesh<D>,
        crests: &[FeaturePoint<D>],
        step: f64,
        reach: f64,
        watch: &mut dyn Watch,
    ) -> Result<Self, FeaturesError> {
        let bounds = Bounds::of(mesh.points()).unwrap_or(Bounds { min: [0.0; D], max: [0.0; D] });
        let positions = crests.iter().map(|point| point.position);
        let around = Around::new(&bounds, reach + STANDS_FOR * step, positions.clone());
        let grid = PointGrid::new(&bounds, reach, positions);
        let near = Crests { crests, grid, around, step, reach };
        let longest = if D == 2 { 0.5 * step } else { 1.5 * step };
        Self::read(mesh, watch, |corners, normal| near.along(corners, normal, longest))
    }

    /// Facets with given means, which are the greatest values too.
    #[cfg(test)]
    pub(super) fn given(facets: Vec<Facet<D>>, mean: impl Fn(&Facet<D>) -> f64) -> Self {
        let mean: Vec<f64> = facets.iter().map(mean).collect();
        Self { facets, greatest: mean.clone(), mean }
    }

    /// The facets, in lexicographic order of their corners.
    pub fn facets(&self) -> &[Facet<D>] {
        &self.facets
    }

    /// The mean of b along each facet.
    pub fn mean(&self) -> &[f64] {
        &self.mean
    }

    /// The greatest b along each facet.
    pub fn greatest(&self) -> &[f64] {
        &self.greatest
    }

    /// The value of the facet of that index that is compared with the threshold.
    pub(super) fn value(&self, facet: usize, test: FacetTest) -> f64 {
        match test {
            FacetTest::Mean => self.mean[facet],
            FacetTest::Max => self.greatest[facet],
        }
    }
}

/// Crests near facets.
struct Crests<'a, const D: usize> {
    crests: &'a [FeaturePoint<D>],
    grid: PointGrid<D>,
    around: Around<D>,
    step: f64,
    reach: f64,
}

impl<const D: usize> Crests<'_, D> {
    /// The strength and the share of crests along a facet, below 0.
    fn along(&self, corners: &[Point<D>; D], normal: &Point<D>, longest: f64) -> (f64, f64) {
        let length = dot(normal, normal).sqrt();
        if length == 0.0 {
            return (0.0, 0.0);
        }
        let normal = normal.map(|n| n / length);
        let parts = parts(corners, longest);
        let place = |weights: [f64; D]| -> Point<D> {
            std::array::from_fn(|k| (0..D).map(|i| weights[i] * corners[i][k]).sum())
        };
        // most facets lie on none: a look at their middle and halfway to their corners tells
        let middle: [f64; D] = [1.0 / D as f64; D];
        let halfway = |k: usize| -> [f64; D] {
            std::array::from_fn(|i| 0.5 * middle[i] + if i == k { 0.5 } else { 0.0 })
        };
        let mut looks = std::iter::once(middle).chain((0..D).map(halfway));
        if !looks.any(|weights| self.strongest(&place(weights), &normal) > 0.0) {
            return (0.0, 0.0);
        }
        let (mut count, mut on, mut strength) = (0.0, 0.0, 0.0);
        each_middle(parts, |weights: [f64; D]| {
            let found = self.strongest(&place(weights), &normal);
            count += 1.0;
            on += f64::from(u8::from(found > 0.0));
            strength += found;
        });
        (-strength / count, -on / count)
    }

    /// The strength of the strongest crest at a place, turned as a facet with that normal; 0 if there is none.
    fn strongest(&self, at: &Point<D>, normal: &Point<D>) -> f64 {
        let mut strongest = 0.0f64;
        if !self.around.holds(at) {
            return strongest;
        }
        self.grid.near(at, self.reach + STANDS_FOR * self.step, |place, i| {
            let crest = &self.crests[i];
            let offset = difference(place, at);
            let above = dot(&offset, &crest.normal);
            let beside = (dot(&offset, &offset) - above * above).max(0.0).sqrt();
            let beside = (beside - STANDS_FOR * self.step).max(0.0);
            if above * above + beside * beside <= self.reach * self.reach
                && dot(&crest.normal, normal).abs() >= ALONG
            {
                strongest = strongest.max(crest.strength);
            }
        });
        strongest
    }
}

/// Cubes with a point in them or beside them.
struct Around<const D: usize> {
    min: Point<D>,
    width: f64,
    shape: [usize; D],
    are_around: Vec<bool>,
}

impl<const D: usize> Around<D> {
    /// Cubes of a width, so that all places nearer than this to a point are in one that counts.
    fn new(bounds: &Bounds<D>, width: f64, points: impl Iterator<Item = Point<D>>) -> Self {
        let shape = bounds.extent().map(|extent| (extent / width) as usize + 1);
        let are_around = vec![false; shape.iter().product()];
        let mut cubes = Self { min: bounds.min, width, shape, are_around };
        for point in points {
            let cube = cubes.cube(&point);
            cubes.are_around[cube] = true;
        }
        let mut stride = 1;
        for count in shape {
            let before = cubes.are_around.clone();
            for (cube, is_around) in cubes.are_around.iter_mut().enumerate() {
                let at = cube / stride % count;
                *is_around |= at > 0 && before[cube - stride];
                *is_around |= at + 1 < count && before[cube + stride];
            }
            stride *= count;
        }
        cubes
    }

    fn holds(&self, place: &Point<D>) -> bool {
        self.are_around[self.cube(place)]
    }

    /// The number of the cube of a place; of one outside, the nearest.
    fn cube(&self, place: &Point<D>) -> usize {
        (0..D).rev().fold(0, |index, k| {
            let at = ((place[k] - self.min[k]) / self.width).max(0.0) as usize;
            index * self.shape[k] + at.min(self.shape[k] - 1)
        })
    }
}

fn inner_facets<const D: usize>(mesh: &Mesh<D>) -> Vec<Facet<D>> {
    let mut facets = mesh.facets();
    facets.retain(|facet| facet.neighbour.is_some());
    facets
}

/// The mean of b over a segment or triangle, and its greatest value; `longest` is the greatest length of a
/// part.
fn mean_and_greatest<const D: usize>(
    corners: &[Point<D>; D],
    longest: f64,
    b: impl Fn(&Point<D>) -> f64,
) -> (f64, f64) {
    let parts = parts(corners, longest);
    let greatest_at_corners = corners.iter().map(&b).fold(-1.0, f64::max);
    let (mut sum, mut count, mut greatest) = (0.0, 0.0, greatest_at_corners);
    each_middle(parts, |weights: [f64; D]| {
        let at = std::array::from_fn(|k| (0..D).map(|i| weights[i] * corners[i][k]).sum());
        let value = b(&at);
        sum += value;
        count += 1.0;
        greatest = greatest.max(value);
    });
    (sum / count, greatest)
}

/// Into how many parts edges of a facet are divided, so that none is longer than `longest`.
fn parts<const D: usize>(corners: &[Point<D>; D], longest: f64) -> usize {
    let pairs = (0..D).flat_map(|i| (0..i).map(move |j| (i, j)));
    let side = pairs.map(|(i, j)| distance_squared(&corners[i], &corners[j])).fold(0.0, f64::max);
    (side.sqrt() / longest).ceil().clamp(1.0, MOST_PARTS) as usize
}

/// Calls `visit` with the weights of the corners at the middles of the equal parts of a segment (`parts` of
/// them) or triangle (their square).
fn each_middle<const D: usize>(parts: usize, mut visit: impl FnMut([f64; D])) {
    let n = parts as f64;
    for i in 0..parts {
        if D == 2 {
            let share = (i as f64 + 0.5) / n;
            visit(std::array::from_fn(|k| if k == 0 { 1.0 - share } else { share }));
            continue;
        }
        for j in 0..parts - i {
            // the part that points the same way as the whole, and the inverted one beside it
            let heads = if i + j + 1 < parts { 2 } else { 1 };
            for head in 1..=heads {
                let third = f64::from(head) / 3.0;
                let (u, v) = ((i as f64 + third) / n, (j as f64 + third) / n);
                visit(std::array::from_fn(|k| [1.0 - u - v, u, v][k]));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn middles_make_the_mean_of_a_plane_exact<const D: usize>() {
        // the mean of a linear function is its value at the centroid, 1 / D for every weight
        for parts in 1..9 {
            let (mut sums, mut count) = ([0.0; D], 0.0);
            each_middle(parts, |weights: [f64; D]| {
                (0..D).for_each(|k| sums[k] += weights[k]);
                count += 1.0;
            });
            assert_eq!(count, (parts as f64).powi(D as i32 - 1));
            for sum in sums {
                assert!((sum / count - 1.0 / D as f64).abs() < 1e-14, "{parts}: {sum}");
            }
        }
    }

    #[test]
    fn parts_are_equal_in_number_and_place_for_every_corner() {
        middles_make_the_mean_of_a_plane_exact::<2>();
        middles_make_the_mean_of_a_plane_exact::<3>();
    }

    fn near_a_fine_sum<const D: usize>(longest: f64) {
        // a valley one step wide at half its depth, crossed at many angles
        let b = |p: &Point<D>| -(-2.0 * (p[0] - 2.5).powi(2)).exp();
        for trial in 0..40 {
            let t = f64::from(trial);
            let corners: [Point<D>; D] = std::array::from_fn(|i| {
                std::array::from_fn(|k| 2.5 + 3.5 * (t * 0.37 + (5 * i + 3 * k) as f64).sin())
            });
            let (mean, greatest) = mean_and_greatest(&corners, longest, b);
            let (fine, most) = mean_and_greatest(&corners, longest / 9.0, b);
            assert!((mean - fine).abs() < 0.01, "{D}-D, {trial}: {mean} {fine}");
            assert!((greatest - most).abs() < 0.05, "{D}-D, {trial}: {greatest} {most}");
        }
    }

    #[test]
    fn the_mean_is_within_a_hundredth_of_a_fine_one() {
        near_a_fine_sum::<2>(0.5);
        near_a_fine_sum::<3>(1.0);
    }

    proptest! {
        #[test]
        fn places_near_a_point_are_in_cubes_that_count(
            point in [0.0..9.0f64, 0.0..4.0, 0.0..6.0],
            towards in [-1.0..1.0f64, -1.0..1.0, -1.0..1.0],
            width in 0.3..3.0f64,
        ) {
            let bounds = Bounds { min: [0.0; 3], max: [9.0, 4.0, 6.0] };
            let around = Around::new(&bounds, width, [point].into_iter());
            let near = std::array::from_fn(|k| point[k] + 0.57 * width * towards[k]);
            prop_assert!(around.holds(&bounds.clamp(&near)));
            let far = if point[0] > 4.5 { 0.0 } else { 9.0 };
            prop_assert!(width > 1.4 || !around.holds(&[far, point[1], point[2]]));
        }
    }
}
