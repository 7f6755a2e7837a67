//! Means along a strike, by a Gaussian across upright planes.

use super::nodes::Coarse;
use super::upright::Shift;
use crate::parallel::prelude::*;
use std::ops::Range;

/// Where Gaussians end, in standard deviations.
const TRUNCATE: f64 = 2.5;

/// Upright planes at the nodes of v, each the sum of its node's planes along a strike. Rows go on level at both ends, as
/// far as any mean reaches.
pub(super) struct Planes<'a> {
    coarse: &'a Coarse,
    strike: f64,
    /// The standard deviation of means, in nodes.
    deviation: f64,
    /// The nodes that means reach to either side.
    reach: usize,
    /// Samples that a row is longer at either end.
    pad: usize,
    values: Vec<f32>,
}

impl<'a> Planes<'a> {
    /// Sums the planes of each node; `reach` is the standard deviation of means along the strike, in samples.
    pub fn new(jump: &[f32], coarse: &'a Coarse, strike: f64, reach: f64) -> Self {
        let Coarse { facing, along, .. } = coarse;
        let deviation = along.deviation(reach);
        let reach = (TRUNCATE * deviation).ceil() as usize;
        let pad = (strike.abs() * (reach * along.step) as f64).ceil() as usize + 1;
        let width = facing.across + 2 * pad;
        let mut values = vec![0.0; width * facing.depth * along.count];
        values.par_chunks_mut(width * facing.depth).enumerate().for_each(|(node, sums)| {
            for v in along.samples(node) {
                let shift = Shift::new(strike * (v as f64 - along.place(node)) - pad as f64);
                let plane = &jump[v * facing.plane()..(v + 1) * facing.plane()];
                let rows = plane.chunks(facing.across).zip(sums.chunks_mut(width));
                rows.for_each(|(row, sums)| shift.add(row, sums, 1.0));
            }
        });
        Self { coarse, strike, deviation, reach, pad, values }
    }

    /// The means of some rows of depth at node `node`, one after another.
    pub fn mean(&self, node: usize, rows: &Range<usize>, mean: &mut Vec<f32>) {
        let Coarse { facing, along, .. } = self.coarse;
        let away = |other: usize| other as f64 - node as f64;
        let weight = |other: usize| match other == node {
            true => 1.0, // also where the deviation is 0
            false => (-0.5 * (away(other) / self.deviation).powi(2)).exp(),
        };
        let planes = node.saturating_sub(self.reach)..(node + self.reach + 1).min(along.count);
        let total: f64 = planes.clone().map(|o| weight(o) * along.samples(o).len() as f64).sum();
        mean.clear();
        mean.resize(rows.len() * facing.across, 0.0);
        let width = facing.across + 2 * self.pad;
        for (row, mean) in rows.clone().zip(mean.chunks_mut(facing.across)) {
            for other in planes.clone() {
                let shift = self.strike * along.step as f64 * away(other) + self.pad as f64;
                let row = &self.values[(other * facing.depth + row) * width..][..width];
                Shift::new(shift).add(row, mean, (weight(other) / total) as f32);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::FaultOptions;
    use super::super::facing::Facing;
    use super::*;

    /// Means along a strike by their definition: Gaussian weights of all planes that are there.
    fn direct(jump: &[f32], facing: &Facing, strike: f64, reach: f64, at: [f64; 2]) -> f64 {
        let ([u, v], mut sum, mut total) = (at, 0.0, 0.0);
        for other in 0..facing.along {
            let away = other as f64 - v;
            let weight = (-0.5 * (away / reach).powi(2)).exp();
            let row = &jump[other * facing.across..][..facing.across];
            let at = (u + strike * away).clamp(0.0, (facing.across - 1) as f64);
            let i = (at as usize).min(facing.across - 2);
            let share = at - i as f64;
            sum += weight * ((1.0 - share) * f64::from(row[i]) + share * f64::from(row[i + 1]));
            total += weight;
        }
        sum / total
    }

    #[test]
    fn means_along_a_strike_are_those_of_the_definition() {
        // a wave along the strike, ten times as long as the mean reaches, on one row of depth
        let shape = [60, 50, 1];
        let facing = Facing::all(shape)[0];
        for (reach, step) in [(1.0, 1), (2.7, 2), (4.0, 3)] {
            for strike in [0.0, 0.4, -1.0] {
                let wave = |u: f64, v: f64| 2.0 + (0.15 * u + 0.157 * v / reach).sin();
                let jump: Vec<f32> =
                    (0..3000).map(|i| wave((i % 60) as f64, (i / 60) as f64) as f32).collect();
                let options = FaultOptions { strike_reach: reach, ..Default::default() };
                let coarse = Coarse::new(&facing, &options);
                assert_eq!(coarse.along.step, step);
                let planes = Planes::new(&jump, &coarse, strike, reach);
                let mut mean = Vec::new();
                for node in 0..coarse.along.count {
                    planes.mean(node, &(0..1), &mut mean);
                    for u in 12..48 {
                        let at = [u as f64, coarse.along.place(node)];
                        let slow = direct(&jump, &facing, strike, reach, at);
                        // 1 % of the weights is cut off, which matters most where the image ends
                        let fast = f64::from(mean[u]);
                        assert!(
                            (fast - slow).abs() < 0.02,
                            "{fast} {slow}: {reach} {strike} {at:?}"
                        );
                    }
                }
            }
        }
    }
}
