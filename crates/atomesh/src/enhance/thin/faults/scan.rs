//! Means along all planes that a fault may lie on, and the best of them at every node.
//!
//! A plane through a sample is u + strike · v + dip · z, constants being left out: `strike` is the tangent of the
//! angle from v, within ±1, and `dip` the cotangent of the dip in an upright plane of constant v. The mean along
//! it is taken along the strike first, by a Gaussian across some upright planes ([`Planes`]), and then along the
//! dip, by a two-sided exponential ([`Upright`]). At the image's ends the mean is over the samples that are there.
//!
//! Means are smooth along their planes, so that they are made at [`Nodes`](super::nodes) along v and z only, and at every
//! sample along u. The samples of a node are summed along the plane first: along the strike itself, and along the
//! middle one of three dips, which are a twentieth of a sample apart on so short a way.

use super::facing::{Facing, in_batches};
use super::nodes::Coarse;
use super::sides::Sides;
use super::strike::Planes;
use super::upright::{Rows, Shift, Slant, Upright};
use super::{FaultOptions, Part};
use crate::watch::{Cancelled, Watch};
use std::ops::Range;

/// The greatest step from one dip to the next, as a cotangent: one sample at the end of a reach of ten.
const DIP_STEP: f64 = 0.1;

/// Strikes to either side of v, the last at 45°.
const STRIKES: i32 = 5;

/// Neighbouring dips for which the samples of nodes are summed alike.
const ALIKE: i32 = 3;

/// Rows of nodes that are scanned together; a taller section is cut.
const SLAB: usize = 96;

/// Where exponentials end, in their lengths: e⁻⁷ is a thousandth.
const TAIL: f64 = 7.0;

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

/// The best planes of the nodes of a facing.
pub(super) struct Best {
    pub coarse: Coarse,
    /// The greatest missing semblance, ⟨(L − R)²⟩ / 2⟨L² + R²⟩.
    pub missing: Vec<f32>,
    /// The number of its orientation.
    pub number: Vec<u32>,
    /// All orientations.
    pub orientations: Vec<Orientation>,
}

/// A strike, as ∂u/∂v, and the dips scanned with it, as ∂u/∂z, in groups of neighbours.
struct Strike {
    slope: f64,
    groups: Vec<Vec<f64>>,
}

/// The strikes, each with its dips.
fn strikes(facing: &Facing, options: &FaultOptions) -> Vec<Strike> {
    let strikes = if facing.along > 1 { STRIKES } else { 0 };
    let most = 1.0 / options.least_dip.to_radians().tan();
    let dips = (most / DIP_STEP).ceil().max(1.0) as i32;
    let all: Vec<i32> = (-dips..=dips).collect();
    // upright is in the middle of a group, so that left and right are alike
    let group = |j: i32| (j + j.signum() * (ALIKE / 2)) / ALIKE;
    let strike = |k: i32| {
        let slope = f64::from(k) / f64::from(STRIKES);
        // along u, planes of one dip are farther from upright the more they are turned
        let step = most / f64::from(dips) * (1.0 + slope * slope).sqrt();
        let groups = all.chunk_by(|a, b| group(*a) == group(*b));
        let groups = groups.map(|group| group.iter().map(|&j| f64::from(j) * step).collect());
        Strike { slope, groups: groups.collect() }
    };
    (-strikes..=strikes).map(strike).collect()
}

/// Scans all planes.
///
/// # Errors
/// [`Cancelled`] if the watch ends the work.
pub(super) fn scan(
    sides: &Sides,
    coarse: &Coarse,
    options: &FaultOptions,
    watch: &mut dyn Watch,
) -> Result<Best, Cancelled> {
    let strikes = strikes(&coarse.facing, options);
    let scan = Scan::new(coarse, options.dip_reach);
    let (mut missing, mut number) = (vec![0.0; coarse.count()], vec![0; coarse.count()]);
    let mut orientations = Vec::new();
    for (part, Strike { slope, groups }) in strikes.iter().enumerate() {
        let share = 1.0 / strikes.len() as f64;
        let mut part = Part { watch, from: part as f64 * share, to: (part + 1) as f64 * share };
        let planes = Planes::new(&sides.jump, coarse, *slope, options.strike_reach);
        let first = orientations.len() as u32;
        let slabs = scan.slabs(&mut missing, &mut number);
        in_batches(slabs, &mut part, |scratch, slab| {
            scan.slab(&planes, groups, first, slab, scratch);
        })?;
        orientations.extend(groups.iter().flatten().map(|&dip| Orientation {
            facing: coarse.facing,
            strike: *slope as f32,
            dip: dip as f32,
        }));
    }
    scan.divide(&mut missing, &sides.energy);
    Ok(Best { coarse: *coarse, missing, number, orientations })
}

/// What all slabs share.
struct Scan<'a> {
    coarse: &'a Coarse,
    /// The factor by which weights along the dip fall from node to node.
    keep: f32,
    /// Nodes above and below a slab that its means reach.
    margin: usize,
}

/// The best so far of some rows of an upright plane of nodes.
struct Slab<'a> {
    v: usize,
    rows: Range<usize>,
    sums: &'a mut [f32],
    numbers: &'a mut [u32],
}

/// What a thread needs room for.
#[derive(Default)]
struct Scratch {
    mean: Vec<f32>,
    rows: Vec<f32>,
    upright: Upright,
}

impl<'a> Scan<'a> {
    fn new(coarse: &'a Coarse, reach: f64) -> Self {
        // σ² of the weights a^|k| is 2a/(1 − a)²
        let variance = coarse.down.deviation(reach).powi(2);
        let keep = (1.0 + variance - (1.0 + 2.0 * variance).sqrt()) / variance;
        Self { coarse, keep: keep as f32, margin: (TAIL / -keep.ln()).ceil() as usize }
    }

    /// All slabs.
    fn slabs<'b>(&self, sums: &'b mut [f32], numbers: &'b mut [u32]) -> Vec<Slab<'b>> {
        let (across, plane) = (self.coarse.facing.across, self.coarse.plane());
        let planes = sums.chunks_mut(plane).zip(numbers.chunks_mut(plane)).enumerate();
        let slabs = planes.flat_map(|(v, (sums, numbers))| {
            let slabs = sums.chunks_mut(SLAB * across).zip(numbers.chunks_mut(SLAB * across));
            slabs.enumerate().map(move |(slab, (sums, numbers))| {
                let top = slab * SLAB;
                Slab { v, rows: top..top + sums.len() / across, sums, numbers }
            })
        });
        slabs.collect()
    }

    /// The rows of nodes that the means of some of them reach.
    fn reached(&self, rows: &Range<usize>) -> Range<usize> {
        let end = (rows.end + self.margin).min(self.coarse.down.count);
        rows.start.saturating_sub(self.margin)..end
    }

    /// Keeps the best of a slab and groups of dips, numbered from `first` on.
    fn slab(
        &self,
        planes: &Planes<'_>,
        groups: &[Vec<f64>],
        first: u32,
        slab: &mut Slab<'_>,
        scratch: &mut Scratch,
    ) {
        let Scratch { mean, rows, upright } = scratch;
        let (across, down) = (self.coarse.facing.across, &self.coarse.down);
        let reached = self.reached(&slab.rows);
        let wanted = slab.rows.start - reached.start..slab.rows.end - reached.start;
        planes.mean(slab.v, &down.samples_of(&reached), mean);
        let mut number = first;
        for dips in groups {
            let middle = 0.5 * (dips[0] + dips[dips.len() - 1]);
            self.sum_nodes(mean, &reached, middle, rows);
            let rows = Rows { values: rows, across };
            for &dip in dips {
                let slant = Slant { dip: dip * down.step as f64, keep: self.keep };
                upright.each_row_back(&rows, slant, &wanted, |row, sums| {
                    let row = row - wanted.start;
                    let of = row * across..(row + 1) * across;
                    sums.keep_greater(number, &mut slab.sums[of.clone()], &mut slab.numbers[of]);
                });
                number += 1;
            }
        }
    }

    /// The sums of the samples of nodes along a dip, with one more at both ends of each row.
    fn sum_nodes(&self, values: &[f32], nodes: &Range<usize>, dip: f64, sums: &mut Vec<f32>) {
        let (across, down) = (self.coarse.facing.across, &self.coarse.down);
        sums.clear();
        sums.resize(nodes.len() * (across + 2), 0.0);
        let mut values = values.chunks(across);
        for (node, sums) in nodes.clone().zip(sums.chunks_mut(across + 2)) {
            for (z, values) in down.samples(node).zip(&mut values) {
                let shift = Shift::new(dip * (z as f64 - down.place(node)) - 1.0);
                shift.add(values, sums, 1.0);
            }
        }
    }

    /// Makes of sums down planes the missing semblance.
    fn divide(&self, sums: &mut [f32], energy: &[f32]) {
        let (across, plane) = (self.coarse.facing.across, self.coarse.plane());
        let mean = energy.iter().map(|&e| f64::from(e)).sum::<f64>() / energy.len() as f64;
        let floor = (SILENT * mean) as f32;
        let weights: Vec<f32> = (0..self.coarse.down.count).map(|row| self.weight(row)).collect();
        let planes = sums.chunks_mut(plane).zip(energy.chunks(plane));
        for (sums, energy) in planes {
            let rows = sums.chunks_mut(across).zip(energy.chunks(across)).zip(&weights);
            for ((sums, energy), weight) in rows {
                for (sum, energy) in sums.iter_mut().zip(energy) {
                    *sum *= weight / (energy + floor);
                }
            }
        }
    }

    /// The factor that makes a mean of a sum at a row of nodes: over the weights of all samples that are there.
    fn weight(&self, row: usize) -> f32 {
        let slab = row / SLAB * SLAB;
        let reached = self.reached(&(slab..(slab + SLAB).min(self.coarse.down.count)));
        let weight = |other: usize| {
            let count = self.coarse.down.samples(other).len() as f64;
            count * f64::from(self.keep).powi(row.abs_diff(other) as i32)
        };
        (1.0 / reached.map(weight).sum::<f64>()) as f32
    }
}
