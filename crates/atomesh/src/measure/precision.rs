//! How much of the facets that a mesh shows as features lies on features.
//!
//! Recall is the share of features that facets follow, precision the share of facets that follow features. Facets are
//! *selected* as faults are picked from a mesh, by the mean of b along them, and their length (area) counts where they
//! run within τ of a feature. Features are known by points about one sample apart. Each stands for the disc around it
//! that reaches half a sample's diagonal along the feature, so that the discs leave no gap.

use super::MeasureError;
use super::faces::faces;
use super::features::{SampledPotential, check_size};
use super::statistics::sums;
use crate::crests::FeaturePoint;
use crate::geometry::{Point, difference, dot};
use crate::mesh::Mesh;
use crate::parallel::prelude::*;
use crate::watch::{Phase, Watch, check};

/// The mean of b along a facet at or below which it is selected, as for picking faults.
const FACET_THRESHOLD: f64 = -0.2;

/// The most parts of a facet's longest edge.
const MOST_PARTS: usize = 64;

/// What of the selected facets lies on features.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct PrecisionReport {
    /// Facets with a mean of b at or below this are selected.
    pub threshold: f64,
    /// How many facets are selected.
    pub facets_selected: usize,
    /// Their length (2-D) or area (3-D), in samples or their squares.
    pub measure_selected: f64,
    /// The share of this measure within τ of a feature; `None` if no facet is selected.
    pub precision: Option<f64>,
}

/// Which facets are selected, and how near to features they must be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PrecisionOptions {
    /// The nominal distance d in samples; sets τ = max(1, d/10).
    pub size: f64,
    /// Facets with a mean of b at or below this are selected. Default −0.2.
    pub threshold: f64,
}

impl PrecisionOptions {
    /// The defaults for a nominal distance of `size` samples.
    pub fn new(size: f64) -> Self {
        Self { size, threshold: FACET_THRESHOLD }
    }
}

/// How much of the selected facets of `mesh`, in sample coordinates, lies within τ of `features`.
///
/// The mean of b, linear between samples, is taken over points at most a sample apart (half a sample on edges in
/// 2-D). The same at any thread count. Cost: O(area of facets).
///
/// # Errors
/// [`MeasureError`] if there are not as many values as the shape says, the size is not a finite number above 0, or the watch ends
/// the work.
pub fn precision<const D: usize>(
    mesh: &Mesh<D>,
    potential: SampledPotential<'_, D>,
    features: &[FeaturePoint<D>],
    options: PrecisionOptions,
    watch: &mut dyn Watch,
) -> Result<PrecisionReport, MeasureError> {
    let PrecisionOptions { size, threshold } = options;
    check_size(size)?;
    potential.check()?;
    check(watch, Phase::Measure, 0.0, None)?;
    let tau = (0.1 * size).max(1.0);
    let bins = Bins::new(features, potential.shape, tau);
    let facets = faces::<D, D>(mesh);
    check(watch, Phase::Measure, 0.3, None)?;
    // the selected length or area, and the part of it near features, facet by facet
    let found: Vec<Option<[f64; 2]>> = facets
        .par_iter()
        .map_init(Vec::new, |points, facet| {
            let corners = facet.map(|c| mesh.points()[c as usize]);
            spread_over(&corners, points);
            let count = points.len() as f64;
            let mean = points.iter().map(|p| linear(potential, p)).sum::<f64>() / count;
            (mean <= threshold).then(|| {
                let measure = measure(&corners);
                let near = points.iter().filter(|p| bins.is_near(p)).count();
                [measure, measure * near as f64 / count]
            })
        })
        .collect();
    let [all, near] = sums(0..found.len(), &|i| found[i].unwrap_or_default());
    Ok(PrecisionReport {
        threshold,
        facets_selected: found.iter().flatten().count(),
        measure_selected: all,
        precision: (all > 0.0).then(|| near / all),
    })
}

/// Spreads points evenly over a facet: the centroids of the upright ones of n^(D−1) equal parts. With n parts an
/// edge, their barycentric coordinates are (i_k + 1/D)/n for all whole i_k that sum to n − 1.
fn spread_over<const D: usize>(corners: &[Point<D>; D], points: &mut Vec<Point<D>>) {
    points.clear();
    let mut longest = 0.0_f64;
    for (i, a) in corners.iter().enumerate() {
        for b in &corners[..i] {
            let edge = difference(a, b);
            longest = longest.max(dot(&edge, &edge).sqrt());
        }
    }
    let parts_per_sample = if D == 2 { 2.0 } else { 1.0 };
    let parts = ((parts_per_sample * longest).ceil() as usize).clamp(1, MOST_PARTS);
    let share = |count: usize| (count as f64 + 1.0 / D as f64) / parts as f64;
    let last = D - 1;
    // along the last corner but one, and in space along the one before it
    let rows = if D == 2 { 1 } else { parts };
    for row in 0..rows {
        let across = if D == 2 { 0.0 } else { share(row) };
        for i in 0..parts - row {
            let (first, rest) = (share(i), share(parts - 1 - row - i));
            points.push(std::array::from_fn(|k| {
                let sum = first * corners[0][k] + rest * corners[last][k];
                if D == 2 { sum } else { sum + across * corners[last - 1][k] }
            }));
        }
    }
}

/// The length of an edge or the area of a triangle.
fn measure<const D: usize>(corners: &[Point<D>; D]) -> f64 {
    let edge = |i: usize| difference(&corners[i], &corners[0]);
    let u = edge(1);
    if D == 2 {
        return dot(&u, &u).sqrt();
    }
    let v = edge(D - 1);
    0.5 * (dot(&u, &u) * dot(&v, &v) - dot(&u, &v).powi(2)).max(0.0).sqrt()
}

/// b at a point, linear between samples; beyond the image as at its rim.
fn linear<const D: usize>(potential: SampledPotential<'_, D>, p: &Point<D>) -> f64 {
    let SampledPotential { values, shape } = potential;
    let (mut start, mut stride) = (0, 1);
    let (mut strides, mut shares) = ([0; D], [0.0; D]);
    for k in 0..D {
        let x = p[k].clamp(0.0, (shape[k] - 1) as f64);
        let low = (x as usize).min(shape[k].saturating_sub(2));
        start += low * stride;
        shares[k] = x - low as f64;
        strides[k] = if shape[k] > 1 { stride } else { 0 };
        stride *= shape[k];
    }
    let mut sum = 0.0;
    for corner in 0..1 << D {
        let (mut index, mut weight) = (start, 1.0);
        for k in 0..D {
            let high = corner >> k & 1 == 1;
            index += if high { strides[k] } else { 0 };
            weight *= if high { shares[k] } else { 1.0 - shares[k] };
        }
        sum += weight * f64::from(values[index]);
    }
    sum
}

/// Feature points by the cubes that they lie in.
struct Bins<'a, const D: usize> {
    features: &'a [FeaturePoint<D>],
    tau: f64,
    /// The radius of the disc of feature for which a point stands.
    reach: f64,
    side: f64,
    shape: [usize; D],
    /// Those of cube c are `members[starts[c]..starts[c + 1]]`.
    starts: Vec<u32>,
    members: Vec<u32>,
}

impl<'a, const D: usize> Bins<'a, D> {
    fn new(features: &'a [FeaturePoint<D>], shape: [usize; D], tau: f64) -> Self {
        let reach = 0.5 * (D as f64).sqrt();
        let side = tau + reach;
        let shape = shape.map(|n| (n as f64 / side) as usize + 1);
        let count: usize = shape.iter().product();
        let mut bins =
            Self { features, tau, reach, side, shape, starts: vec![0; count + 1], members: vec![] };
        let cubes: Vec<usize> =
            features.iter().map(|point| bins.index(bins.cube(&point.position))).collect();
        for &cube in &cubes {
            bins.starts[cube + 1] += 1;
        }
        for cube in 0..count {
            bins.starts[cube + 1] += bins.starts[cube];
        }
        let mut next = bins.starts.clone();
        bins.members = vec![0; cubes.len()];
        for (member, &cube) in cubes.iter().enumerate() {
            bins.members[next[cube] as usize] = member as u32;
            next[cube] += 1;
        }
        bins
    }

    fn cube(&self, p: &Point<D>) -> [usize; D] {
        std::array::from_fn(|k| ((p[k] / self.side).max(0.0) as usize).min(self.shape[k] - 1))
    }

    fn index(&self, cube: [usize; D]) -> usize {
        (0..D).rev().fold(0, |index, k| index * self.shape[k] + cube[k])
    }

    /// Whether the disc of some feature point passes within τ.
    fn is_near(&self, p: &Point<D>) -> bool {
        let cube = self.cube(p);
        // the point's own cube first: a disc that is near is most often there
        (0..3usize.pow(D as u32)).any(|code| {
            let mut rest = code;
            let mut other = cube;
            for k in 0..D {
                let Some(i) =
                    (cube[k] + (rest + 1) % 3).checked_sub(1).filter(|&i| i < self.shape[k])
                else {
                    return false;
                };
                other[k] = i;
                rest /= 3;
            }
            let at = self.index(other);
            let members = &self.members[self.starts[at] as usize..self.starts[at + 1] as usize];
            members.iter().any(|&member| self.passes(member as usize, p))
        })
    }

    fn passes(&self, member: usize, p: &Point<D>) -> bool {
        let point = &self.features[member];
        let v = difference(p, &point.position);
        let squared = dot(&v, &v);
        if squared > self.side * self.side {
            return false;
        }
        let across = dot(&v, &point.normal);
        let along = (squared - across * across).max(0.0).sqrt();
        let beyond = (along - self.reach).max(0.0);
        across * across + beyond * beyond <= self.tau * self.tau
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::watch::Silent;

    #[test]
    fn points_are_spread_evenly_and_their_mean_is_the_centroid() {
        let triangle = [[0.0, 0.0, 0.0], [3.0, 0.0, 1.0], [0.0, 2.0, 0.0]];
        let mut points = Vec::new();
        spread_over(&triangle, &mut points);
        assert_eq!(points.len(), 10); // four parts of the edge of 3.7
        for k in 0..3 {
            let mean = points.iter().map(|p| p[k]).sum::<f64>() / 10.0;
            assert!((mean - triangle.iter().map(|c| c[k]).sum::<f64>() / 3.0).abs() < 1e-14);
        }
        let mut points = Vec::new();
        spread_over(&[[0.0, 0.0], [1.0, 0.0]], &mut points);
        assert_eq!(points, [[0.75, 0.0], [0.25, 0.0]]);
        assert!((measure(&triangle) - 0.5 * 40f64.sqrt()).abs() < 1e-14);
    }

    #[test]
    fn values_between_samples_are_linear() {
        let b: Vec<f32> =
            (0..24).map(|i| (i % 4 + 10 * (i / 4 % 3) + 100 * (i / 12)) as f32).collect();
        let b = SampledPotential { values: &b, shape: [4, 3, 2] };
        assert_eq!(linear(b, &[1.5, 0.25, 0.5]), 1.5 + 2.5 + 50.0);
        assert_eq!(linear(b, &[9.0, -1.0, 1.0]), 103.0);
    }

    /// Squares of 8 samples, each cut in two, over 32 × 32 samples.
    fn squares() -> Mesh<2> {
        let points = (0..25).map(|i| [(i % 5) as f64 * 8.0, (i / 5) as f64 * 8.0]).collect();
        let corners = (0..16u32).flat_map(|i| {
            let a = i % 4 + 5 * (i / 4);
            [a, a + 1, a + 6, a, a + 6, a + 5]
        });
        Mesh::new(points, corners.collect()).unwrap()
    }

    #[test]
    fn precision_is_the_share_of_what_is_selected_that_is_on_features() {
        // b is −1 on the columns x = 8 and x = 24 of the mesh; a feature is known on the first, up to y = 15.5
        let b: Vec<f32> =
            (0..33 * 33).map(|i| if [8, 24].contains(&(i % 33)) { -1.0 } else { 0.0 }).collect();
        let at =
            |y| FeaturePoint { index: 0, position: [8.2, y], normal: [1.0, 0.0], strength: 1.0 };
        let features: Vec<FeaturePoint<2>> = (0..16).map(|y| at(f64::from(y))).collect();
        let of = |values, size| {
            let b = SampledPotential { values, shape: [33, 33] };
            precision(&squares(), b, &features, PrecisionOptions::new(size), &mut Silent).unwrap()
        };
        let report = of(&b, 8.0);
        // columns alone: rows and diagonals cross the valleys within two samples of 8 or 11
        assert_eq!((report.facets_selected, report.measure_selected), (8, 64.0));
        // the last disc ends at 15 + √2/2, and √(1 − 0.2²) beyond it is within 1: 16.69, and the last of the
        // points, which are half a sample apart, at 16.25 + ¼
        assert_eq!(report.precision, Some(16.5 / 64.0));
        assert!(of(&b, 20.0).precision > report.precision); // τ is 2
        assert_eq!(of(&[0.0; 33 * 33], 8.0).precision, None);
    }

    #[test]
    fn wrong_inputs_are_refused() {
        let error = |count: usize, size| {
            let b = SampledPotential { values: &vec![0.0; count], shape: [4, 4] };
            precision(&squares(), b, &[], PrecisionOptions::new(size), &mut Silent).err()
        };
        let count = MeasureError::SampleCount { shape: vec![4, 4], found: 15 };
        assert_eq!(error(15, 8.0), Some(count));
        assert_eq!(error(16, -1.0), Some(MeasureError::Size { value: -1.0 }));
    }
}
