//! d(x) from the features of an image: short edges where they are, long ones where they are not.
//!
//! Three ways, each between a least and a greatest distance:
//! - by their *density* (Hale 2001, Fig. 5), which sees how many there are around;
//! - by the *curvature* of b (Hale 2002, equation 1), which sees how narrow and how bent they are;
//! - by the *distance* to the nearest, which sees where the nearest is.
//!
//! Nodes half the least distance apart are enough for all; see the module above for the limit of the slope.

use super::coarse::{Take, coarse_grid, reduce};
use super::limit::limit_gradient;
use super::{
    DistanceError, GRADIENT_LIMIT, NominalDistance, check_count, check_length, check_limit,
    check_step,
};
use crate::image::{Grid, gaussian, gaussian_derivative};
use crate::parallel::prelude::*;
use serde::{Deserialize, Serialize};

/// The share of the image, where features are densest, that gets the least distance of a grading.
const DENSEST: f64 = 0.2;

/// The share of the samples whose curvature is beyond that which gets the least distance.
const MOST_CURVED: f64 = 0.005;

/// The share of the greatest |b| from which on a sample is one of a feature.
const HALF: f32 = 0.5;

/// The standard deviation by which b is smoothed before it is derived, as a share of the least distance: features
/// are best this narrow, since d is four times their width then (Hale 2002).
const SMOOTHED: f64 = 0.25;

/// The narrowest Gaussian, in samples, whose second derivative still sees the neighbours.
const LEAST_SCALE: f64 = 0.7;

/// What makes d small.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[non_exhaustive]
pub enum GradeBy {
    /// Many features: |b| is smoothed to their density; d falls linearly with it, from the greatest where the
    /// density is least to the least where it is among the greatest fifth.
    /// Source: "a smoothed, scaled, and biased version of the image" (Hale 2001, Fig. 5).
    /// Departure: the paper gives neither the smoothing nor the scale.
    #[default]
    Density,
    /// Narrow or bent features: d = c / √|∇²b|, smoothed with its least value kept (Hale 2002, equation 1). c is
    /// such that the most curved 0.5 % of the samples get the least distance.
    Curvature,
    /// A feature near by: d grows with the distance to the nearest sample of at least half the greatest |b|, by
    /// [`Grading::gradient_limit`] a lattice unit.
    Distance,
}

/// How d follows the features of an image.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct Grading {
    /// The distance where features are densest, most curved or nearest, in lattice units.
    pub min: f64,
    /// The distance where there are none.
    pub max: f64,
    /// What makes d small. Default: the features' density, as in the paper.
    #[serde(default)]
    pub by: GradeBy,
    /// Standard deviation, in lattice units, of the smoothing that turns features into their density, or of that
    /// of d by curvature; by distance there is none. Default: `max` for density, so that d changes over a few
    /// edges (with it Fig. 1 of the paper gets about the distances of its Fig. 5 for 6…18); `min` for curvature.
    #[serde(default)]
    pub smooth: Option<f64>,
    /// The greatest slope of d. Default [`GRADIENT_LIMIT`].
    #[serde(default = "default_limit")]
    pub gradient_limit: f64,
}

fn default_limit() -> f64 {
    GRADIENT_LIMIT
}

impl Grading {
    /// From `min` to `max`, the rest by default.
    pub fn new(min: f64, max: f64) -> Self {
        Self { min, max, by: GradeBy::default(), smooth: None, gradient_limit: GRADIENT_LIMIT }
    }

    /// The standard deviation of the smoothing.
    fn sigma(&self) -> f64 {
        self.smooth.unwrap_or(match self.by {
            GradeBy::Density => self.max,
            GradeBy::Curvature => self.min,
            GradeBy::Distance => 0.0,
        })
    }

    fn check<const D: usize>(&self, grid: &Grid<D>) -> Result<(), DistanceError> {
        let Self { min, max, .. } = *self;
        check_length(min)?;
        check_length(max)?;
        check_step(grid, min)?;
        check_limit(self.gradient_limit)?;
        if min > max {
            return Err(DistanceError::Order { min, max });
        }
        let smooth = self.sigma();
        if smooth.is_finite() && smooth >= 0.0 {
            Ok(())
        } else {
            Err(DistanceError::Smooth { value: smooth })
        }
    }
}

impl<const D: usize> NominalDistance<D> {
    /// Small where the image has features, large where it has none, as [`GradeBy`] says; its slope is limited.
    ///
    /// The sign of b does not matter. A potential that is the same everywhere gets the greatest distance.
    ///
    /// # Errors
    /// [`DistanceError::FieldShape`] unless there is one sample of b per sample of the image; for
    /// the grading [`DistanceError::NotPositive`], [`DistanceError::BelowStep`],
    /// [`DistanceError::Order`], [`DistanceError::GradientLimit`] and [`DistanceError::Smooth`].
    pub fn from_potential(
        grid: &Grid<D>,
        potential: &[f32],
        grading: &Grading,
    ) -> Result<Self, DistanceError> {
        check_count(grid, potential.len())?;
        grading.check(grid)?;
        let nodes = coarse_grid(grid, 0.5 * grading.min);
        let mut values = match grading.by {
            GradeBy::Density => by_density(grid, potential, &nodes, grading),
            GradeBy::Curvature => by_curvature(grid, potential, &nodes, grading),
            GradeBy::Distance => by_distance(grid, potential, &nodes, grading),
        };
        limit_gradient(&mut values, nodes.shape, nodes.step, grading.gradient_limit);
        Ok(Self::new(nodes, values, grid))
    }
}

/// How many features there are around each sample: |b|, smoothed by a Gaussian of the standard deviation `smooth` in
/// lattice units; 0…1 for a potential within −1…1.
///
/// # Errors
/// [`DistanceError::FieldShape`], [`DistanceError::Smooth`].
pub fn feature_density<const D: usize>(
    grid: &Grid<D>,
    potential: &[f32],
    smooth: f64,
) -> Result<Vec<f32>, DistanceError> {
    check_count(grid, potential.len())?;
    if !(smooth.is_finite() && smooth >= 0.0) {
        return Err(DistanceError::Smooth { value: smooth });
    }
    let mut density: Vec<f32> = potential.par_iter().map(|b| b.abs()).collect();
    gaussian(&mut density, grid.shape, grid.step.map(|step| smooth / step));
    Ok(density)
}

fn by_density<const D: usize>(
    grid: &Grid<D>,
    potential: &[f32],
    nodes: &Grid<D>,
    grading: &Grading,
) -> Vec<f32> {
    let Grading { min, max, .. } = *grading;
    let mut values = reduce(potential, grid, nodes, Take::Magnitude);
    gaussian(&mut values, nodes.shape, nodes.step.map(|step| grading.sigma() / step));
    let sparse = values.iter().copied().fold(f32::INFINITY, f32::min);
    let dense = beyond(&values, DENSEST);
    let scale = if dense > sparse { (max - min) / f64::from(dense - sparse) } else { 0.0 };
    for v in &mut values {
        let distance = max - f64::from(*v - sparse) * scale;
        *v = distance.clamp(min, max) as f32;
    }
    values
}

fn by_curvature<const D: usize>(
    grid: &Grid<D>,
    potential: &[f32],
    nodes: &Grid<D>,
    grading: &Grading,
) -> Vec<f32> {
    let Grading { min, max, .. } = *grading;
    let sigma = grid.step.map(|step| (SMOOTHED * min / step).max(LEAST_SCALE));
    let mut laplacian = vec![0.0f32; potential.len()];
    for k in (0..D).filter(|&k| grid.shape[k] > 1) {
        let order = std::array::from_fn(|j| if j == k { 2 } else { 0 });
        let second = gaussian_derivative(potential, grid.shape, sigma, order);
        let scale = (grid.step[k] * grid.step[k]).recip() as f32;
        laplacian.par_iter_mut().zip(second).for_each(|(sum, second)| *sum += scale * second);
    }
    laplacian.par_iter_mut().for_each(|v| *v = v.abs());
    let mut sharp = beyond(&laplacian, MOST_CURVED);
    if sharp == 0.0 {
        sharp = laplacian.iter().copied().fold(0.0, f32::max);
    }
    if sharp == 0.0 {
        return vec![max as f32; nodes.sample_count()];
    }
    let (least, greatest) = (min as f32, max as f32);
    laplacian.par_iter_mut().for_each(|v| {
        *v = (least * (sharp / v.max(f32::MIN_POSITIVE)).sqrt()).clamp(least, greatest);
    });
    let mut values = reduce(&laplacian, grid, nodes, Take::Least);
    let range = |values: &[f32]| {
        values.iter().fold((f32::INFINITY, 0.0f32), |(a, b), &v| (a.min(v), b.max(v)))
    };
    let before = range(&values);
    gaussian(&mut values, nodes.shape, nodes.step.map(|step| grading.sigma() / step));
    let after = range(&values);
    let scale = (before.1 - before.0) / (after.1 - after.0).max(f32::MIN_POSITIVE);
    for v in &mut values {
        *v = (before.0 + (*v - after.0) * scale.min(f32::MAX)).clamp(least, greatest);
    }
    values
}

fn by_distance<const D: usize>(
    grid: &Grid<D>,
    potential: &[f32],
    nodes: &Grid<D>,
    grading: &Grading,
) -> Vec<f32> {
    let deepest = potential.par_iter().map(|b| b.abs()).reduce(|| 0.0, f32::max);
    let (least, greatest) = (grading.min as f32, grading.max as f32);
    let at = |b: &f32| if deepest > 0.0 && b.abs() >= HALF * deepest { least } else { greatest };
    let field: Vec<f32> = potential.par_iter().map(at).collect();
    reduce(&field, grid, nodes, Take::Least)
}

/// The value that only `share` of the values exceed.
fn beyond(values: &[f32], share: f64) -> f32 {
    let mut order = values.to_vec();
    let rank = ((1.0 - share) * (order.len() - 1) as f64) as usize;
    *order.select_nth_unstable_by(rank, f32::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;

    const SQUARE: Grid<2> = Grid { shape: [121, 101], step: [1.0, 1.0] };

    /// A valley of depth 1 along x = 60, of the given width.
    fn valley(width: f64) -> Vec<f32> {
        let b = |i: usize| -(-0.5 * (((i % 121) as f64 - 60.0) / width).powi(2)).exp();
        (0..SQUARE.sample_count()).map(|i| b(i) as f32).collect()
    }

    fn graded(by: GradeBy, potential: &[f32]) -> NominalDistance<2> {
        let grading = Grading { by, ..Grading::new(4.0, 16.0) };
        NominalDistance::from_potential(&SQUARE, potential, &grading).unwrap()
    }

    #[test]
    fn every_grading_is_least_at_the_feature_and_greatest_far_from_it() {
        for by in [GradeBy::Density, GradeBy::Curvature, GradeBy::Distance] {
            let d = graded(by, &valley(1.5));
            assert!((d.least() - 4.0).abs() < 1e-3, "{by:?}: {}", d.least());
            let (near, far) = (d.at(&[60.0, 50.0]), d.at(&[2.0, 50.0]));
            assert!(near < 4.5 && far > 14.0 && d.greatest() <= 16.0, "{by:?}: {near} {far}");
            assert!(d.greatest_slope() <= 1.5 * GRADIENT_LIMIT, "{by:?}: {}", d.greatest_slope());
            let negated: Vec<f32> = valley(1.5).iter().map(|b| -b).collect();
            assert_eq!(graded(by, &negated), d, "{by:?}");
        }
    }

    #[test]
    fn by_distance_d_grows_by_the_limit() {
        let d = graded(GradeBy::Distance, &valley(1.5));
        // half depth is 1.77 samples from the bottom: samples 59…61 are the feature's, and nodes, two samples
        // apart, take it over from a sample beside them
        for offset in [4.0, 10.0, 20.0, 40.0] {
            let expected = 4.0 + GRADIENT_LIMIT * (offset - 1.0);
            let found = d.at(&[60.0 + offset, 50.0]);
            let slack = 2.0 * GRADIENT_LIMIT + 1e-3;
            assert!((found - expected).abs() <= slack, "{offset}: {found} {expected}");
        }
    }

    /// For b = −exp(−s²/2σ²) |∇²b| is 1/σ² at the bottom: d is c σ there.
    #[test]
    fn by_curvature_a_valley_twice_as_wide_gets_twice_the_distance() {
        let mut both = valley(2.0);
        for (i, b) in both.iter_mut().enumerate() {
            let wide = -(-0.5 * (((i % 121) as f64 - 105.0) / 4.0).powi(2)).exp();
            *b += wide as f32;
        }
        let grading = Grading {
            by: GradeBy::Curvature,
            smooth: Some(0.0),
            gradient_limit: 2.0,
            ..Grading::new(2.0, 16.0)
        };
        let d = NominalDistance::from_potential(&SQUARE, &both, &grading).unwrap();
        let (narrow, wide) = (d.at(&[60.0, 50.0]), d.at(&[105.0, 50.0]));
        // smoothed by 0.7 samples a valley of width σ becomes σ/w deep and w = √(σ² + 0.49) wide: 1.88 times; the
        // sampled kernel is a few percent weak, and a node takes the least of the samples around it
        assert!((narrow - 2.0).abs() < 0.1, "{narrow}");
        assert!((wide / narrow - 1.88).abs() < 0.12, "{}", wide / narrow);
    }

    #[test]
    fn nothing_to_see_gives_the_greatest_distance() {
        for by in [GradeBy::Density, GradeBy::Curvature, GradeBy::Distance] {
            let d = graded(by, &vec![0.0; SQUARE.sample_count()]);
            assert!(d.is_constant() && d.least() == 16.0, "{by:?}: {}", d.least());
        }
    }

    #[test]
    fn density_counts_features() {
        let density = feature_density(&SQUARE, &valley(1.0), 10.0).unwrap();
        let at = |x: usize| density[50 * 121 + x];
        // a line of mass √(2π) under a Gaussian of σ² = 10² + 1²
        let expected = (1.0f32 / 101.0).sqrt();
        assert!((at(60) - expected).abs() < 1e-3, "{} {expected}", at(60));
        assert!(at(60) > at(50) && at(50) > at(30));
        let error = feature_density(&SQUARE, &[0.0], 1.0);
        assert!(matches!(error, Err(DistanceError::FieldShape { .. })));
        let error = feature_density(&SQUARE, &valley(1.0), f64::NAN);
        assert!(matches!(error, Err(DistanceError::Smooth { .. })));
    }
}
