//! Faults in seismic amplitudes: where layers break along a steep plane.
//!
//! Expects amplitudes as they come, of a section (2-D) or a volume (3-D), whose last axis is depth or time:
//! y of a section, z of a volume. Layers lie, faults stand. In this order:
//!
//! 1. [`slopes`]: how layers slope, from the structure tensor;
//! 2. [`sides`]: at every sample, the layer's average on either side of it, L and R, along the slopes.
//!    On a fault they belong to different layers;
//! 3. [`scan`]: the semblance of the two sides, ⟨(L + R)²⟩ / 2⟨L² + R²⟩, with means along a plane through
//!    the sample, or rather what is missing from 1, ⟨(L − R)²⟩ / 2⟨L² + R²⟩, which is the greatest over the strikes
//!    and dips of planes;
//! 4. [`background`]: what noise alone gives thereabouts is taken off;
//! 5. [`thin`]: fault likelihood 1 − s⁸ and its crests across the planes, between samples;
//! 6. crests that hang together, and are strong somewhere and many, stay.
//!
//! Slopes, dips and reaches count samples along every axis, whatever the frame's spacing is: where depth is a
//! time, metres over milliseconds are no angle. The normals of crests are turned into lattice units
//! last. A section is a volume one sample wide along y, with one strike; a volume is scanned twice, for planes
//! that face x and for those that face y.
//!
//! Sources: semblance of traces, Marfurt et al. (1998); likelihood 1 − s⁸ with means along slopes first
//! and along planes second, scanned over strike and dip, Hale (2013). Departures: Hale's semblance compares all samples near a fault with their
//! mean, so that noise lowers it everywhere; two averages of some samples each have less of it, and
//! what they have left is measured and taken off.
//!
//! Cost: per sample some 20 operations for each of 27 dips, and in a volume 11 strikes facing each axis. Memory:
//! 30 bytes a sample of a volume beside the image. The same at any number of threads: planes of the image are
//! scanned alone, each whole.

mod background;
mod facing;
mod scan;
mod sides;
mod slopes;
mod thin;

#[cfg(test)]
mod judge;
#[cfg(test)]
mod tests;

use super::{EnhanceError, LONGEST, MOST_EXTENT, within};
use crate::crests::{FeaturePoint, Hysteresis, linked};
use crate::image::Grid;
use crate::watch::{Phase, Watch, check};
use facing::Facing;
use serde::{Deserialize, Serialize};
use std::ops::ControlFlow;

/// How faults are found in seismic amplitudes; lengths and angles count samples along every axis.
///
/// The defaults are the best of some twenty sets tried on synthetic sections of 128² and 256² samples (seeds 0…9) and
/// volumes of 128³ (seeds 0…4), from no noise to 3 dB; no other seeds were kept aside.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
pub struct FaultOptions {
    /// Mean distance, in samples along the layers, of what is compared on a sample's two sides; 1 or more.
    /// More withstands more noise, and blurs faults that are close together. Default 4.
    pub layer_reach: f64,
    /// Standard deviation, in samples of depth, of the mean along the dip; above 0. More withstands more noise, and
    /// blurs faults that bend or are short. Default 12.
    pub dip_reach: f64,
    /// Standard deviation, in samples, of the mean along the strike; above 0. Sections have none.
    /// Default 4.
    pub strike_reach: f64,
    /// Least dip of a fault from the horizontal, in degrees when samples are as far apart along all axes,
    /// 20…85. The greatest is 90. Default 45.
    pub least_dip: f64,
    /// How many times the median of its surroundings a sample's missing semblance is to exceed to count as a fault's;
    /// 0 or more. More gives fewer false faults in noise, and loses those of small throw. Default 1.25.
    pub background: f64,
    /// Least likelihood of a fault, 0…1, where it hangs together with more likely parts. Default 0.15:
    /// less finds more of where a fault dies out, and more beside it.
    pub low: f64,
    /// Likelihood that a fault reaches somewhere, 0…1. Default 0.5.
    pub high: f64,
    /// Least extent of a fault in samples: so many crests in a section, their square in a volume.
    /// Default 20: single noisy groups are smaller, and what is smaller cuts few layers.
    pub least_length: f64,
}

impl Default for FaultOptions {
    fn default() -> Self {
        Self {
            layer_reach: 4.0,
            dip_reach: 12.0,
            strike_reach: 4.0,
            least_dip: 45.0,
            background: 1.25,
            low: 0.15,
            high: 0.5,
            least_length: 20.0,
        }
    }
}

impl FaultOptions {
    /// Refuses what is out of range.
    fn check(&self) -> Result<(), EnhanceError> {
        let ranges = [
            ("layer-reach", self.layer_reach, 1.0, LONGEST),
            ("dip-reach", self.dip_reach, 0.5, LONGEST),
            ("strike-reach", self.strike_reach, 0.5, LONGEST),
            ("least-dip", self.least_dip, 20.0, 85.0),
            ("background", self.background, 0.0, LONGEST),
            ("low", self.low, 0.0, 1.0),
            ("high", self.high, 0.0, 1.0),
            ("least-length", self.least_length, 0.0, MOST_EXTENT),
        ];
        within("faults", &ranges)
    }
}

/// The crests of the faults in seismic amplitudes, in the order of their samples.
///
/// A fault has one crest for each sample of depth, and each across its strike, so that it is whole at any slant.
/// An image without contrast has no faults.
///
/// # Errors
/// [`EnhanceError::FaultOption`] for an option out of its range, [`EnhanceError::Cancelled`] if `watch` says so.
///
/// # Panics
/// If there are not as many values as the grid has samples, which are finite.
pub(crate) fn faults<const D: usize>(
    values: &[f32],
    grid: &Grid<D>,
    options: &FaultOptions,
    watch: &mut dyn Watch,
) -> Result<Vec<FeaturePoint<D>>, EnhanceError> {
    options.check()?;
    check(watch, Phase::Potential, 0.0, None)?;
    let Some(scale) = sides::Scale::of(values) else { return Ok(Vec::new()) };
    let slopes = slopes::slopes(values, grid, &mut Part { watch, from: 0.0, to: 0.1 })?;
    let mut found = scan::Found::new(values.len());
    let faces = Facing::all(grid.shape);
    for (facing, slopes) in faces.iter().zip(slopes) {
        let share = 0.8 / faces.len() as f64;
        let from = 0.1 + facing.axis as f64 * share;
        let mut part = Part { watch, from, to: from + 0.1 * share };
        let sides = sides::Sides::new((values, scale), &slopes, facing, options, &mut part)?;
        drop(slopes);
        let mut part = Part { watch, from: from + 0.1 * share, to: from + share };
        scan::scan(&sides, facing, options, &mut found, &mut part)?;
    }
    check(watch, Phase::Potential, 0.9, None)?;
    let crests = thin::thin(found, grid, options);
    check(watch, Phase::Potential, 0.95, None)?;
    let least = options.least_length.powi(D as i32 - 1) as usize;
    let kept = linked(
        crests,
        grid.shape,
        Hysteresis {
            low: f64::from(options.low as f32),
            high: f64::from(options.high as f32),
            least_count: least,
        },
    );
    check(watch, Phase::Potential, 1.0, None)?;
    Ok(kept)
}

/// A watch for a part of the work.
struct Part<'a> {
    watch: &'a mut dyn Watch,
    /// The share done when the part begins.
    from: f64,
    /// The share done when it ends.
    to: f64,
}

impl Watch for Part<'_> {
    fn step(&mut self, phase: Phase, done: f64, energy: Option<f64>) -> ControlFlow<()> {
        self.watch.step(phase, self.from + done * (self.to - self.from), energy)
    }
}
