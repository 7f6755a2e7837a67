//! Horizons: the reflections of raw seismic amplitudes, as lines (2-D) and sheets (3-D).
//!
//! In this order:
//!
//! 1. the normals of the layers, from the structure tensor (Hale 2002);
//! 2. peaks, troughs or both of the amplitudes along the normal, between samples;
//! 3. their strength over that of the amplitudes about them, so that weak deep reflections count;
//! 4. groups of crests that are strong somewhere, nowhere faint, and large enough.

use super::crossings::{Polarity, Row, Unit, crossings, scale_strengths};
use super::ridges::least_count;
use super::{EnhanceError, LEAST_EDGE_SCALE, LONGEST, MOST_EXTENT, within};
use crate::crests::{FeaturePoint, Hysteresis, linked};
use crate::image::{CellAverages, Entries, Grid, Stencil, Stream, StructureTensor};
use crate::watch::{Phase, Watch, check};
use serde::{Deserialize, Serialize};

/// Amplitudes about a reflection are taken to be at least this share of the image's range, lest silence is made
/// as loud as layers.
const LEAST_DEVIATION: f32 = 0.005;

/// How horizons are found.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
pub struct HorizonOptions {
    /// Which reflections: peaks (bright), troughs (dark) or both. Default: peaks.
    pub polarity: Polarity,
    /// Standard deviation of the Gaussian whose derivatives are taken, in least steps. Default 1: reflections are a few
    /// samples apart.
    pub scale: f64,
    /// Standard deviation of the Gaussian that smooths the structure tensor, and of the one that takes the
    /// strength of amplitudes about a reflection, in least steps. Default 8: narrower than faults are apart, wider than a
    /// wavelength.
    pub normal_scale: f64,
    /// Whether strengths are relative to those about them. Default: they are.
    pub balanced: bool,
    /// How strong crests must be, 0…1, where 1 is the 98th percentile. Default 0.15.
    pub low: f32,
    /// How strong a group of crests must be somewhere, 0…1. Default 0.4.
    pub high: f32,
    /// The least length of a line, in samples; the least area of a sheet is its square. Default 20.
    pub least_length: f64,
}

impl Default for HorizonOptions {
    fn default() -> Self {
        Self {
            polarity: Polarity::default(),
            scale: 1.0,
            normal_scale: 8.0,
            balanced: true,
            low: 0.15,
            high: 0.4,
            least_length: 20.0,
        }
    }
}

impl HorizonOptions {
    /// Refuses what is out of range.
    fn check(&self) -> Result<(), EnhanceError> {
        within(
            "horizons",
            &[
                ("scale", self.scale, LEAST_EDGE_SCALE, LONGEST),
                ("normal-scale", self.normal_scale, LEAST_EDGE_SCALE, LONGEST),
                ("low", self.low.into(), 0.0, 1.0),
                ("high", self.high.into(), 0.0, 1.0),
                ("least-length", self.least_length, 0.0, MOST_EXTENT),
            ],
        )
    }
}

/// The amplitudes and their squares.
struct Level;

impl<const D: usize> Entries<D> for Level {
    fn count(&self) -> usize {
        2
    }

    fn write(&self, entry: usize, average: &[f32], _: [&[f32]; D], out: &mut [f32]) {
        for (out, &v) in out.iter_mut().zip(average) {
            *out = if entry == 0 { v } else { v * v };
        }
    }
}

/// The horizons of seismic amplitudes, which are finite; none if they are all the same.
///
/// # Errors
/// [`EnhanceError::Option`] for an option out of its range, [`EnhanceError::Cancelled`] if the watch ends the
/// work.
///
/// # Panics
/// If there are not as many values as the grid's shape says.
pub(crate) fn horizons<const D: usize>(
    values: &[f32],
    grid: &Grid<D>,
    options: &HorizonOptions,
    watch: &mut dyn Watch,
) -> Result<Vec<FeaturePoint<D>>, EnhanceError> {
    options.check()?;
    let Some(unit) = Unit::new(values) else { return Ok(Vec::new()) };
    check(watch, Phase::Potential, 0.0, None)?;
    let grid = grid.in_least_steps();
    let middle = unit.quantile(0.5);
    let fill = |start: usize, out: &mut [f32]| {
        unit.fill(start, out);
        out.iter_mut().for_each(|v| *v -= middle);
    };
    let smooth = grid.step.map(|step| options.normal_scale / step);
    let tensor = StructureTensor::new(values, &grid, options.scale, smooth, watch)?;
    let stream = Stream::new(fill, &grid, Stencil::Gaussian(options.scale)).with_smoothed();
    let levels = CellAverages::new(&stream, grid.shape, smooth, &Level, watch)?;
    let visit = |row: &Row<D>, crests: &mut Vec<FeaturePoint<D>>| {
        let Some(normals) = tensor.row(row.sample) else { return };
        let level = levels.row(row.sample);
        for (x, &value) in row.average.iter().enumerate() {
            let mean = level.at(0, x);
            let sign = if value < mean { -1.0 } else { 1.0 };
            if options.polarity == Polarity::Bright && sign < 0.0
                || options.polarity == Polarity::Dark && sign > 0.0
            {
                continue;
            }
            let normal = normals.normal(x).0;
            if let Some((offset, slope)) = row.summit(&normal, x, sign) {
                let amplitude = sign * (value + 0.5 * slope * offset - mean);
                let deviation = (level.at(1, x) - mean * mean).max(0.0).sqrt();
                let about = if options.balanced { deviation.max(LEAST_DEVIATION) } else { 1.0 };
                crests.extend(row.crest(x, normal, offset, amplitude / about));
            }
        }
    };
    let mut crests = crossings(fill, &grid, options.scale, visit, watch)?;
    scale_strengths(&mut crests);
    let least = least_count::<D>(options.least_length);
    Ok(linked(
        crests,
        grid.shape,
        Hysteresis { low: options.low.into(), high: options.high.into(), least_count: least },
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::coordinates;
    use crate::watch::Silent;

    /// Layers of 8 samples' thickness across a normal, as loud as `loudness` says of the last axis' share.
    fn layers<const D: usize>(
        grid: &Grid<D>,
        normal: [f64; D],
        loudness: impl Fn(f64) -> f64,
    ) -> Vec<f32> {
        let value = |i| {
            let sample = coordinates(i, grid.shape);
            let s: f64 = (0..D).map(|k| normal[k] * sample[k] as f64 * grid.step[k]).sum();
            let depth = sample[D - 1] as f64 / grid.shape[D - 1] as f64;
            7.0 + loudness(depth) * (std::f64::consts::TAU * s / 8.0).cos()
        };
        (0..grid.sample_count()).map(|i| value(i) as f32).collect()
    }

    fn are_peaks<const D: usize>(grid: Grid<D>, normal: [f64; D]) {
        let values = layers(&grid, normal, |_| 1.0);
        for (polarity, phase) in [(Polarity::Bright, 0.0), (Polarity::Dark, 4.0)] {
            let options = HorizonOptions { polarity, ..Default::default() };
            let crests = horizons(&values, &grid, &options, &mut Silent).unwrap();
            let mut count = 0;
            for crest in &crests {
                let sample = coordinates(crest.index, grid.shape);
                if (0..D).any(|k| !(5..grid.shape[k] - 5).contains(&sample[k])) {
                    continue; // where mirrored samples bend the layers
                }
                let s: f64 = (0..D).map(|k| normal[k] * crest.position[k] * grid.step[k]).sum();
                let off = (s - phase + 4.0).rem_euclid(8.0) - 4.0;
                // of a cosine of period 8 the slope is linear to 0.02 samples, and those mirrored at
                // the box's sides turn normals a little
                assert!(off.abs() < 0.06, "{off} at {sample:?}");
                count += 1;
            }
            let inner: usize = grid.shape.iter().map(|n| n - 10).product();
            assert!(count > inner / 9, "{count} of {inner}");
        }
    }

    #[test]
    fn horizons_are_the_peaks_of_dipping_layers() {
        are_peaks(Grid { shape: [60, 64], step: [1.0; 2] }, [0.28, 0.96]);
        are_peaks(Grid { shape: [60, 50], step: [1.0; 2] }, [-0.6, 0.8]);
        are_peaks(Grid { shape: [32, 33, 40], step: [1.0; 3] }, [0.36, 0.48, 0.8]);
    }

    #[test]
    fn weak_deep_reflections_count() {
        let grid = Grid { shape: [64, 160], step: [1.0; 2] };
        let values = layers(&grid, [0.0, 1.0], |depth| f64::exp(-3.0 * depth));
        let deep = |balanced| {
            let options = HorizonOptions { balanced, ..Default::default() };
            let crests = horizons(&values, &grid, &options, &mut Silent).unwrap();
            crests.iter().filter(|crest| crest.index / 64 > 110).count()
        };
        // six layers of 64 samples lie there
        assert!(deep(true) > 5 * 64, "{}", deep(true));
        assert_eq!(deep(false), 0);
    }

    #[test]
    fn both_are_peaks_and_troughs() {
        let grid = Grid { shape: [40, 40], step: [1.0; 2] };
        let values = layers(&grid, [0.28, 0.96], |_| 1.0);
        let count = |polarity| {
            let options = HorizonOptions {
                polarity,
                low: 0.0,
                high: 0.0,
                least_length: 0.0,
                ..Default::default()
            };
            horizons(&values, &grid, &options, &mut Silent).unwrap().len()
        };
        let [peaks, troughs, both] = [Polarity::Bright, Polarity::Dark, Polarity::Both].map(count);
        assert!(peaks > 0 && troughs > 0 && both == peaks + troughs);
    }

    #[test]
    fn silence_has_no_horizons() {
        let grid = Grid { shape: [9, 8, 1], step: [1.0; 3] };
        let none = horizons(&[2.0; 72], &grid, &HorizonOptions::default(), &mut Silent).unwrap();
        assert!(none.is_empty());
    }
}
