//! The missing semblance of samples without a fault, in each part of the image: from noise, and from layers that are not
//! quite followed.
//!
//! Few samples are on faults, so that the median of the missing semblance is that of samples without. It is taken in
//! windows about the nodes of a coarse grid, since where layers are faint noise is stronger beside the signal, and is
//! linear between nodes.

use super::facing::volume;
use crate::parallel::prelude::*;

/// Samples between nodes; windows reach to the next nodes.
const STEP: usize = 32;

/// Medians of volumes use every third sample along each axis.
const EVERY: usize = 3;

/// Medians at nodes.
pub(super) struct Background {
    nodes: [usize; 3],
    medians: Vec<f32>,
}

impl Background {
    /// The medians of values, x fastest.
    pub fn new<const D: usize>(values: &[f32], shape: [usize; D]) -> Self {
        let shape = volume(shape);
        let every = if D > 2 { EVERY } else { 1 };
        let nodes = shape.map(|n| (n - 1).div_ceil(STEP) + 1);
        let median = |node: usize| {
            let at = [node % nodes[0], node / nodes[0] % nodes[1], node / nodes[0] / nodes[1]];
            let window = |k: usize| {
                let middle = STEP * at[k];
                middle.saturating_sub(STEP)..(middle + STEP + 1).min(shape[k])
            };
            let mut near = Vec::new();
            for z in window(2).step_by(every) {
                for y in window(1).step_by(every) {
                    let row = shape[0] * (y + shape[1] * z);
                    near.extend(window(0).step_by(every).map(|x| values[row + x]));
                }
            }
            let half = near.len() / 2;
            *near.select_nth_unstable_by(half, f32::total_cmp).1
        };
        let medians = (0..nodes.iter().product()).into_par_iter().map(median).collect();
        Self { nodes, medians }
    }

    /// The background at a sample.
    pub fn at(&self, sample: [usize; 3]) -> f32 {
        let (mut index, mut stride) = (0, 1);
        let mut ways = [(0, 0.0); 3]; // to the next node along each axis, and its share
        for k in 0..3 {
            let node = (sample[k] / STEP).min(self.nodes[k].saturating_sub(2));
            let share = (sample[k] - node * STEP) as f32 / STEP as f32;
            ways[k] = (if self.nodes[k] > 1 { stride } else { 0 }, share);
            index += node * stride;
            stride *= self.nodes[k];
        }
        let mut sum = 0.0;
        for corner in 0..8 {
            let (mut node, mut weight) = (index, 1.0);
            for (k, (way, share)) in ways.into_iter().enumerate() {
                let next = corner >> k & 1 == 1;
                node += if next { way } else { 0 };
                weight *= if next { share } else { 1.0 - share };
            }
            sum += weight * self.medians[node];
        }
        sum
    }
}
