//! Image samples as greys, and pixels in colour.

use atomesh::image::Samples;

use crate::style::Color;

/// The share of samples beyond each end of the range of greys.
const CUT: f64 = 0.005;

/// The most samples from which the range is found.
const RANGE_SAMPLES: usize = 1 << 16;

/// Greys on a grid of `columns` × `rows`, row 0 on top.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Raster {
    pub columns: usize,
    pub rows: usize,
    pub greys: Vec<u8>,
}

/// Colours on a grid of `columns` × `rows`, row 0 on top.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ColorRaster {
    pub columns: usize,
    pub rows: usize,
    pub colors: Vec<Color>,
}

/// Maps sample values to greys.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ramp {
    low: f64,
    high: f64,
    brightest: f64,
}

impl Ramp {
    /// From black at the 0.5th percentile of the finite samples to `brightness` at the 99.5th; from the least to the
    /// greatest sample if the two are equal, as in sparse images.
    pub fn robust(samples: &Samples, brightness: f64) -> Self {
        let stride = samples.len().div_ceil(RANGE_SAMPLES).max(1);
        let chosen = (0..samples.len()).step_by(stride).map(|i| samples.get(i));
        let mut seen: Vec<f64> = chosen.filter(|s| s.is_finite()).collect();
        seen.sort_unstable_by(f64::total_cmp);
        let cut = (seen.len() as f64 * CUT) as usize;
        let (mut low, mut high) = match seen.len() {
            0 => (0.0, 0.0),
            n => (seen[cut], seen[n - 1 - cut]),
        };
        if low >= high {
            let range = samples.range();
            (low, high) = (range.min, range.max);
        }
        Self { low, high, brightest: 255.0 * brightness }
    }

    /// The grey of a sample; black for NaN, a middle grey if all samples are equal.
    pub fn grey(&self, sample: f64) -> u8 {
        let share =
            if self.high > self.low { (sample - self.low) / (self.high - self.low) } else { 0.5 };
        (share.clamp(0.0, 1.0) * self.brightest).round() as u8 // NaN as u8 is 0
    }

    /// The greys of the samples `index(column, row)`.
    pub fn raster(
        &self,
        samples: &Samples,
        columns: usize,
        rows: usize,
        index: impl Fn(usize, usize) -> usize,
    ) -> Raster {
        let mut greys = Vec::with_capacity(columns * rows);
        for row in 0..rows {
            greys.extend((0..columns).map(|column| self.grey(samples.get(index(column, row)))));
        }
        Raster { columns, rows, greys }
    }
}
