//! Scaling of samples: where the background is, and where a full feature.

use super::quantile::Order;
use super::{BLOCK, EnhanceError, Enhanced};
use crate::image::Samples;
use rayon::prelude::*;

/// Of the samples darker (brighter) than the background, the share that is clipped to −1.
const CLIPPED_FEATURES: f64 = 0.02;

/// An image's samples, moved and scaled to 0…1 as they are read, so that neither their offset nor
/// their size meets the limits of single precision.
pub(super) struct UnitSamples<'a> {
    samples: &'a Samples,
    /// Half the least sample and half the range: halves, lest the range overflows.
    half_min: f64,
    half_range: f64,
    scale: f64,
}

impl<'a> UnitSamples<'a> {
    pub(super) fn new(samples: &'a Samples) -> Result<Self, EnhanceError> {
        let range = samples.range();
        let count = range.nan_count + range.infinite_count;
        if count > 0 {
            let first =
                (0..samples.len()).find(|&i| !samples.get(i).is_finite()).unwrap_or_default();
            return Err(EnhanceError::NotFinite { count, first, value: samples.get(first) });
        }
        let half_min = 0.5 * range.min;
        let half_range = 0.5 * range.max - half_min;
        Ok(Self { samples, half_min, half_range, scale: half_range.recip() })
    }

    pub(super) fn len(&self) -> usize {
        self.samples.len()
    }

    pub(super) fn is_constant(&self) -> bool {
        self.half_range < f64::MIN_POSITIVE // the reciprocal of less would overflow
    }

    pub(super) fn fill(&self, start: usize, out: &mut [f32]) {
        let (min, scale) = (self.half_min, self.scale);
        self.samples.map_into(start, out, |s| ((0.5 * s - min) * scale) as f32);
    }

    fn order(&self) -> Order<impl Fn(usize, &mut [f32]) + Sync> {
        Order::new(self.len(), |start, out: &mut [f32]| self.fill(start, out))
    }

    pub(super) fn map(&self, ramp: &Ramp) -> Enhanced {
        let mut values = vec![0.0; self.len()];
        values.par_chunks_mut(BLOCK).enumerate().for_each(|(block, out)| {
            self.fill(block * BLOCK, out);
            ramp.apply(out);
        });
        Enhanced { values, constant: false }
    }
}

/// A straight line from the background, b = 0, to a full feature, b = −1, clipped at both.
pub(super) struct Ramp {
    pub(super) background: f32,
    pub(super) feature: f32,
}

impl Ramp {
    pub(super) fn dark(unit: &UnitSamples) -> Self {
        let order = unit.order();
        let median = order.ranked(unit.len() / 2);
        if median.below == 0 {
            return Self { background: 1.0, feature: 0.0 };
        }
        let clipped = (CLIPPED_FEATURES * median.below as f64) as usize;
        Self { background: median.value, feature: order.ranked(clipped).value }
    }

    pub(super) fn bright(unit: &UnitSamples) -> Self {
        let order = unit.order();
        let median = order.ranked(unit.len() / 2);
        if median.above == 0 {
            return Self { background: 0.0, feature: 1.0 };
        }
        let clipped = (CLIPPED_FEATURES * median.above as f64) as usize;
        Self { background: median.value, feature: order.ranked(unit.len() - 1 - clipped).value }
    }

    pub(super) fn apply(&self, values: &mut [f32]) {
        let depth = self.feature - self.background; // its sign says which side
        for v in values {
            *v = (-(*v - self.background) / depth).clamp(-1.0, 0.0);
        }
    }
}
