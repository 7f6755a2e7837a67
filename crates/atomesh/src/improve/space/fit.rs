//! Fitting a point's facets to the valley that they lie along, by least squares.

use super::depth::{Contrast, DepthField, PLACES, between, normal};
use crate::geometry::{Point, cross, difference, dot};

/// Facets of a lesser mean depth, relative to the contrast, are not drawn to a valley.
const LEAST_MEAN: f64 = 0.3;
/// The facets' normals agree if the square of their sum is this share of what it would be if all were equal.
const AGREED: f64 = 0.9;
/// The least ratio of the depth at a valley's bottom to that two steps to its sides.
const LEAST_RATIO: f64 = 1.6;
/// The greatest such ratio that says something of the valley's width.
const GREATEST_RATIO: f64 = 50.0;
/// The weight that keeps a point where it is, as a share of the fit's.
const DAMPING: f64 = 0.05;

/// A least-squares fit of one point's move, by its normal equations.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct MoveFit {
    matrix: [[f64; 3]; 3],
    right: [f64; 3],
    weight: f64,
    /// The sum of the facets' normals, all turned to one side.
    normal: Point<3>,
    /// The sum of the gradients of their areas, weighted.
    growth: Point<3>,
    facet_count: f64,
}

/// One equation of a fit: a share of the move, along a unit vector, is to be `offset`.
#[derive(Clone, Copy, Default)]
struct Equation {
    share: f64,
    offset: f64,
    weight: f64,
}

impl MoveFit {
    #[inline]
    fn add(&mut self, along: &Point<3>, equation: Equation) {
        let Equation { share, offset, weight } = equation;
        for r in 0..3 {
            for c in 0..3 {
                self.matrix[r][c] += weight * share * share * along[r] * along[c];
            }
            self.right[r] += weight * share * offset * along[r];
        }
        self.weight += weight * share * share;
    }

    /// Adds how a facet's worth grows with its area.
    #[inline]
    fn add_growth(&mut self, normal: &Point<3>, growth: &Point<3>) {
        self.facet_count += 1.0;
        let sign = if dot(&self.normal, normal) < 0.0 { -1.0 } else { 1.0 };
        for k in 0..3 {
            self.normal[k] += sign * normal[k];
            self.growth[k] += growth[k];
        }
    }

    /// The move, along axes of `freedom` only; damped where no equation says anything. `None` if there are none.
    pub fn solve(&self, freedom: u8) -> Option<Point<3>> {
        if self.weight == 0.0 {
            return None;
        }
        let mut a = self.matrix;
        let mut right = self.right;
        let square = dot(&self.normal, &self.normal);
        let lift = dot(&self.growth, &self.normal) / square;
        if square > AGREED * self.facet_count * self.facet_count && lift.is_finite() {
            (0..3).for_each(|k| right[k] += lift * self.normal[k]);
        }
        for k in 0..3 {
            a[k][k] += DAMPING * self.weight;
            if freedom >> k & 1 == 0 {
                for j in 0..3 {
                    (a[k][j], a[j][k]) = (0.0, 0.0);
                }
                (a[k][k], right[k]) = (1.0, 0.0);
            }
        }
        // Cramer's rule: the damping keeps the matrix far from singular
        let c = [cross(&a[1], &a[2]), cross(&a[2], &a[0]), cross(&a[0], &a[1])];
        let determinant = dot(&a[0], &c[0]);
        let x: Point<3> = std::array::from_fn(|k| {
            (right[0] * c[0][k] + right[1] * c[1][k] + right[2] * c[2][k]) / determinant
        });
        x.iter().all(|x| x.is_finite()).then_some(x)
    }
}

impl DepthField<'_> {
    /// Adds a facet to the fit of its first corner's move: along the facet's normal, the places where it is sampled
    /// are to come to the valley's bottom. Each moves by its share of the corner's move.
    ///
    /// The step is Newton's for the area times the square of the depth, in a valley with the profile of a Gaussian.
    /// That energy grows with the area, which draws a curved surface outward by σ² times its mean curvature. Blur of
    /// width σ has drawn the valley inward by as much (Verbeek & van Vliet 1994).
    pub fn fit_facet(
        &self,
        facet: &[Point<3>; 3],
        mean: f64,
        contrast: &Contrast,
        fit: &mut MoveFit,
    ) {
        let mean = contrast.relative(mean);
        let normal = normal(facet);
        let length = dot(&normal, &normal).sqrt();
        if mean < LEAST_MEAN || length == 0.0 {
            return;
        }
        let normal = normal.map(|x| x / length);
        let mut spread = 0.0;
        let mut equations = [Equation::default(); PLACES.len()];
        for (equation, w) in equations.iter_mut().zip(&PLACES) {
            let profile = self.profile(&between(facet, w), &normal, contrast);
            if profile.variance == 0.0 {
                return; // the valley runs through the facet, not along it
            }
            let weight = 0.5 * length * mean * mean * contrast.relative(profile.depth);
            spread += weight * profile.variance;
            *equation = Equation { share: w[0], offset: profile.offset, weight };
        }
        for equation in equations {
            fit.add(&normal, equation);
        }
        // the area's gradient is half the far edge turned by a right angle; ∂A weighs as A does
        let growth = cross(&difference(&facet[2], &facet[1]), &normal);
        fit.add_growth(&normal, &growth.map(|x| -0.5 * x * spread / length));
    }

    /// The valley along a direction, within two steps.
    fn profile(&self, p: &Point<3>, direction: &Point<3>, contrast: &Contrast) -> Profile {
        let mut depths = [0.0; 5];
        for (n, depth) in depths.iter_mut().enumerate() {
            let offset = (n as f64 - 2.0) * self.step;
            *depth = self.depth(&std::array::from_fn(|k| p[k] + offset * direction[k]));
        }
        let deepest = (0..5).fold(2, |best, n| if depths[n] > depths[best] { n } else { best });
        let mut offset = deepest as f64 - 2.0;
        if (1..4).contains(&deepest) {
            let (a, b, c) = (depths[deepest - 1], depths[deepest], depths[deepest + 1]);
            let bend = a - 2.0 * b + c;
            if bend < 0.0 {
                offset += (0.5 * (a - c) / bend).clamp(-0.5, 0.5);
            }
        }
        // of a Gaussian, exp(2/σ²) with σ in steps
        let ratio = 2.0 * contrast.relative(depths[deepest])
            / (contrast.relative(depths[0]) + contrast.relative(depths[4]));
        let variance = if ratio > LEAST_RATIO { 2.0 / ratio.min(GREATEST_RATIO).ln() } else { 0.0 };
        let step = self.step;
        Profile { offset: offset * step, depth: depths[deepest], variance: variance * step * step }
    }
}

/// A valley along a line.
struct Profile {
    /// How far its bottom is.
    offset: f64,
    /// The depth there.
    depth: f64,
    /// The variance of the Gaussian that has its width; 0 if the profile shows no valley.
    variance: f64,
}
