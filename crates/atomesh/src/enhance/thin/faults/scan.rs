//! Means along all planes that a fault may lie on, and the best of them at every sample.
//!
//! A plane through a sample is u + strike · v + dip · z, constants being left out: `strike` is the tangent of the
//! angle from v, within ±1, and `dip` the cotangent of the dip in an upright plane of constant v. The mean along
//! it is taken along the strike first, by a Gaussian across some upright planes, and then along the
//! dip, by a two-sided exponential: rows are shifted until the dip is upright, so that each is
//! interpolated twice, whatever the mean's reach is. At the image's ends the mean is over the samples that are there.

use super::FaultOptions;
use super::facing::{Facing, in_order};
use super::sides::Sides;
use crate::watch::{Cancelled, Watch};
use std::ops::Range;

/// The greatest step from one dip to the next, as a cotangent: one sample at the end of a reach of ten.
const DIP_STEP: f64 = 0.1;

/// Strikes to either side of v, the last at 45°.
const STRIKES: i32 = 5;

/// Rows of depth that are scanned together; a taller section is cut.
const SLAB: usize = 256;

/// Where exponentials end, in their lengths: e⁻⁷ is a thousandth.
const TAIL: f64 = 7.0;

/// Where Gaussians end, in standard deviations.
const TRUNCATE: f64 = 2.5;

/// Added to the energy of every sample, over the mean energy: what is next to silent has no faults.
const SILENT: f64 = 1e-3;

/// A plane that a fault may lie on.
#[derive(Clone, Copy, Debug)]
pub(super) struct Orientation {
    /// How the fault faces.
    pub facing: Facing,
    /// ∂u/∂v on the plane.
    pub strike: f32,
    /// ∂u/∂z on the plane.
    pub dip: f32,
}

/// The best plane of every sample, in the image's order.
pub(super) struct Found {
    /// The greatest missing semblance, ⟨(L − R)²⟩ / 2⟨L² + R²⟩.
    pub missing: Vec<f32>,
    /// The number of its orientation.
    pub best: Vec<u16>,
    /// All orientations.
    pub orientations: Vec<Orientation>,
}

impl Found {
    /// Nothing found yet.
    pub fn new(count: usize) -> Self {
        Self { missing: vec![0.0; count], best: vec![0; count], orientations: Vec::new() }
    }
}

/// A strike, as ∂u/∂v, and the dips scanned with it, as ∂u/∂z.
struct Strike {
    slope: f32,
    dips: Vec<f32>,
}

/// The strikes, each with its dips.
fn strikes(facing: &Facing, options: &FaultOptions) -> Vec<Strike> {
    let strikes = if facing.along > 1 { STRIKES } else { 0 };
    let most = 1.0 / options.least_dip.to_radians().tan();
    let dips = (most / DIP_STEP).ceil().max(1.0) as i32;
    let strike = |k: i32| {
        let strike = f64::from(k) / f64::from(STRIKES);
        // along u, planes of one dip are farther from upright the more they are turned
        let step = most / f64::from(dips) * (1.0 + strike * strike).sqrt();
        let dips = (-dips..=dips).map(|j| (f64::from(j) * step) as f32).collect();
        Strike { slope: strike as f32, dips }
    };
    (-strikes..=strikes).map(strike).collect()
}

/// Scans all planes and keeps at each sample what is better than what has been found.
///
/// # Errors
/// [`Cancelled`] if the watch ends the work.
pub(super) fn scan(
    sides: &Sides,
    facing: &Facing,
    options: &FaultOptions,
    found: &mut Found,
    watch: &mut dyn Watch,
) -> Result<(), Cancelled> {
    let strikes = strikes(facing, options);
    let first = found.orientations.len() as u16;
    for Strike { slope, dips } in &strikes {
        let plane = |&dip: &f32| Orientation { facing: *facing, strike: *slope, dip };
        let planes = dips.iter().map(plane);
        found.orientations.extend(planes);
    }
    let mean = sides.energy.iter().map(|&e| f64::from(e)).sum::<f64>() / sides.energy.len() as f64;
    // σ² of the weights a^|k| is 2a/(1 − a)²
    let variance = options.dip_reach * options.dip_reach;
    let keep = (1.0 + variance - (1.0 + 2.0 * variance).sqrt()) / variance;
    let scan = Scan {
        sides,
        facing,
        strikes,
        floor: (SILENT * mean) as f32,
        strike_reach: options.strike_reach,
        keep: keep as f32,
        margin: (TAIL / -keep.ln()).ceil() as usize,
    };
    let slabs = facing.depth.div_ceil(SLAB);
    let work = |number: usize| scan.slab(number / slabs, number % slabs * SLAB);
    in_order(facing.along * slabs, watch, work, |number, best| {
        let rows = best.missing.chunks(facing.across).zip(best.number.chunks(facing.across));
        for (row, (missing, best)) in rows.enumerate() {
            let start = facing.index(0, number % slabs * SLAB + row, number / slabs);
            for (u, (&missing, &best)) in missing.iter().zip(best).enumerate() {
                let i = start + u * facing.stride();
                if missing > found.missing[i] {
                    (found.missing[i], found.best[i]) = (missing, first + best);
                }
            }
        }
    })
}

/// The best of the samples of a slab, rows of u, and the number of its orientation.
struct Best {
    missing: Vec<f32>,
    number: Vec<u16>,
}

/// What all slabs share.
struct Scan<'a> {
    sides: &'a Sides,
    facing: &'a Facing,
    strikes: Vec<Strike>,
    /// Added to the energy.
    floor: f32,
    strike_reach: f64,
    /// The factor by which weights along the dip fall.
    keep: f32,
    /// Rows above and below a slab that its means reach.
    margin: usize,
}

impl Scan<'_> {
    /// The best of the rows from `top` on in the upright plane `v`.
    fn slab(&self, v: usize, top: usize) -> Best {
        let (width, depth) = (self.facing.across, self.facing.depth);
        let kept = top..(top + SLAB).min(depth);
        let rows = top.saturating_sub(self.margin)..(kept.end + self.margin).min(depth);
        let within = kept.start - rows.start..kept.end - rows.start;
        let energy =
            &self.sides.energy[v * self.facing.plane()..][kept.start * width..kept.end * width];
        let inverse: Vec<f32> = energy.iter().map(|&e| 1.0 / (e + self.floor)).collect();
        let mut best = Best { missing: vec![0.0; energy.len()], number: vec![0; energy.len()] };
        let mut mean = vec![0.0; rows.len() * width];
        let mut upright = Upright::default();
        let mut number = 0;
        for Strike { slope, dips } in &self.strikes {
            self.along_strike(v, &rows, *slope, &mut mean);
            for &dip in dips {
                upright.turn(&mean, width, dip, self.keep);
                upright.each_row_back(self.keep, &within, |row, place, weight| {
                    let row_of = (row - within.start) * width..(row - within.start + 1) * width;
                    let missing = &mut best.missing[row_of.clone()];
                    let numbers = &mut best.number[row_of.clone()];
                    let scale = &inverse[row_of];
                    place.read(|u, value| {
                        let value = value * weight * scale[u];
                        let better = value > missing[u];
                        missing[u] = if better { value } else { missing[u] };
                        numbers[u] = if better { number } else { numbers[u] };
                    });
                });
                number += 1;
            }
        }
        best
    }

    /// The mean of the jumps along a strike, in some rows of the upright plane `v`.
    fn along_strike(&self, v: usize, rows: &Range<usize>, strike: f32, mean: &mut [f32]) {
        let (width, plane) = (self.facing.across, self.facing.plane());
        let part = |v: usize| &self.sides.jump[v * plane..][rows.start * width..rows.end * width];
        if self.facing.along == 1 {
            mean.copy_from_slice(part(v));
            return;
        }
        let reach = (TRUNCATE * self.strike_reach).ceil() as usize;
        let planes = v.saturating_sub(reach)..(v + reach + 1).min(self.facing.along);
        let away = |other: usize| other as f64 - v as f64;
        let weight = |other: usize| (-0.5 * (away(other) / self.strike_reach).powi(2)).exp();
        let total: f64 = planes.clone().map(weight).sum();
        mean.fill(0.0);
        for other in planes {
            let shift = Shift::new(strike * away(other) as f32);
            let weight = (weight(other) / total) as f32;
            for (row, mean) in part(other).chunks(width).zip(mean.chunks_mut(width)) {
                shift.each(row, mean, |mean, value| *mean += weight * value);
            }
        }
    }
}

/// A shift of rows by any number of samples.
#[derive(Clone, Copy, Debug)]
struct Shift {
    whole: isize,
    fraction: f32,
}

impl Shift {
    fn new(by: f32) -> Self {
        let whole = by.floor();
        Self { whole: whole as isize, fraction: by - whole }
    }

    /// Gives `take` each place of `out` and the value of `row` by the shift behind it, linear between samples; beyond
    /// its ends a row is constant.
    #[inline(always)]
    fn each(&self, row: &[f32], out: &mut [f32], take: impl Fn(&mut f32, f32)) {
        let (n, count) = (row.len() as isize, out.len() as isize);
        let low = (-self.whole).clamp(0, count);
        let high = (n - 1 - self.whole).clamp(low, count);
        let (before, rest) = out.split_at_mut(low as usize);
        let (inside, behind) = rest.split_at_mut((high - low) as usize);
        before.iter_mut().for_each(|out| take(out, row[0]));
        if !inside.is_empty() {
            let row = &row[(low + self.whole) as usize..];
            for ((out, a), b) in inside.iter_mut().zip(row).zip(&row[1..]) {
                take(out, a + self.fraction * (b - a));
            }
        }
        behind.iter_mut().for_each(|out| take(out, row[row.len() - 1]));
    }
}

/// Rows shifted until planes of one dip stand upright, and their means down these.
#[derive(Default)]
struct Upright {
    /// The samples of a row before the shift.
    width: usize,
    /// The samples of a shifted row.
    wide: usize,
    /// How far each row is shifted: place m holds what was at m − `side` + dip · (row − middle).
    dip: f32,
    side: usize,
    middle: f32,
    shifted: Vec<f32>,
    /// Weighted sums of each row and those above it.
    above: Vec<f32>,
    /// The same of what is below a row.
    below: Vec<f32>,
    sum: Vec<f32>,
}

/// A row of means, shifted.
struct Place<'a> {
    sum: &'a [f32],
    fraction: f32,
    width: usize,
}

impl Place<'_> {
    /// Gives `take` each sample of the row, shifted back.
    #[inline(always)]
    fn read(&self, mut take: impl FnMut(usize, f32)) {
        let (a, b) = (&self.sum[..self.width], &self.sum[1..=self.width]);
        for u in 0..self.width {
            take(u, a[u] + self.fraction * (b[u] - a[u]));
        }
    }
}

impl Upright {
    /// Shifts rows of `width` samples by a dip, and sums them downward.
    fn turn(&mut self, values: &[f32], width: usize, dip: f32, keep: f32) {
        let rows = values.len() / width;
        (self.width, self.dip, self.middle) = (width, dip, 0.5 * (rows as f32 - 1.0));
        self.side = (dip.abs() * self.middle).ceil() as usize + 1;
        self.wide = width + 2 * self.side + 1;
        let wide = self.wide;
        self.shifted.resize(rows * wide, 0.0);
        self.above.resize(rows * wide, 0.0);
        for (row, values) in values.chunks(width).enumerate() {
            let shifted = &mut self.shifted[row * wide..(row + 1) * wide];
            let mut shift = Shift::new(dip * (row as f32 - self.middle));
            shift.whole -= self.side as isize;
            shift.each(values, shifted, |out, value| *out = value);
            let (before, here) = self.above.split_at_mut(row * wide);
            let here = &mut here[..wide];
            here.copy_from_slice(shifted);
            if row > 0 {
                for (here, above) in here.iter_mut().zip(&before[(row - 1) * wide..]) {
                    *here += keep * above;
                }
            }
        }
    }

    /// Gives `take` the number of each row wanted, from the last to the first, its sums, and the factor that makes means
    /// of them.
    fn each_row_back(
        &mut self,
        keep: f32,
        wanted: &Range<usize>,
        mut take: impl FnMut(usize, Place<'_>, f32),
    ) {
        let wide = self.wide;
        let rows = (2.0 * self.middle) as usize + 1;
        self.below.clear();
        self.below.resize(wide, 0.0);
        self.sum.resize(wide, 0.0);
        for row in (0..rows).rev() {
            let shifted = &self.shifted[row * wide..(row + 1) * wide];
            let above = &self.above[row * wide..(row + 1) * wide];
            let (below, sum) = (&mut self.below[..wide], &mut self.sum[..wide]);
            for m in 0..wide {
                let lower = keep * below[m];
                sum[m] = above[m] + lower;
                below[m] = shifted[m] + lower;
            }
            if wanted.contains(&row) {
                // the sum of all weights on rows that are there
                let beyond = keep.powi(row as i32 + 1) + keep.powi((rows - row) as i32);
                let weight = (1.0 - keep) / (1.0 + keep - beyond);
                let back = Shift::new(self.side as f32 - self.dip * (row as f32 - self.middle));
                let sum = &sum[back.whole as usize..];
                take(row, Place { sum, fraction: back.fraction, width: self.width }, weight);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A dip, and the factor by which weights along it fall.
    #[derive(Clone, Copy)]
    struct Slant {
        dip: f64,
        keep: f64,
    }

    /// The mean along a dip at a sample, by its definition.
    fn direct(values: &[f32], width: usize, slant: Slant, row: usize, u: usize) -> f64 {
        let Slant { dip, keep } = slant;
        let (mut sum, mut total) = (0.0, 0.0);
        for (other, values) in values.chunks(width).enumerate() {
            let away = other as f64 - row as f64;
            let weight = keep.powf(away.abs());
            let at = (u as f64 + dip * away).clamp(0.0, (width - 1) as f64);
            let i = (at as usize).min(width - 2);
            let (a, b) = (f64::from(values[i]), f64::from(values[i + 1]));
            sum += weight * (a + (at - i as f64) * (b - a));
            total += weight;
        }
        sum / total
    }

    /// The means along a dip are those of the definition, to roundings, at the samples of a range of each row.
    fn equals_direct(values: &[f32], width: usize, slant: Slant, within: Range<usize>) {
        let Slant { dip, keep } = slant;
        let rows = values.len() / width;
        let mut upright = Upright::default();
        upright.turn(values, width, dip as f32, keep as f32);
        upright.each_row_back(keep as f32, &(0..rows), |row, place, weight| {
            place.read(|u, sum| {
                let slow = direct(values, width, slant, row, u);
                let fast = f64::from(sum * weight);
                let near = (fast - slow).abs() < 1e-4; // of values below 10, some dozens are added
                assert!(near || !within.contains(&u), "{fast} {slow} at {u}, {row}: dip {dip}");
            });
        });
    }

    #[test]
    fn means_along_a_dip_are_those_of_the_definition() {
        let width = 41;
        let any: Vec<f32> = (0..width * 9).map(|i| (i * i * 31 % 97) as f32 / 10.0).collect();
        for dip in [0.0, 1.0, -1.0, 2.0] {
            // from sample to sample: nothing is interpolated, and rows' ends go on level
            equals_direct(&any, width, Slant { dip, keep: 0.8 }, 0..width);
        }
        let sloping = |i: usize| 0.1 * (i % width) as f32 + (i / width * 7 % 5) as f32;
        let sloping: Vec<f32> = (0..width * 9).map(sloping).collect();
        for dip in [0.3, -0.85, 1.21] {
            // a slope is exact between samples, where no plane leaves the rows
            equals_direct(&sloping, width, Slant { dip, keep: 0.9 }, 11..width - 11);
        }
    }
}
