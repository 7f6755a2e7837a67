//! Faults in seismic amplitudes: where layers break along a steep plane.
//!
//! Expects amplitudes as they come, of a section (2-D) or a volume (3-D), whose last axis is depth or time:
//! y of a section, z of a volume. Layers are nearly level, faults steep. In this order:
//!
//! 1. [`slopes`]: how layers slope, from the structure tensor;
//! 2. [`sides`]: at every sample, the layer's average on either side of it, L and R, along the slopes.
//!    On a fault they belong to different layers;
//! 3. [`scan`]: the semblance of the two sides, ⟨(L + R)²⟩ / 2⟨L² + R²⟩, with means along a plane through
//!    the sample; kept is what it lacks of 1, ⟨(L − R)²⟩ / 2⟨L² + R²⟩, the greatest over strikes and dips of planes, at
//!    [`nodes`], every third sample along the strike and every second down;
//! 4. [`between`]: the same at all samples, along the planes;
//! 5. [`background`]: what noise alone makes of the semblance nearby is taken off;
//! 6. [`maxima`]: fault likelihood 1 − s⁸ and its crests across the planes, between samples.
//!
//! Slopes, dips and reaches count samples along every axis, whatever the frame's spacing is: where depth is a time,
//! metres over milliseconds are no angle. The normals of crests are turned into lattice units last. A section is a
//! volume one sample wide along y, with one strike; a volume is scanned twice, for planes that face x and for those that
//! face y.
//!
//! Sources: semblance of traces, Marfurt et al. (1998); likelihood 1 − s⁸ with means along slopes first
//! and along planes second, scanned over strike and dip, Hale (2013). Departures: Hale's semblance compares all samples
//! near a fault with their mean, so that noise lowers it everywhere. Two averages of some samples each have less noise,
//! and what is left of it is measured and taken off.
//!
//! Cost: some 20 operations for each node and each of 23 dips, and in a volume 11 strikes facing each axis: of a volume 1,700
//! a sample, since a node stands for six samples. As much again is spent on slopes, sides and what is between nodes.
//! Memory: 20 bytes a sample of a volume beside the image. The same at any number of threads: each upright plane is scanned
//! whole by one thread.

mod background;
mod between;
mod facing;
mod maxima;
mod nodes;
mod scan;
mod sides;
mod slopes;
mod strike;
mod upright;

#[cfg(test)]
mod score;
#[cfg(test)]
mod tests;

use super::{CrestOptions, Finder, Thresholds};
use crate::crests::FeaturePoint;
use crate::enhance::EnhanceError;
use crate::enhance::error::{LONGEST, Within, within};
use crate::image::Grid;
use crate::watch::{Phase, Watch, check};
use between::Found;
use facing::Facing;
use nodes::Coarse;
use serde::{Deserialize, Serialize};
use sides::Amplitudes;
use std::ops::ControlFlow;

/// See [`CrestOptions`].
const THRESHOLDS: Thresholds = Thresholds { low: 0.15, high: 0.5, least_length: 20.0 };

/// How faults are found in seismic amplitudes; lengths and angles count samples along every axis.
///
/// The defaults are the best of some twenty sets tried on synthetic sections of 128² and 256² samples (seeds 0…9) and
/// volumes of 128³ (seeds 0…4), from no noise to 3 dB; no other seeds were kept aside. That of `background` was chosen for
/// means at nodes, on sections of 256² (seeds 10…29) and volumes of 128³ (seeds 5…9).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
pub struct FaultOptions {
    /// Mean distance, in samples along the layers, of what is compared on a sample's two sides; 1 or more.
    /// A larger value tolerates more noise, and blurs faults that are close together. Default 4.
    pub layer_reach: f64,
    /// Standard deviation, in samples of depth, of the mean along the dip; 0.5 or more. A larger value tolerates more
    /// noise, and blurs faults that bend or are short. Default 12.
    pub dip_reach: f64,
    /// Standard deviation, in samples, of the mean along the strike; 0.5 or more. Sections have none.
    /// Default 4.
    pub strike_reach: f64,
    /// Least dip of a fault from the horizontal, in degrees when samples are as far apart along all axes,
    /// 20…85. The greatest is 90. Default 45.
    pub least_dip: f64,
    /// The missing semblance of noise, over the median of a sample's surroundings, which is taken off; 0 or more. A larger
    /// value gives fewer false faults in noise, and loses those of small throw. Default 1.05.
    pub background: f64,
    /// What all finders of crests share; strengths are likelihoods.
    #[serde(flatten)]
    pub crests: CrestOptions,
}

impl Default for FaultOptions {
    fn default() -> Self {
        Self {
            layer_reach: 4.0,
            dip_reach: 12.0,
            strike_reach: 4.0,
            least_dip: 45.0,
            background: 1.05,
            crests: CrestOptions::default(),
        }
    }
}

/// Finds faults.
///
/// A fault has one crest for each sample of depth, and each across its strike, so that it is whole at any slant.
pub(super) struct Faults(pub FaultOptions);

impl<const D: usize> Finder<D> for Faults {
    const KIND: &'static str = "faults";
    const THRESHOLDS: Thresholds = THRESHOLDS;

    fn options(&self) -> &CrestOptions {
        &self.0.crests
    }

    fn check(&self) -> Result<(), EnhanceError> {
        let range = |option, value, least, most| Within { option, value, least, most };
        let ranges = [
            range("layer-reach", self.0.layer_reach, 1.0, LONGEST),
            range("dip-reach", self.0.dip_reach, 0.5, LONGEST),
            range("strike-reach", self.0.strike_reach, 0.5, LONGEST),
            range("least-dip", self.0.least_dip, 20.0, 85.0),
            range("background", self.0.background, 0.0, LONGEST),
        ];
        within("faults", ranges)
    }

    fn points(
        &self,
        values: &[f32],
        grid: &Grid<D>,
        watch: &mut dyn Watch,
    ) -> Result<Vec<FeaturePoint<D>>, EnhanceError> {
        let Some(amplitudes) = Amplitudes::new(values) else { return Ok(Vec::new()) };
        let slopes = slopes::slopes(values, grid, &mut Part { watch, from: 0.0, to: 0.1 })?;
        let mut best = Vec::new();
        let faces = Facing::all(grid.shape);
        for (facing, slopes) in faces.iter().zip(slopes) {
            let share = 0.8 / faces.len() as f64;
            let from = 0.1 + facing.axis as f64 * share;
            let mut part = Part { watch, from, to: from + 0.1 * share };
            let coarse = Coarse::new(facing, &self.0);
            let sides = sides::Sides::new(&amplitudes, &slopes, &coarse, &self.0, &mut part)?;
            drop(slopes);
            let mut part = Part { watch, from: from + 0.1 * share, to: from + share };
            best.push(scan::scan(&sides, &coarse, &self.0, &mut part)?);
        }
        let found = Found::new(&best, grid.shape);
        drop(best);
        check(watch, Phase::Potential, 0.9, None)?;
        let low = self.0.crests.thresholds(THRESHOLDS).low as f32;
        let points = maxima::maxima(found, grid, self.0.background as f32, low);
        check(watch, Phase::Potential, 0.95, None)?;
        Ok(points)
    }

    fn least_count(measure: f64) -> usize {
        measure as usize
    }
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
