//! Where derivatives along a direction cross zero, between samples: how features are thinned to crests.
//!
//! An image is smoothed and differentiated plane by plane; three planes at a time are held, and of each row
//! of samples its neighbours can be asked. Slopes are those of the smoothed image, and taken to be linear, or
//! a parabola, between samples. Outside the image samples are mirrored, so that a slope along an axis
//! has the other sign there.
//!
//! Cost: O(σ) per sample, and what the visitor does. Memory: a few planes a thread, and the crests.

use super::quantile::{Order, Ranks};
use crate::crests::FeaturePoint;
use crate::image::{Grid, Run, Stencil, Stream, coordinates};
use crate::watch::{Cancelled, Phase, Watch, check};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;
use std::ops::Range;

/// Which of the lines and sheets along which an image is extreme count.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[non_exhaustive]
pub enum Polarity {
    /// Those brighter than what is about them; of amplitudes, peaks.
    #[default]
    Bright,
    /// Those darker than what is about them; of amplitudes, troughs.
    Dark,
    /// Both.
    Both,
}

/// How far from its sample a crest may be along any axis, in samples: half, and what rounding and
/// differences may be off, lest crests have gaps.
const REACH: f32 = 0.6;

/// Of all crests, the share that is given full strength.
const CLIPPED: f64 = 0.02;

/// Samples between two looks at whether to go on: a fraction of a second's work.
const BATCH_SAMPLES: usize = 1 << 24;

/// An image's values, moved and scaled to 0…1 as they are read.
#[derive(Clone, Copy)]
pub(super) struct Unit<'a> {
    values: &'a [f32],
    least: f64,
    scale: f64,
}

impl<'a> Unit<'a> {
    /// `None` if all values are the same.
    pub(super) fn new(values: &'a [f32]) -> Option<Self> {
        let ends = |part: &[f32]| {
            part.iter().fold((f32::MAX, f32::MIN), |(a, b), &v| (a.min(v), b.max(v)))
        };
        let both = |a: (f32, f32), b: (f32, f32)| (a.0.min(b.0), a.1.max(b.1));
        let (least, greatest) =
            values.par_chunks(1 << 16).map(ends).reduce(|| (f32::MAX, f32::MIN), both);
        let (least, greatest) = (f64::from(least), f64::from(greatest));
        (greatest > least).then(|| Self { values, least, scale: 1.0 / (greatest - least) })
    }

    /// Writes values from index `start` on.
    pub(super) fn fill(&self, start: usize, out: &mut [f32]) {
        for (out, &v) in out.iter_mut().zip(&self.values[start..]) {
            *out = ((f64::from(v) - self.least) * self.scale) as f32;
        }
    }

    /// The value that a share of all others is below.
    pub(super) fn quantile(&self, share: f64) -> f32 {
        let count = self.values.len();
        let order = Order::new(count, |start, out: &mut [f32]| self.fill(start, out));
        order.ranked((share * count as f64) as usize).value
    }
}

/// Crests that `visit` finds, row by row, in an image that `fill(start, out)` writes, smoothed by a Gaussian of
/// `sigma` least steps; in the order of their samples.
///
/// # Errors
/// [`Cancelled`] if the watch ends the work.
pub(super) fn crossings<const D: usize>(
    fill: impl Fn(usize, &mut [f32]) + Sync,
    grid: &Grid<D>,
    sigma: f64,
    visit: impl Fn(&Row<D>, &mut Vec<FeaturePoint<D>>) + Sync,
    watch: &mut dyn Watch,
) -> Result<Vec<FeaturePoint<D>>, Cancelled> {
    let stream = Stream::new(fill, grid, Stencil::Gaussian(sigma)).with_smoothed();
    let planes = grid.shape[D - 1];
    let fair = planes.div_ceil(2 * rayon::current_num_threads());
    let task = fair.min(BATCH_SAMPLES / stream.plane()).max(stream.least_planes());
    let batch = task * (BATCH_SAMPLES / stream.plane() / task).max(rayon::current_num_threads());
    let mut crests = Vec::new();
    for start in (0..planes).step_by(batch) {
        check(watch, Phase::Potential, start as f64 / planes as f64, None)?;
        let tasks: Vec<usize> = (start..planes.min(start + batch)).step_by(task).collect();
        let parts = tasks.into_par_iter().map(|first| {
            let wanted = first..planes.min(start + batch).min(first + task);
            let read = first.saturating_sub(1)..planes.min(wanted.end + 1);
            let mut window = Window::new(*grid, wanted);
            stream.run(read, &mut |run| window.take(run, &visit));
            window.crests
        });
        crests.extend(parts.collect::<Vec<_>>().into_iter().flatten());
    }
    Ok(crests)
}

/// Scales strengths so that all but a few of the strongest crests are within 0…1, and clips these to 1.
///
/// Returns what a strength of 1 was before.
pub(super) fn scale_strengths<const D: usize>(crests: &mut [FeaturePoint<D>]) -> f32 {
    let strengths: Vec<f32> = crests.iter().map(|crest| (crest.strength as f32).max(0.0)).collect();
    let count = strengths.len();
    let order = Order::new(count, |start, out: &mut [f32]| {
        out.copy_from_slice(&strengths[start..start + out.len()]);
    });
    let clipped = (CLIPPED * count as f64) as usize;
    let full = order.ranked(count.saturating_sub(1 + clipped)).value;
    if full > 0.0 {
        for crest in crests {
            crest.strength = (crest.strength as f32 / full).clamp(0.0, 1.0).into();
        }
    }
    full
}

/// The smoothed image of one plane, and its slopes.
struct Fields<const D: usize> {
    average: Vec<f32>,
    slopes: [Vec<f32>; D],
}

/// The planes that one task holds, the first of which has this number, and what was found.
struct Window<const D: usize> {
    grid: Grid<D>,
    wanted: Range<usize>,
    first: usize,
    planes: VecDeque<Fields<D>>,
    spare: Vec<Fields<D>>,
    crests: Vec<FeaturePoint<D>>,
}

impl<const D: usize> Window<D> {
    fn new(grid: Grid<D>, wanted: Range<usize>) -> Self {
        let first = wanted.start.saturating_sub(1);
        let (planes, spare) = (VecDeque::new(), Vec::new());
        Self { grid, wanted, first, planes, spare, crests: Vec::new() }
    }

    /// Keeps a run, and visits the rows of the planes whose neighbours have come.
    fn take(&mut self, run: &Run<D>, visit: &impl Fn(&Row<D>, &mut Vec<FeaturePoint<D>>)) {
        let plane: usize = self.grid.shape[..D - 1].iter().product();
        while self.first + self.planes.len() <= run.plane {
            self.planes.push_back(self.spare.pop().unwrap_or_else(|| Fields {
                average: vec![0.0; plane],
                slopes: std::array::from_fn(|_| vec![0.0; plane]),
            }));
        }
        let fields = &mut self.planes[run.plane - self.first];
        let end = run.column + run.average.len();
        fields.average[run.column..end].copy_from_slice(run.average);
        for (slopes, run_slopes) in fields.slopes.iter_mut().zip(run.slopes) {
            slopes[run.column..end].copy_from_slice(run_slopes);
        }
        if end < plane {
            return;
        }
        if run.plane > 0 && self.wanted.contains(&(run.plane - 1)) {
            self.visit_plane(run.plane - 1, visit);
        }
        if run.plane + 1 == self.grid.shape[D - 1] && self.wanted.contains(&run.plane) {
            self.visit_plane(run.plane, visit);
        }
        while self.first + 1 < run.plane {
            self.spare.extend(self.planes.pop_front());
            self.first += 1;
        }
    }

    fn visit_plane(&mut self, plane: usize, visit: &impl Fn(&Row<D>, &mut Vec<FeaturePoint<D>>)) {
        let n = self.grid.shape[0];
        let size: usize = self.grid.shape[..D - 1].iter().product();
        let mut crests = std::mem::take(&mut self.crests);
        for start in (0..size).step_by(n) {
            let mut sample = coordinates(start, self.grid.shape);
            sample[D - 1] = plane;
            let row = Row {
                sample,
                index: plane * size + start,
                average: &self.planes[plane - self.first].average[start..start + n],
                beside: std::array::from_fn(|code| self.beside(sample, code)),
                grid: &self.grid,
            };
            visit(&row, &mut crests);
        }
        self.crests = crests;
    }

    /// The row beside that of a sample; the digits of `code` to base 3 are the steps along the axes but the
    /// first, plus 1.
    fn beside(&self, sample: [usize; D], mut code: usize) -> Beside<'_, D> {
        let (mut start, mut stride, mut plane) = (0, 1, sample[D - 1]);
        let mut signs = [1.0; D];
        for k in 0..D {
            if k > 0 {
                let place = (sample[k] + code % 3).checked_sub(1);
                let inside = place.filter(|&i| i < self.grid.shape[k]);
                if inside.is_none() {
                    signs[k] = -1.0; // mirrored: the sample itself
                }
                code /= 3;
                let place = inside.unwrap_or(sample[k]);
                if k == D - 1 {
                    plane = place;
                } else {
                    start += place * stride;
                }
            }
            stride *= self.grid.shape[k];
        }
        let (n, fields) = (self.grid.shape[0], &self.planes[plane - self.first]);
        Beside { slopes: fields.slopes.each_ref().map(|s| &s[start..start + n]), signs }
    }
}

/// A row of slopes, and the sign that each has as a neighbour's.
#[derive(Clone, Copy)]
struct Beside<'a, const D: usize> {
    slopes: [&'a [f32]; D],
    signs: [f32; D],
}

/// A row of samples along the first axis, whose neighbours can be asked.
pub(super) struct Row<'a, const D: usize> {
    /// Its first sample.
    pub(super) sample: [usize; D],
    /// The index of its first sample.
    pub(super) index: usize,
    /// The smoothed image.
    pub(super) average: &'a [f32],
    /// Rows by the steps to them; in the plane only the first three are.
    beside: [Beside<'a, D>; 9],
    grid: &'a Grid<D>,
}

impl<const D: usize> Row<'_, D> {
    /// The gradient at sample `x`, per lattice unit.
    pub(super) fn gradient(&self, x: usize) -> [f32; D] {
        self.beside[if D > 2 { 4 } else { 1 }].slopes.map(|slopes| slopes[x])
    }

    /// The slope along a direction at a neighbour of sample `x`.
    #[inline]
    fn slope(&self, direction: &[f32; D], x: usize, steps: [isize; D]) -> f32 {
        let (mut code, mut factor) = (0, 1);
        for k in 1..D {
            code += (steps[k] + 1) as usize * factor;
            factor *= 3;
        }
        let row = &self.beside[code];
        let place = x.checked_add_signed(steps[0]).filter(|&i| i < self.average.len());
        let first = if place.is_some() { 1.0 } else { -1.0 };
        let x = place.unwrap_or(x);
        let mut sum = direction[0] * first * row.slopes[0][x];
        for k in 1..D {
            sum += direction[k] * row.signs[k] * row.slopes[k][x];
        }
        sum
    }

    /// How far along a normal from sample `x` the smoothed image is greatest (`sign` 1) or least (−1), and its
    /// slope at the sample; `None` if it is neither near.
    ///
    /// The zero crossing of the slope, linear from the sample to its neighbours uphill: for a Gaussian
    /// ridge of deviation s this is off by 0.05/s² samples at most.
    pub(super) fn summit(&self, normal: &[f32; D], x: usize, sign: f32) -> Option<(f32, f32)> {
        let here = sign * self.slope(normal, x, [0; D]);
        let mut bend = 0.0;
        for k in 0..D {
            let uphill = if (here * normal[k]).is_sign_negative() { -1 } else { 1 };
            let there = sign * self.slope(normal, x, step::<D>(k, uphill));
            bend += normal[k] * uphill as f32 * (there - here) / self.grid.step[k] as f32;
        }
        (bend < 0.0).then(|| (-here / bend, sign * here))
    }

    /// How far along a normal from sample `x` the slope along it is greatest, and how great; `None` if it is
    /// not near, or the slope at the sample or a neighbour is not uphill.
    ///
    /// The top of a parabola, along the normal, through the logarithms of slopes at the sample and its neighbours, also those at
    /// corners: exact for the bell that a smoothed step's slope is.
    pub(super) fn steepest(&self, normal: &[f32; D], x: usize) -> Option<(f32, f32)> {
        let log = |steps| self.slope(normal, x, steps).ln(); // NaN is caught below
        let weights: [f32; D] = std::array::from_fn(|k| normal[k] / self.grid.step[k] as f32);
        let here = log([0; D]);
        let (mut rise, mut bend) = (0.0, 0.0);
        for k in 0..D {
            let [less, more] = [-1, 1].map(|by| log(step::<D>(k, by)));
            rise += 0.5 * weights[k] * (more - less);
            bend += weights[k] * weights[k] * (more - 2.0 * here + less);
            for l in 0..k {
                let corner = |a, b| {
                    let mut steps = step::<D>(k, a);
                    steps[l] = b;
                    log(steps)
                };
                let mixed = corner(1, 1) - corner(1, -1) - corner(-1, 1) + corner(-1, -1);
                bend += 0.5 * weights[k] * weights[l] * mixed;
            }
        }
        let offset = -rise / bend;
        (bend < 0.0 && offset.is_finite()).then(|| (offset, (here + 0.5 * rise * offset).exp()))
    }

    /// Second derivatives of the smoothed image, per squared lattice unit.
    pub(super) fn hessian(&self, x: usize) -> [[f64; D]; D] {
        let unit = |c: usize| std::array::from_fn(|k| if k == c { 1.0 } else { 0.0 });
        let change = |c: usize, k: usize| {
            let [less, more] = [-1, 1].map(|by| self.slope(&unit(c), x, step::<D>(k, by)));
            f64::from(more - less) / (2.0 * self.grid.step[k])
        };
        std::array::from_fn(|a| std::array::from_fn(|b| 0.5 * (change(a, b) + change(b, a))))
    }

    /// The crest at `offset` lattice units along the normal from sample `x`, if it is near enough.
    pub(super) fn crest(
        &self,
        x: usize,
        normal: [f32; D],
        offset: f32,
        strength: f32,
    ) -> Option<FeaturePoint<D>> {
        let steps: [f32; D] =
            std::array::from_fn(|k| offset * normal[k] / self.grid.step[k] as f32);
        // NaN is no step
        if !steps.iter().all(|step| step.abs() <= REACH) {
            return None;
        }
        let mut sample = self.sample;
        sample[0] = x;
        let last = |k: usize| (self.grid.shape[k] - 1) as f32;
        let place = |k: usize| (sample[k] as f32 + steps[k]).clamp(0.0, last(k));
        Some(FeaturePoint {
            index: self.index + x,
            position: std::array::from_fn(|k| place(k).into()),
            normal: normal.map(f64::from),
            strength: strength.into(),
        })
    }
}

/// The step to a neighbour along one axis.
fn step<const D: usize>(axis: usize, by: isize) -> [isize; D] {
    std::array::from_fn(|k| if k == axis { by } else { 0 })
}
