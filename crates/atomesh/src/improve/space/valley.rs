//! The image along facets: the mean of b over a facet, and how far from it the valley's bottom is.

use crate::fields::ScalarField;
use crate::geometry::{Point, cross, difference, dot};

/// b between samples, linear along each axis whatever the atoms felt: only its value is wanted, often.
pub(super) struct Valley<'a> {
    samples: &'a [f32],
    /// The last sample but one along each axis, and the way to the next in memory, 0 if there is only one.
    last: [usize; 3],
    next: [usize; 3],
    scale: [f64; 3],
    strides: [usize; 3],
    /// The least step of the samples.
    step: f64,
}

/// Barycentric weights of the places where a facet is sampled: their mean is exact for quadratics.
const PLACES: [[f64; 3]; 3] = [
    [2.0 / 3.0, 1.0 / 6.0, 1.0 / 6.0],
    [1.0 / 6.0, 2.0 / 3.0, 1.0 / 6.0],
    [1.0 / 6.0, 1.0 / 6.0, 2.0 / 3.0],
];

/// A place between three points.
#[inline(always)]
fn between(p: &[Point<3>; 3], w: &[f64; 3]) -> Point<3> {
    std::array::from_fn(|k| w[0] * p[0][k] + w[1] * p[1][k] + w[2] * p[2][k])
}

impl<'a> Valley<'a> {
    pub fn new(potential: &'a ScalarField<3>) -> Self {
        let grid = potential.grid();
        let shape = grid.shape;
        let strides = [1, shape[0], shape[0] * shape[1]];
        Self {
            samples: potential.samples(),
            last: shape.map(|n| n.saturating_sub(2)),
            next: std::array::from_fn(|k| if shape[k] > 1 { strides[k] } else { 0 }),
            scale: grid.step.map(|step| 1.0 / step),
            strides,
            step: grid.least_step(),
        }
    }

    /// How deep the valley is at a point: −b, but nothing where b repels.
    #[inline(always)]
    pub fn depth(&self, p: &Point<3>) -> f64 {
        let mut base = 0;
        let mut t = [0.0_f32; 3];
        for k in 0..3 {
            let s = p[k] * self.scale[k];
            let i = (s as u32 as usize).min(self.last[k]);
            t[k] = ((s - i as f64) as f32).clamp(0.0, 1.0);
            base += i * self.strides[k];
        }
        let next = &self.next;
        let row = |at: usize| {
            let (a, b) = (self.samples[at], self.samples[at + next[0]]);
            a + t[0] * (b - a)
        };
        let page = |at: usize| {
            let (a, b) = (row(at), row(at + next[1]));
            a + t[1] * (b - a)
        };
        let (a, b) = (page(base), page(base + next[2]));
        f64::from(-(a + t[2] * (b - a))).max(0.0)
    }

    /// The mean depth along a facet.
    #[inline(always)]
    pub fn mean(&self, facet: &[Point<3>; 3]) -> f64 {
        PLACES.iter().map(|w| self.depth(&between(facet, w))).sum::<f64>() / PLACES.len() as f64
    }

    /// The mean depth along a facet, whose depths widen a contrast.
    #[inline(always)]
    pub fn mean_of(&self, facet: &[Point<3>; 3], contrast: &mut Contrast) -> f64 {
        let depths = PLACES.map(|w| self.depth(&between(facet, &w)));
        depths.iter().for_each(|&depth| contrast.include(depth));
        depths.iter().sum::<f64>() / PLACES.len() as f64
    }

    /// What a facet is worth: its area times the fourth power of its mean depth, which prefers one facet within a
    /// valley to two that cross it or lie beside its bottom.
    #[inline(always)]
    pub fn worth(&self, facet: &[Point<3>; 3], contrast: &Contrast) -> f64 {
        worth(facet, self.mean(facet), contrast)
    }

    /// Adds to a least-squares system for the move of the facet's first corner: along the facet's normal, the
    /// places where it is sampled are to come to the valley's bottom, each moving by its share of the corner's move.
    ///
    /// The step is Newton's for the area times the square of the depth, in a valley with the profile of a Gaussian.
    /// That energy grows with the area, which draws a curved surface outward by σ² times its mean curvature: just
    /// what blur of the width σ has drawn the valley inward by (Verbeek & van Vliet 1994).
    pub fn pull(&self, facet: &[Point<3>; 3], mean: f64, contrast: &Contrast, system: &mut System) {
        let mean = contrast.of(mean);
        let normal = normal(facet);
        let length = dot(&normal, &normal).sqrt();
        if mean < LEAST_MEAN || length == 0.0 {
            return;
        }
        let normal = normal.map(|x| x / length);
        let mut spread = 0.0;
        let mut wishes = [(0.0, 0.0, 0.0); PLACES.len()];
        for (wish, w) in wishes.iter_mut().zip(&PLACES) {
            let bottom = self.bottom(&between(facet, w), &normal, contrast);
            if bottom.variance == 0.0 {
                return; // the valley runs through the facet, not along it
            }
            let weight = 0.5 * length * mean * mean * contrast.of(bottom.depth);
            spread += weight * bottom.variance;
            *wish = (w[0], bottom.offset, weight);
        }
        for (share, offset, weight) in wishes {
            system.add(&normal, share, offset, weight);
        }
        // the area's gradient is half the far edge turned by a right angle; ∂A weighs as A does
        let growth = cross(&difference(&facet[2], &facet[1]), &normal);
        system.grow(&normal, &growth.map(|x| -0.5 * x * spread / length));
    }

    /// The move from a point straight down the slope to the valley's bottom, at most `reach` away.
    pub fn fall(&self, p: &Point<3>, reach: f64) -> Option<Point<3>> {
        let h = 0.5 * self.step;
        let slope: Point<3> = std::array::from_fn(|k| {
            let (mut low, mut high) = (*p, *p);
            low[k] -= h;
            high[k] += h;
            self.depth(&high) - self.depth(&low)
        });
        let length = dot(&slope, &slope).sqrt();
        if length < LEAST_SLOPE {
            return None;
        }
        let along = slope.map(|x| x / length);
        let depth_at = |offset: f64| self.depth(&std::array::from_fn(|k| p[k] + offset * along[k]));
        let (mut before, mut here, mut offset) = (depth_at(0.0), depth_at(self.step), self.step);
        if here <= before {
            return None;
        }
        while offset < reach {
            let after = depth_at(offset + self.step);
            if after <= here {
                let bend = before - 2.0 * here + after;
                let shift = if bend < 0.0 { 0.5 * (before - after) / bend } else { 0.0 };
                offset += self.step * shift.clamp(-0.5, 0.5);
                return Some(along.map(|x| offset * x));
            }
            (before, here, offset) = (here, after, offset + self.step);
        }
        None
    }

    /// The deepest place along a direction, within two steps.
    fn bottom(&self, p: &Point<3>, direction: &Point<3>, contrast: &Contrast) -> Bottom {
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
        // from a Gaussian's middle to two steps to both sides of it
        let ratio =
            2.0 * contrast.of(depths[deepest]) / (contrast.of(depths[0]) + contrast.of(depths[4]));
        let variance = if ratio > PROMINENT { 2.0 / ratio.min(SHARPEST).ln() } else { 0.0 };
        let step = self.step;
        Bottom { offset: offset * step, depth: depths[deepest], variance: variance * step * step }
    }
}

/// The bottom of a valley along a line.
struct Bottom {
    /// How far it is.
    offset: f64,
    depth: f64,
    /// The square of the valley's width, as that of a Gaussian; 0 if it is not seen.
    variance: f64,
}

/// Twice the area of a facet, along its normal.
#[inline(always)]
fn normal(facet: &[Point<3>; 3]) -> Point<3> {
    cross(&difference(&facet[1], &facet[0]), &difference(&facet[2], &facet[0]))
}

/// See [`Valley::worth`].
#[inline(always)]
pub(super) fn worth(facet: &[Point<3>; 3], mean: f64, contrast: &Contrast) -> f64 {
    let mean = contrast.of(mean);
    let normal = normal(facet);
    0.5 * dot(&normal, &normal).sqrt() * (mean * mean).powi(2)
}

/// Facets of a lesser mean, between the least and the greatest depth around, are not drawn to a valley.
const LEAST_MEAN: f64 = 0.3;

/// A lesser slope across a step has no direction.
const LEAST_SLOPE: f64 = 1e-3;

/// Where no place is deeper there is no feature.
pub(super) const LEAST_DEPTH: f64 = 0.2;

/// Less than this between the least and the greatest depth is noise.
const LEAST_CONTRAST: f64 = 0.15;

/// The least and the greatest depth around a place: weak features count as much as strong ones elsewhere.
#[derive(Clone, Copy, Debug)]
pub(super) struct Contrast {
    pub low: f64,
    pub high: f64,
}

impl Contrast {
    pub const NONE: Self = Self { low: f64::INFINITY, high: 0.0 };

    pub fn include(&mut self, depth: f64) {
        (self.low, self.high) = (self.low.min(depth), self.high.max(depth));
    }

    /// A depth between the least, 0, and the greatest, 1.
    #[inline(always)]
    pub fn of(&self, depth: f64) -> f64 {
        ((depth - self.low) / (self.high - self.low).max(LEAST_CONTRAST)).max(0.0)
    }
}

/// The normal equations of a least-squares fit of one point's move.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct System {
    matrix: [[f64; 3]; 3],
    right: [f64; 3],
    weight: f64,
    /// The facets' normals, all to one side, and how their areas grow.
    normal: Point<3>,
    growth: Point<3>,
    count: f64,
}

/// The facets' normals agree if their sum is this share of its greatest length, squared.
const AGREED: f64 = 0.9;
/// A valley's profile falls by this much within two steps to its sides, or it is none.
const PROMINENT: f64 = 1.6;
/// What is deeper by more than this share is not told from background.
const SHARPEST: f64 = 50.0;

impl System {
    /// Adds the wish that `share` of the move, along a unit vector, be `offset`.
    #[inline]
    fn add(&mut self, along: &Point<3>, share: f64, offset: f64, weight: f64) {
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
    fn grow(&mut self, normal: &Point<3>, growth: &Point<3>) {
        self.count += 1.0;
        let sign = if dot(&self.normal, normal) < 0.0 { -1.0 } else { 1.0 };
        for k in 0..3 {
            self.normal[k] += sign * normal[k];
            self.growth[k] += growth[k];
        }
    }

    /// The move, damped where wishes say nothing; along axes of `freedom` only.
    pub fn solve(&self, freedom: u8) -> Option<Point<3>> {
        if self.weight == 0.0 {
            return None;
        }
        let mut a = self.matrix;
        let mut right = self.right;
        let square = dot(&self.normal, &self.normal);
        let lift = dot(&self.growth, &self.normal) / square;
        if square > AGREED * self.count * self.count && lift.is_finite() {
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

/// The share of the wishes' weight that keeps a point where it is.
const DAMPING: f64 = 0.05;
