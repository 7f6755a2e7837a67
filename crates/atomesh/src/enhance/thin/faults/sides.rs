//! The averages of a layer on the two sides of every sample.
//!
//! L at a sample is the average of the layer's samples before it, with weights that fall by a constant factor
//! from each to the next, R of those behind it; neither holds the sample itself. Traces are taken one after
//! another: Lᵤ(z) = (1 − a) fᵤ₋₁(z − p) + a Lᵤ₋₁(z − p), p the layer's slope.
//! So |L − R| rises to a peak on a break, the sharp one of Shen & Castan's (1992) edge detector.

use super::FaultOptions;
use super::facing::in_batches;
use super::nodes::Coarse;
use crate::image::gaussian;
use crate::parallel::prelude::*;
use crate::watch::{Cancelled, Watch};
use std::mem::take;

/// Samples of one task.
const BLOCK: usize = 1 << 16;

/// After how many of its lengths an exponential is forgotten: e⁻⁷ is a thousandth.
const FORGOTTEN: f32 = 7.0;

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
    /// 2 (L² + R²), averaged about each node.
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
        coarse: &Coarse,
        options: &FaultOptions,
        watch: &mut dyn Watch,
    ) -> Result<Self, Cancelled> {
        let Coarse { facing, along, down } = coarse;
        let (plane, nz, across) = (facing.plane(), facing.depth, facing.across);
        let mut sides =
            Self { jump: vec![0.0; amplitudes.values.len()], energy: vec![0.0; coarse.count()] };
        let keep = (1.0 - 1.0 / options.layer_reach) as f32;
        let jumps = sides.jump.chunks_mut(along.step * plane);
        let tasks = jumps.zip(sides.energy.chunks_mut(coarse.plane())).enumerate().collect();
        in_batches(tasks, watch, |walk: &mut Walk, (node, (jump, energy))| {
            for (v, jump) in along.samples(*node).zip(jump.chunks_mut(plane)) {
                transpose(&mut walk.f, [across, nz], |u, z| amplitudes.at(facing.index(u, z, v)));
                transpose(&mut walk.slope, [across, nz], |u, z| slopes[facing.index(u, z, v)]);
                walk.sides(nz, keep);
                tiles([across, nz], |u, z| {
                    let (l, r) = (walk.left[u * nz + z], walk.right[u * nz + z]);
                    jump[z * across + u] = (l - r) * (l - r);
                    energy[z / down.step * across + u] += 2.0 * (l * l + r * r);
                });
            }
            let count = along.samples(*node).len();
            for (row, energy) in energy.chunks_mut(across).enumerate() {
                let scale = 1.0 / (count * down.samples(row).len()) as f32;
                energy.iter_mut().for_each(|e| *e *= scale);
            }
        })?;
        // as far as the planes of a scan reach, whatever their dip
        let v = if facing.along > 1 { along.deviation(options.strike_reach) } else { 0.0 };
        let window = [0.5 * options.dip_reach, down.deviation(options.dip_reach), v];
        gaussian(&mut sides.energy, [across, down.count, along.count], window);
        Ok(sides)
    }
}

/// The traces of an upright plane, depth fastest, the layers' slopes, and what comes of them.
#[derive(Default)]
struct Walk {
    f: Vec<f32>,
    slope: Vec<f32>,
    /// Samples of a trace.
    depth: usize,
    left: Vec<f32>,
    right: Vec<f32>,
    /// An average about to be moved.
    ahead: Vec<f32>,
}

impl Walk {
    /// L and R. The image goes on as if mirrored, so that its border does not look like a fault.
    fn sides(&mut self, depth: usize, keep: f32) {
        self.depth = depth;
        let last = self.f.len() / self.depth - 1;
        let (mut left, mut right) = (take(&mut self.left), take(&mut self.right));
        for side in [&mut left, &mut right] {
            side.clear();
            side.extend_from_slice(&self.f);
        }
        // where one side ends the other begins: backward as far as is not forgotten, forward, and backward again
        let reach = (FORGOTTEN / -keep.ln()).ceil() as usize;
        (0..last.min(reach)).rev().for_each(|u| self.step(&mut right, u + 1, u, keep));
        left[..self.depth].copy_from_slice(&right[..self.depth]);
        (0..last).for_each(|u| self.step(&mut left, u, u + 1, keep));
        let end = last * self.depth;
        right[end..].copy_from_slice(&left[end..]);
        (0..last).rev().for_each(|u| self.step(&mut right, u + 1, u, keep));
        (self.left, self.right) = (left, right);
    }

    /// One side's average from one trace to a neighbour, along the layers; `keep` of it is kept.
    fn step(&mut self, side: &mut [f32], from: usize, to: usize, keep: f32) {
        let sign = if to > from { -1.0 } else { 1.0 };
        let (from, to) = (from * self.depth, to * self.depth);
        let ahead = &mut self.ahead;
        ahead.clear();
        // the ends go on level
        ahead.push(0.0);
        ahead.extend((from..from + self.depth).map(|i| (1.0 - keep) * self.f[i] + keep * side[i]));
        ahead.extend([ahead[self.depth]; 2]);
        ahead[0] = ahead[1];
        let here = &self.slope[to..to + self.depth];
        let there = &self.slope[from..from + self.depth];
        let own = &self.f[to..to + self.depth];
        let last = (self.depth - 1) as f32;
        for (z, (side, here)) in side[to..to + self.depth].iter_mut().zip(here).enumerate() {
            // the mean of the slopes at both ends of the step
            let near = (z as f32 + sign * here).clamp(0.0, last) + 0.5;
            let at = z as f32 + sign * 0.5 * (here + there[near as usize]);
            // a layer that comes into the image begins with itself
            let inside = (0.0..=last).contains(&at);
            *side = if inside { cubic(ahead, at) } else { own[z] };
        }
    }
}

/// A trace between its samples, by Keys' (1981) cubic; before it stands one value more, behind it two.
fn cubic(f: &[f32], at: f32) -> f32 {
    let i = at as usize;
    let t = at - i as f32;
    let &[a, b, c, d] = f[i..].first_chunk().unwrap_or(&[0.0; 4]);
    let cube = 3.0 * (b - c) + d - a;
    let square = 2.0 * a - 5.0 * b + 4.0 * c - d;
    b + 0.5 * t * (c - a + t * (square + t * cube))
}

/// Samples of a tile along each axis: a line of the cache.
const TILE: usize = 16;

/// Visits all places of a plane tile by tile, so that neither axis strides through memory.
fn tiles(shape: [usize; 2], mut visit: impl FnMut(usize, usize)) {
    for first in (0..shape[0]).step_by(TILE) {
        for second in (0..shape[1]).step_by(TILE) {
            for i in first..(first + TILE).min(shape[0]) {
                for j in second..(second + TILE).min(shape[1]) {
                    visit(i, j);
                }
            }
        }
    }
}

/// Writes the values of a plane, the second axis fastest.
fn transpose(values: &mut Vec<f32>, shape: [usize; 2], at: impl Fn(usize, usize) -> f32) {
    values.resize(shape[0] * shape[1], 0.0);
    tiles(shape, |i, j| values[i * shape[1] + j] = at(i, j));
}
