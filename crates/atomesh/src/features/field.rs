//! b along facets.

use crate::parallel::prelude::*;

use super::{FacetTest, FeaturesError, measure_and_mean};
use crate::fields::ScalarField;
use crate::geometry::{Point, distance_squared, dot};
use crate::mesh::{Facet, Mesh, area_vector};
use crate::watch::{Phase, Watch, check};

/// Facets between two looks at the watch, a fixed number so that results do not depend on threads.
const BLOCK: usize = 1 << 16;

/// Most parts into which an edge of a facet is divided.
const MOST_PARTS: f64 = 64.0;

/// A place within reach of the bottom of a valley is at least this deep, over the least depth of valleys.
const HINT: f64 = 0.6;

/// A facet that lies along a valley has its bottom across the middle within so many times the reach.
const MIDDLE: f64 = 2.0;

/// How far from a facet b is read on both sides, over the reach: the bottom is that of a parabola.
const ACROSS: f64 = 1.5;

/// The least second difference of b across a valley, from place to place.
const LEAST_BEND: f64 = 1e-3;

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
        Self::read(mesh, watch, |corners| {
            mean_and_greatest(corners, longest, |p| potential.value(p))
        })
    }

    /// What `of` reads along each facet, given its corners: the mean and the greatest value.
    fn read(
        mesh: &Mesh<D>,
        watch: &mut dyn Watch,
        of: impl Fn(&[Point<D>; D]) -> (f64, f64) + Sync,
    ) -> Result<Self, FeaturesError> {
        let facets = inner_facets(mesh);
        let mut values = Vec::with_capacity(facets.len());
        let blocks = facets.len().div_ceil(BLOCK).max(1);
        for (done, block) in facets.chunks(BLOCK).enumerate() {
            check(watch, Phase::Measure, done as f64 / blocks as f64, None)?;
            let along = block.par_iter().with_min_len(1 << 8).map(|facet| {
                let corners = facet.corners.map(|corner| mesh.points()[corner as usize]);
                of(&corners)
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

    /// How much of each facet lies along the bottoms of valleys: in place of the greatest b there is −1 times the share
    /// of the facet across which b, along the facet's normal, has a bottom within `reach` and below −`least_depth`; in
    /// place of the mean of b, that times the mean b of these bottoms. A facet across whose middle there is none even within
    /// twice the reach counts as one that lies along none.
    ///
    /// The potential is to be as smooth as valleys are looked for. The mesh is in its lattice coordinates.
    ///
    /// # Errors
    /// [`FeaturesError::Cancelled`] if the watch ends the work.
    pub fn in_valleys(
        mesh: &Mesh<D>,
        potential: &ScalarField<D>,
        reach: f64,
        least_depth: f64,
        watch: &mut dyn Watch,
    ) -> Result<Self, FeaturesError> {
        let longest = if D == 2 { reach } else { 2.0 * reach };
        let valleys = Valleys { potential, reach, least_depth, longest };
        Self::read(mesh, watch, |corners| valleys.along(corners))
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

    /// The mean of b over some of the facets, corners ascending, weighted by length or area; `None` if none of them lies
    /// between two cells. `mesh` is theirs, in any coordinates.
    pub fn mean_over(&self, mesh: &Mesh<D>, facets: &[[u32; D]]) -> Option<f64> {
        let found = facets.iter().filter_map(|corners| {
            let at = self.facets.binary_search_by(|facet| facet.corners.cmp(corners)).ok()?;
            Some((corners, self.mean[at]))
        });
        let (measure, mean) = measure_and_mean(mesh, found);
        (measure > 0.0).then_some(mean)
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

/// Valleys of a potential that facets may lie along.
struct Valleys<'a, const D: usize> {
    potential: &'a ScalarField<D>,
    reach: f64,
    least_depth: f64,
    /// The greatest length of a part of a facet.
    longest: f64,
}

impl<const D: usize> Valleys<'_, D> {
    /// The depth and the share of valleys along a facet, below 0.
    fn along(&self, corners: &[Point<D>; D]) -> (f64, f64) {
        let place = |weights: [f64; D]| -> Point<D> {
            std::array::from_fn(|k| (0..D).map(|i| weights[i] * corners[i][k]).sum())
        };
        let normal = area_vector(corners);
        let area = dot(&normal, &normal).sqrt();
        let normal = normal.map(|n| n / area); // of a flat facet NaN, so that it has no bottoms
        if self.bottom(&place([1.0 / D as f64; D]), &normal, MIDDLE).is_none() {
            return (0.0, 0.0);
        }
        let (mut count, mut on, mut sum) = (0.0, 0.0, 0.0);
        each_middle(parts(corners, self.longest), |weights: [f64; D]| {
            let bottom = self.bottom(&place(weights), &normal, 1.0);
            count += 1.0;
            on += f64::from(u8::from(bottom.is_some()));
            sum += bottom.unwrap_or(0.0);
        });
        (sum / count, -on / count)
    }

    /// b at the bottom of the valley across a place, if it is within so many times the reach and deep enough.
    fn bottom(&self, at: &Point<D>, normal: &Point<D>, within: f64) -> Option<f64> {
        let here = self.potential.value(at);
        if -here <= HINT * self.least_depth {
            return None;
        }
        let [before, after] = [-ACROSS, ACROSS].map(|far| {
            let far = far * self.reach;
            self.potential.value(&std::array::from_fn(|k| at[k] + far * normal[k]))
        });
        let (rise, bend) = (0.5 * (after - before), before - 2.0 * here + after);
        let offset = -rise / bend;
        let bottom = here + 0.5 * rise * offset;
        let is_near = bend >= LEAST_BEND && offset.abs() * ACROSS <= within;
        (is_near && -bottom > self.least_depth).then_some(bottom)
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
}
