//! How deep b's valleys are: at points, and along facets.

use crate::fields::ScalarField;
use crate::geometry::{Point, cross, difference, dot};

/// Where nothing is deeper than this there is no feature.
pub(super) const LEAST_DEPTH: f64 = 0.2;
/// A difference of less than this between the least and the greatest depth is noise.
const LEAST_CONTRAST: f64 = 0.15;
/// A difference of depths across a step that is less than this has no direction.
const LEAST_SLOPE: f64 = 1e-3;

/// The depth −b between samples, 0 where b repels. Linear along each axis, however the atoms read b: only the value
/// is wanted, often.
pub(super) struct DepthField<'a> {
    samples: &'a [f32],
    /// The last sample but one along each axis, and the stride to the next sample, 0 if there is only one.
    last: [usize; 3],
    next: [usize; 3],
    scale: [f64; 3],
    strides: [usize; 3],
    /// The least step of the samples.
    pub step: f64,
}

/// Barycentric weights of the places where a facet is sampled: their mean is exact for quadratics.
pub(super) const PLACES: [[f64; 3]; 3] = [
    [2.0 / 3.0, 1.0 / 6.0, 1.0 / 6.0],
    [1.0 / 6.0, 2.0 / 3.0, 1.0 / 6.0],
    [1.0 / 6.0, 1.0 / 6.0, 2.0 / 3.0],
];

/// A place between three points.
#[inline(always)]
pub(super) fn between(p: &[Point<3>; 3], w: &[f64; 3]) -> Point<3> {
    std::array::from_fn(|k| w[0] * p[0][k] + w[1] * p[1][k] + w[2] * p[2][k])
}

impl<'a> DepthField<'a> {
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

    /// The depth at a point.
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
    pub fn mean_depth(&self, facet: &[Point<3>; 3]) -> f64 {
        PLACES.iter().map(|w| self.depth(&between(facet, w))).sum::<f64>() / PLACES.len() as f64
    }

    /// The mean depth along a facet, whose depths widen the contrast.
    #[inline(always)]
    pub fn mean_depth_within(&self, facet: &[Point<3>; 3], contrast: &mut Contrast) -> f64 {
        let depths = PLACES.map(|w| self.depth(&between(facet, &w)));
        depths.iter().for_each(|&depth| contrast.include(depth));
        depths.iter().sum::<f64>() / PLACES.len() as f64
    }

    /// What a facet is worth: its area times the fourth power of its mean depth, relative to the contrast. The power
    /// prefers one facet within a valley to two that cross it or lie beside its bottom.
    #[inline(always)]
    pub fn worth(&self, facet: &[Point<3>; 3], contrast: &Contrast) -> f64 {
        worth(facet, self.mean_depth(facet), contrast)
    }

    /// The move from a point straight down the slope to the valley's bottom, if that is within about `reach`.
    pub fn shift_to_bottom(&self, p: &Point<3>, reach: f64) -> Option<Point<3>> {
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
}

/// Twice the area of a facet, along its normal.
#[inline(always)]
pub(super) fn normal(facet: &[Point<3>; 3]) -> Point<3> {
    cross(&difference(&facet[1], &facet[0]), &difference(&facet[2], &facet[0]))
}

/// See [`DepthField::worth`].
#[inline(always)]
pub(super) fn worth(facet: &[Point<3>; 3], mean: f64, contrast: &Contrast) -> f64 {
    let mean = contrast.relative(mean);
    let normal = normal(facet);
    0.5 * dot(&normal, &normal).sqrt() * (mean * mean).powi(2)
}

/// The least and the greatest depth around a place. Relative to them, weak features count as much as strong ones
/// elsewhere.
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

    /// A depth relative to the contrast: 0 at the least, 1 at the greatest.
    #[inline(always)]
    pub fn relative(&self, depth: f64) -> f64 {
        ((depth - self.low) / (self.high - self.low).max(LEAST_CONTRAST)).max(0.0)
    }
}
