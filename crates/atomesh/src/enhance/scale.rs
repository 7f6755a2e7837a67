//! Scaling of samples: where the background is, and where a full feature.

use super::edges::edges;
use super::quantile::{Levels, Order, Ranks};
use super::{EnhanceError, Enhanced, FeatureOptions, Features};
use crate::image::{Image, Samples, gaussian_between};
use crate::parallel::prelude::*;
use crate::watch::{Phase, Watch, check};

/// Of the samples darker (brighter) than the background, the share that is clipped to −1.
const CLIPPED_FEATURES: f64 = 0.02;

/// Samples that one task maps.
const BLOCK: usize = 1 << 16;

/// An image's samples, moved and scaled to 0…1 while they are read, so that neither their offset nor
/// their size meets the limits of single precision.
pub(super) struct UnitSamples<'a> {
    samples: &'a Samples,
    /// Half the least sample, and half the range: the whole might overflow.
    half_min: f64,
    half_range: f64,
    scale: f64,
    /// What each value of 8-bit samples becomes, from the least on; empty for other samples.
    levels: Vec<f32>,
}

/// The place of a signed byte among all of them, in ascending order.
fn signed_place(s: i8) -> u8 {
    s as u8 ^ 0x80
}

/// The same for a signed 16-bit integer.
fn signed_place_16(s: i16) -> u16 {
    s as u16 ^ 0x8000
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
        let scale = half_range.recip();
        let mut unit = Self { samples, half_min, half_range, scale, levels: Vec::new() };
        unit.levels = match samples {
            Samples::U8(_) => (0..=u8::MAX).map(|s| unit.of(s.into())).collect(),
            Samples::I8(_) => (i8::MIN..=i8::MAX).map(|s| unit.of(s.into())).collect(),
            _ => Vec::new(),
        };
        Ok(unit)
    }

    pub(super) fn len(&self) -> usize {
        self.samples.len()
    }

    pub(super) fn is_constant(&self) -> bool {
        self.half_range < f64::MIN_POSITIVE // the reciprocal of less would overflow
    }

    /// What a sample becomes.
    #[inline]
    fn of(&self, sample: f64) -> f32 {
        ((0.5 * sample - self.half_min) * self.scale) as f32
    }

    pub(super) fn fill(&self, start: usize, out: &mut [f32]) {
        let within = start..start + out.len();
        match self.samples {
            Samples::U8(v) => self.look_up(&v[within], out, |s| s),
            Samples::I8(v) => self.look_up(&v[within], out, signed_place),
            others => others.map_into(start, out, |s| self.of(s)),
        }
    }

    #[inline]
    fn look_up<T: Copy>(&self, samples: &[T], out: &mut [f32], place: impl Fn(T) -> u8) {
        let Ok(levels) = <&[f32; 256]>::try_from(self.levels.as_slice()) else { return };
        for (out, &s) in out.iter_mut().zip(samples) {
            *out = levels[usize::from(place(s))];
        }
    }

    fn ranks(&self) -> Box<dyn Ranks + '_> {
        match self.samples {
            Samples::U8(v) => Box::new(Levels::new(v, u16::from, self.levels.clone())),
            Samples::I8(v) => {
                let place = |s| signed_place(s).into();
                Box::new(Levels::new(v, place, self.levels.clone()))
            }
            Samples::U16(v) => {
                let values = (0..=u16::MAX).map(|s| self.of(s.into())).collect();
                Box::new(Levels::new(v, |s| s, values))
            }
            Samples::I16(v) => {
                let values = (i16::MIN..=i16::MAX).map(|s| self.of(s.into())).collect();
                Box::new(Levels::new(v, signed_place_16, values))
            }
            _ => Box::new(Order::new(self.len(), |start, out: &mut [f32]| self.fill(start, out))),
        }
    }
}

/// A straight line from the background, b = 0, to a full feature, b = −1, clipped at both.
pub(super) struct Ramp {
    pub(super) background: f32,
    pub(super) feature: f32,
}

impl Ramp {
    pub(super) fn dark(unit: &UnitSamples) -> Self {
        let order = unit.ranks();
        let median = order.ranked(unit.len() / 2);
        if median.below == 0 {
            return Self { background: 1.0, feature: 0.0 };
        }
        let clipped = (CLIPPED_FEATURES * median.below as f64) as usize;
        Self { background: median.value, feature: order.ranked(clipped).value }
    }

    pub(super) fn bright(unit: &UnitSamples) -> Self {
        let order = unit.ranks();
        let median = order.ranked(unit.len() / 2);
        if median.above == 0 {
            return Self { background: 0.0, feature: 1.0 };
        }
        let clipped = (CLIPPED_FEATURES * median.above as f64) as usize;
        Self { background: median.value, feature: order.ranked(unit.len() - 1 - clipped).value }
    }

    /// Turns unit samples into b times `sign`, 1 or −1.
    pub(super) fn apply(&self, values: &mut [f32], sign: f32) {
        let depth = self.feature - self.background; // its sign says which side
        for v in values {
            // no −0
            *v = sign * (-(*v - self.background) / depth).clamp(-1.0, 0.0) + 0.0;
        }
    }
}

/// The potential of dark or bright places, or of gradients: straight lines of the samples, clipped and smoothed.
pub(super) fn scaled<const D: usize>(
    unit: &UnitSamples,
    image: &Image<D>,
    options: &FeatureOptions,
    watch: &mut dyn Watch,
) -> Result<Enhanced<D>, EnhanceError> {
    let zeros = || vec![0.0; unit.len()];
    let shown = match options.features {
        Features::None => None,
        _ if unit.is_constant() => None,
        Features::Dark => Some((zeros(), Ramp::dark(unit))),
        Features::Bright => Some((zeros(), Ramp::bright(unit))),
        _ => edges(unit, image, options, watch)?,
    };
    check(watch, Phase::Potential, 0.8, None)?;
    let constant = shown.is_none() && options.features != Features::None;
    let Some((mut values, ramp)) = shown else {
        return Ok(Enhanced { values: zeros(), constant, crests: None });
    };
    let sign = if options.repel { -1.0 } else { 1.0 };
    let scale = |start, part: &mut [f32]| {
        if options.features != Features::Edges {
            unit.fill(start, part);
        }
        ramp.apply(part, sign);
    };
    let (least, greatest) = if options.repel { (0.0, 1.0) } else { (-1.0, 0.0) };
    let clip = |part: &mut [f32]| {
        for b in part {
            *b = b.clamp(least, greatest) + 0.0; // rounding may leave the range; no −0
        }
    };
    let grid = image.frame().grid(options.units);
    let sigma = options.sigma(&grid);
    if sigma[0] > 0.0 {
        gaussian_between(&mut values, grid.shape, sigma, scale, clip);
    } else {
        let parts = values.par_chunks_mut(BLOCK).enumerate();
        parts.for_each(|(block, part)| scale(block * BLOCK, part));
    }
    check(watch, Phase::Potential, 1.0, None)?;
    Ok(Enhanced { values, constant, crests: None })
}
