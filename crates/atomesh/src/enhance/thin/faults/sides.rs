//! The averages of a layer on the two sides of every sample.
//!
//! L at a sample is the average of the layer's samples before it, with weights that fall by a constant factor
//! from each to the next, R of those behind it; neither holds the sample itself. Traces are taken one after
//! another: Lᵤ(z) = (1 − a) fᵤ₋₁(z − p) + a Lᵤ₋₁(z − p), p the layer's slope.
//! So |L − R| rises to a peak on a break, the sharp one of Shen & Castan's (1992) edge detector.

use super::FaultOptions;
use super::facing::{Facing, in_order};
use crate::image::gaussian;
use crate::parallel::prelude::*;
use crate::watch::{Cancelled, Watch};

/// Samples of one task.
const BLOCK: usize = 1 << 16;

/// Amplitudes, brought to mean 0 and mean square 1 while they are read.
#[derive(Clone, Copy, Debug)]
pub(super) struct Amplitudes<'a> {
    values: &'a [f32],
    mean: f64,
    factor: f64,
}

impl<'a> Amplitudes<'a> {
    /// `None` if all values are the same.
    pub fn new(values: &'a [f32]) -> Option<Self> {
        let (&first, rest) = values.split_first()?;
        if rest.iter().all(|&v| v == first) {
            return None;
        }
        let sum = |of: &(dyn Fn(f64) -> f64 + Sync)| {
            let blocks: Vec<f64> =
                values.par_chunks(BLOCK).map(|b| b.iter().map(|&v| of(v.into())).sum()).collect();
            blocks.iter().sum::<f64>() / values.len() as f64
        };
        let mean = sum(&|v| v);
        let deviation = sum(&|v| (v - mean) * (v - mean)).sqrt();
        (deviation > 0.0).then(|| Self { values, mean, factor: 1.0 / deviation })
    }

    fn at(&self, index: usize) -> f32 {
        ((f64::from(self.values[index]) - self.mean) * self.factor) as f32
    }
}

/// How much the two sides of every sample differ, in the order of a scan.
pub(super) struct Sides {
    /// (L − R)².
    pub jump: Vec<f32>,
    /// 2 (L² + R²), averaged about the sample.
    pub energy: Vec<f32>,
}

impl Sides {
    /// The sides of all samples along u.
    ///
    /// # Errors
    /// [`Cancelled`] if the watch ends the work.
    pub fn new(
        amplitudes: &Amplitudes<'_>,
        slopes: &[f32],
        facing: &Facing,
        options: &FaultOptions,
        watch: &mut dyn Watch,
    ) -> Result<Self, Cancelled> {
        let (plane, nz, count) = (facing.plane(), facing.depth, amplitudes.values.len());
        let mut sides = Self { jump: vec![0.0; count], energy: vec![0.0; count] };
        let traces = |v: usize, of: &dyn Fn(usize) -> f32| -> Vec<f32> {
            let trace = |u| (0..nz).map(move |z| of(facing.index(u, z, v)));
            (0..facing.across).flat_map(trace).collect()
        };
        let keep = (1.0 - 1.0 / options.layer_reach) as f32;
        let work = |v| {
            let f = traces(v, &|i| amplitudes.at(i));
            Walk { f, slope: traces(v, &|i| slopes[i]), count: facing.across, depth: nz, keep }
                .sides()
        };
        in_order(facing.along, watch, work, |v, (left, right)| {
            let jump = &mut sides.jump[v * plane..(v + 1) * plane];
            let energy = &mut sides.energy[v * plane..(v + 1) * plane];
            for (u, (left, right)) in left.chunks(nz).zip(right.chunks(nz)).enumerate() {
                for (z, (l, r)) in left.iter().zip(right).enumerate() {
                    jump[z * facing.across + u] = (l - r) * (l - r);
                    energy[z * facing.across + u] = 2.0 * (l * l + r * r);
                }
            }
        })?;
        // as far as the planes of a scan reach, whatever their dip
        let along = if facing.along > 1 { options.strike_reach } else { 0.0 };
        let window = [0.5 * options.dip_reach, options.dip_reach, along];
        gaussian(&mut sides.energy, [facing.across, nz, facing.along], window);
        Ok(sides)
    }
}

/// The traces of an upright plane, depth fastest, and the layers' slopes.
struct Walk {
    f: Vec<f32>,
    slope: Vec<f32>,
    /// Traces.
    count: usize,
    /// Samples of a trace.
    depth: usize,
    /// What is kept of an average from one trace to the next.
    keep: f32,
}

impl Walk {
    /// L and R. The image goes on as if mirrored, so that its border does not look like a fault.
    fn sides(&self) -> (Vec<f32>, Vec<f32>) {
        let last = self.count - 1;
        let (mut left, mut right) = (self.f.clone(), self.f.clone());
        let backward = |right: &mut [f32]| (0..last).rev().for_each(|u| self.step(right, u + 1, u));
        // where one side ends the other begins: backward, forward, and backward again
        backward(&mut right);
        left[..self.depth].copy_from_slice(&right[..self.depth]);
        (0..last).for_each(|u| self.step(&mut left, u, u + 1));
        let end = last * self.depth;
        right[end..].copy_from_slice(&left[end..]);
        backward(&mut right);
        (left, right)
    }

    /// One side's average from one trace to a neighbour, along the layers.
    fn step(&self, side: &mut [f32], from: usize, to: usize) {
        let sign = if to > from { -1.0 } else { 1.0 };
        let (from, to) = (from * self.depth, to * self.depth);
        let ahead: Vec<f32> = (from..from + self.depth)
            .map(|i| (1.0 - self.keep) * self.f[i] + self.keep * side[i])
            .collect();
        let last = (self.depth - 1) as f32;
        for z in 0..self.depth {
            // the mean of the slopes at both ends of the step
            let here = self.slope[to + z];
            let near = (z as f32 + sign * here).clamp(0.0, last) + 0.5;
            let there = self.slope[from + near as usize];
            let at = z as f32 + sign * 0.5 * (here + there);
            // a layer that comes into the image begins with itself
            let inside = (0.0..=last).contains(&at);
            side[to + z] = if inside { cubic(&ahead, at) } else { self.f[to + z] };
        }
    }
}

/// A trace between its samples, by Keys' (1981) cubic; its ends go on level.
fn cubic(f: &[f32], at: f32) -> f32 {
    let i = at as usize;
    let t = at - i as f32;
    let last = f.len() - 1;
    let (a, b, c, d) = (f[i.saturating_sub(1)], f[i], f[(i + 1).min(last)], f[(i + 2).min(last)]);
    let cube = 3.0 * (b - c) + d - a;
    let square = 2.0 * a - 5.0 * b + 4.0 * c - d;
    b + 0.5 * t * (c - a + t * (square + t * cube))
}
