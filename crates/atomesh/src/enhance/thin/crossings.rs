//! Non-maximum suppression between samples: where derivatives along a direction cross zero.
//!
//! The image is smoothed and differentiated plane by plane. Three planes are held at a time, so that each row of samples
//! knows its neighbours. Slopes are those of the smoothed image, linear or a parabola between samples. Outside the image
//! samples are mirrored, so that a slope along an axis has the other sign there.
//!
//! Cost: O(σ) per sample, and what the visitor does. Memory: a few planes a thread, and the crests.

use crate::crests::FeaturePoint;
use crate::enhance::quantile::{Order, Ranks};
use crate::image::{Grid, Run, Stencil, Stream, coordinates};
use crate::parallel::prelude::*;
use crate::watch::{Cancelled, Phase, Watch, check};
use std::collections::VecDeque;
use std::ops::Range;

/// The greatest distance of a crest from its sample along any axis, in samples: half a sample, and the error of rounding
/// and differences, lest crests have gaps.
const REACH: f32 = 0.6;

/// The share of all crests that have full strength.
const CLIPPED: f64 = 0.02;

/// Samples between two looks at the watch: a fraction of a second's work.
const BATCH_SAMPLES: usize = 1 << 24;

/// The crests that `visit` finds, row by row, in the order of their samples. The image is what `fill(start, out)` writes,
/// smoothed by a Gaussian of `sigma` least steps.
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

/// Scales strengths to 0…1: the strongest 2 % of all crests, and those as strong as the weakest of these, have 1.
pub(super) fn scale_strengths<const D: usize>(crests: &mut [FeaturePoint<D>]) {
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
}

/// The smoothed image of one plane, and its slopes.
struct Plane<const D: usize> {
    average: Vec<f32>,
    slopes: [Vec<f32>; D],
}

/// The planes that one task holds, and what was found in them.
struct Window<const D: usize> {
    grid: Grid<D>,
    /// The numbers of the planes that are visited.
    wanted: Range<usize>,
    /// The number of the first plane held.
    first: usize,
    planes: VecDeque<Plane<D>>,
    /// Planes no longer needed, to be filled again.
    spare: Vec<Plane<D>>,
    crests: Vec<FeaturePoint<D>>,
}

impl<const D: usize> Window<D> {
    fn new(grid: Grid<D>, wanted: Range<usize>) -> Self {
        let first = wanted.start.saturating_sub(1);
        let (planes, spare) = (VecDeque::new(), Vec::new());
        Self { grid, wanted, first, planes, spare, crests: Vec::new() }
    }

    /// Takes a run in, and visits the rows of the planes whose neighbours are there.
    fn take(&mut self, run: &Run<D>, visit: &impl Fn(&Row<D>, &mut Vec<FeaturePoint<D>>)) {
        let size: usize = self.grid.shape[..D - 1].iter().product();
        while self.first + self.planes.len() <= run.plane {
            self.planes.push_back(self.spare.pop().unwrap_or_else(|| Plane {
                average: vec![0.0; size],
                slopes: std::array::from_fn(|_| vec![0.0; size]),
            }));
        }
        let plane = &mut self.planes[run.plane - self.first];
        let end = run.column + run.average.len();
        plane.average[run.column..end].copy_from_slice(run.average);
        for (slopes, run_slopes) in plane.slopes.iter_mut().zip(run.slopes) {
            slopes[run.column..end].copy_from_slice(run_slopes);
        }
        if end < size {
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

    /// The row beside that of a sample. The digits of `code` to base 3 are 1 plus the steps along the second axis and the
    /// third.
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
        let (n, plane) = (self.grid.shape[0], &self.planes[plane - self.first]);
        Beside { slopes: plane.slopes.each_ref().map(|s| &s[start..start + n]), signs }
    }
}

/// An extreme along a normal through a sample.
#[derive(Clone, Copy)]
pub(super) struct Summit {
    /// Its distance from the sample along the normal, in lattice units.
    pub(super) offset: f32,
    /// The slope of the smoothed image along the normal: at the sample, or, of the steepest place, there.
    pub(super) slope: f32,
    /// The second derivative, along the normal, of the smoothed image, or, of the steepest place, of the logarithm of
    /// its slope.
    pub(super) bend: f32,
}

/// A row of slopes, and the sign that each has as a neighbour's.
#[derive(Clone, Copy)]
struct Beside<'a, const D: usize> {
    slopes: [&'a [f32]; D],
    signs: [f32; D],
}

/// A row of samples along the first axis, which knows its neighbours.
pub(super) struct Row<'a, const D: usize> {
    /// Its first sample.
    pub(super) sample: [usize; D],
    /// The index of its first sample.
    pub(super) index: usize,
    /// The smoothed image.
    pub(super) average: &'a [f32],
    /// Rows by the steps to them; in the plane the first three count.
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

    /// Where along a normal through sample `x` the smoothed image is greatest (`sign` 1) or least (−1); `None` if it
    /// is not bent that way.
    ///
    /// The zero crossing of the slope, linear from the sample to its neighbours uphill: for a Gaussian
    /// ridge of deviation s this is off by 0.05/s² samples at most.
    pub(super) fn summit(&self, normal: &[f32; D], x: usize, sign: f32) -> Option<Summit> {
        let here = sign * self.slope(normal, x, [0; D]);
        let mut bend = 0.0;
        for k in 0..D {
            let uphill = if (here * normal[k]).is_sign_negative() { -1 } else { 1 };
            let there = sign * self.slope(normal, x, step::<D>(k, uphill));
            bend += normal[k] * uphill as f32 * (there - here) / self.grid.step[k] as f32;
        }
        (bend < 0.0).then(|| Summit { offset: -here / bend, slope: sign * here, bend })
    }

    /// Where along a normal through sample `x` the slope along it is greatest; `None` if the slope is not bent
    /// downwards, or not uphill at the sample and all neighbours.
    ///
    /// The top of a parabola, along the normal, through the logarithms of slopes at the sample and its neighbours, those
    /// at corners among them: exact for the bell that a smoothed step's slope is.
    pub(super) fn steepest(&self, normal: &[f32; D], x: usize) -> Option<Summit> {
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
        let slope = (here + 0.5 * rise * offset).exp();
        (bend < 0.0 && offset.is_finite()).then_some(Summit { offset, slope, bend })
    }

    /// Second derivatives of the smoothed image, per squared lattice unit.
    pub(super) fn hessian(&self, x: usize) -> [[f64; D]; D] {
        let (own, mut factor) = (if D > 2 { 4 } else { 1 }, 1);
        let mut changes = [[0.0; D]; D];
        for k in 0..D {
            let twice = 2.0 * self.grid.step[k];
            if k == 0 {
                let [less, more] = [x.saturating_sub(1), (x + 1).min(self.average.len() - 1)];
                // mirrored: the sample itself, with the slope along the row turned
                let [first, last] = [(less, less == x), (more, more == x)];
                for c in 0..D {
                    let at = |(i, is_mirrored): (usize, bool)| {
                        let slope = self.beside[own].slopes[c][i];
                        if is_mirrored && c == 0 { -slope } else { slope }
                    };
                    changes[c][k] = f64::from(at(last) - at(first)) / twice;
                }
                continue;
            }
            let [less, more] = [own - factor, own + factor].map(|code| &self.beside[code]);
            for c in 0..D {
                let at = |row: &Beside<'_, D>| row.signs[c] * row.slopes[c][x];
                changes[c][k] = f64::from(at(more) - at(less)) / twice;
            }
            factor *= 3;
        }
        std::array::from_fn(|a| std::array::from_fn(|b| 0.5 * (changes[a][b] + changes[b][a])))
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
        // false for NaN
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
