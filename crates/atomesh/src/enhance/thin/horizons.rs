//! Horizons: the reflections of raw seismic amplitudes, as lines (2-D) and sheets (3-D).
//!
//! The field is the amplitudes, the direction the normal of the layers, from the structure tensor (Hale 2002). Crests are
//! their peaks, troughs or both along the normal. Strength is relative to the amplitudes about a reflection, so that weak
//! deep reflections count.

use super::crossings::{Row, crossings, scale_strengths};
use super::unit::UnitValues;
use super::{CrestOptions, Finder, Polarity, Thresholds};
use crate::crests::FeaturePoint;
use crate::enhance::error::{LONGEST, Within, within};
use crate::enhance::{EnhanceError, LEAST_EDGE_SCALE};
use crate::image::{CellAverages, Entries, Grid, Stencil, Stream, StructureTensor};
use crate::watch::Watch;
use serde::{Deserialize, Serialize};

/// The least deviation of amplitudes about a reflection, over the image's range, lest silence is made as loud as layers.
const LEAST_DEVIATION: f32 = 0.005;

/// See [`CrestOptions::scale`].
const SCALE: f64 = 1.0;

/// See [`CrestOptions::normal_scale`].
const NORMAL_SCALE: f64 = 8.0;

/// How horizons are found.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
pub struct HorizonOptions {
    /// What all finders of crests share.
    #[serde(flatten)]
    pub crests: CrestOptions,
    /// Whether strengths are relative to those about them. Default: they are.
    pub balanced: bool,
}

impl Default for HorizonOptions {
    fn default() -> Self {
        Self { crests: CrestOptions::default(), balanced: true }
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

/// Finds horizons.
pub(super) struct Horizons(pub HorizonOptions);

impl<const D: usize> Finder<D> for Horizons {
    const KIND: &'static str = "horizons";
    const THRESHOLDS: Thresholds = Thresholds { low: 0.15, high: 0.4, least_length: 20.0 };

    fn options(&self) -> &CrestOptions {
        &self.0.crests
    }

    fn check(&self) -> Result<(), EnhanceError> {
        let (least, most) = (LEAST_EDGE_SCALE, LONGEST);
        let value = self.0.crests.normal_scale.unwrap_or(NORMAL_SCALE);
        within("horizons", [Within { option: "normal-scale", value, least, most }])
    }

    fn points(
        &self,
        values: &[f32],
        grid: &Grid<D>,
        watch: &mut dyn Watch,
    ) -> Result<Vec<FeaturePoint<D>>, EnhanceError> {
        let Some(unit) = UnitValues::new(values) else { return Ok(Vec::new()) };
        let grid = grid.in_least_steps();
        let HorizonOptions { crests: options, balanced } = self.0;
        let scale = options.scale.unwrap_or(SCALE);
        let polarity = options.polarity.unwrap_or_default();
        let middle = unit.quantile(0.5);
        let fill = |start: usize, out: &mut [f32]| {
            unit.fill(start, out);
            out.iter_mut().for_each(|v| *v -= middle);
        };
        let normal_scale = options.normal_scale.unwrap_or(NORMAL_SCALE);
        let smooth = grid.step.map(|step| normal_scale / step);
        let tensor = StructureTensor::new(values, &grid, scale, smooth, watch)?;
        let stream = Stream::new(fill, &grid, Stencil::Gaussian(scale)).with_smoothed();
        let levels = CellAverages::new(&stream, grid.shape, smooth, &Level, watch)?;
        let visit = |row: &Row<D>, crests: &mut Vec<FeaturePoint<D>>| {
            let Some(normals) = tensor.row(row.sample) else { return };
            let level = levels.row(row.sample);
            for (x, &value) in row.average.iter().enumerate() {
                let mean = level.at(0, x);
                let sign = if value < mean { -1.0 } else { 1.0 };
                if polarity == Polarity::Bright && sign < 0.0
                    || polarity == Polarity::Dark && sign > 0.0
                {
                    continue;
                }
                let normal = normals.normal(x).0;
                if let Some(top) = row.summit(&normal, x, sign) {
                    let amplitude = sign * (value + 0.5 * top.slope * top.offset - mean);
                    let deviation = (level.at(1, x) - mean * mean).max(0.0).sqrt();
                    let about = if balanced { deviation.max(LEAST_DEVIATION) } else { 1.0 };
                    crests.extend(row.crest(x, normal, top.offset, amplitude / about));
                }
            }
        };
        let mut crests = crossings(fill, &grid, scale, visit, watch)?;
        scale_strengths(&mut crests);
        Ok(crests)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::coordinates;
    use crate::watch::Silent;

    fn found<const D: usize>(
        values: &[f32],
        grid: &Grid<D>,
        options: HorizonOptions,
    ) -> Vec<FeaturePoint<D>> {
        super::super::crests(&Horizons(options), values, grid, &mut Silent).unwrap()
    }

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
            let crests = CrestOptions { polarity: Some(polarity), ..Default::default() };
            let crests = found(&values, &grid, HorizonOptions { crests, ..Default::default() });
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
            let crests = found(&values, &grid, options);
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
            let crests = CrestOptions {
                polarity: Some(polarity),
                low: Some(0.0),
                high: Some(0.0),
                least_length: Some(0.0),
                ..Default::default()
            };
            found(&values, &grid, HorizonOptions { crests, ..Default::default() }).len()
        };
        let [peaks, troughs, both] = [Polarity::Bright, Polarity::Dark, Polarity::Both].map(count);
        assert!(peaks > 0 && troughs > 0 && both == peaks + troughs);
    }

    #[test]
    fn silence_has_no_horizons() {
        let grid = Grid { shape: [9, 8, 1], step: [1.0; 3] };
        assert!(found(&[2.0; 72], &grid, HorizonOptions::default()).is_empty());
    }
}
