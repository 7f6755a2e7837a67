//! Averages and slopes of an image, plane by plane, in one pass over the samples.
//!
//! The operators are separable: along one axis a slope, along the others an average. The image is
//! streamed along its last axis. A plane that comes in is weighted within the plane, axis by axis, sums that components
//! share only once, and kept in a ring. Planes whose neighbours are all in the ring are weighted along the last axis. So
//! the memory is 3 r D planes a thread, r being the kernel's reach in samples, and no gradient of the whole image is held.
//!
//! Where all samples within reach are 0, as about a scanned head, so is the slope: such rows are skipped.

use super::Grid;
use super::convolve::mirrored;
use super::gaussian::kernel;
use super::kernel::{Kernel, KernelPair};
use std::ops::Range;

/// Columns weighted at once along the last axis: 1 KiB a plane, so that all planes of a ring stay in
/// the second-level cache.
const CHUNK: usize = 256;

/// The least width of a Gaussian, in samples, along an axis that is coarser than others: at 0.7 the slope of a ramp is
/// still right to 0.6 %.
const NARROWEST: f64 = 0.7;

/// How slopes are taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Stencil {
    /// Centred difference of the neighbours, averaged over three samples along each other axis.
    Prewitt,
    /// Derivative of a Gaussian of this standard deviation, in least steps of the grid.
    Gaussian(f64),
}

impl Stencil {
    /// The average, and the slope per sample, along an axis of `n` samples, whose step is `ratio` least steps.
    fn kernels(self, n: usize, ratio: f64) -> KernelPair {
        match self {
            Stencil::Prewitt => KernelPair {
                average: Kernel::new(&[1.0 / 3.0; 2], false, n),
                slope: Kernel::new(&[0.0, 0.5], true, n),
            },
            Stencil::Gaussian(sigma) => {
                let sigma = (sigma / ratio).max(sigma.min(NARROWEST));
                KernelPair { average: kernel(sigma, 0, n), slope: kernel(sigma, 1, n) }
            }
        }
    }
}

/// The smoothed image along a run of samples of one plane.
pub(crate) struct Run<'a, const D: usize> {
    /// The plane, counted along the last axis.
    pub(crate) plane: usize,
    /// The place of the first sample in its plane.
    pub(crate) column: usize,
    /// The smoothed samples; zeros unless the stream is [`Stream::with_smoothed`].
    pub(crate) average: &'a [f32],
    /// Their slopes along each axis, per lattice unit.
    pub(crate) slopes: [&'a [f32]; D],
}

/// What all tasks of one pass over an image share.
pub(crate) struct Stream<F, const D: usize> {
    fill: F,
    shape: [usize; D],
    /// Samples of a plane across the last axis.
    plane: usize,
    /// Per axis, the average, and the slope per lattice unit.
    kernels: [KernelPair; D],
    /// How far kernels reach along the last axis.
    radius: usize,
    /// Whether smoothed samples are wanted, beside their slopes.
    smoothed: bool,
}

/// The planes that one task works on: `D` of a kind. The last holds averages alone, the one before those with a slope
/// along the last axis but one, and so on.
struct Planes<const D: usize> {
    /// Weighted along the axes so far.
    done: [Vec<f32>; D],
    /// Being weighted along one more.
    next: [Vec<f32>; D],
    /// A row of samples with its mirrored ends.
    row: Vec<f32>,
}

/// A plane kept in the ring, and which chunks of it are 0 throughout.
struct RingPlane {
    values: Vec<f32>,
    blank: Vec<bool>,
}

impl RingPlane {
    /// Takes a plane in exchange for the one that is no longer needed.
    fn take(&mut self, plane: &mut Vec<f32>) {
        std::mem::swap(&mut self.values, plane);
        for (blank, chunk) in self.blank.iter_mut().zip(self.values.chunks(CHUNK)) {
            *blank = is_blank(chunk);
        }
    }
}

impl<F: Fn(usize, &mut [f32]) + Sync, const D: usize> Stream<F, D> {
    /// A pass over the samples that `fill(start, out)` writes from index `start` on.
    pub(crate) fn new(fill: F, grid: &Grid<D>, stencil: Stencil) -> Self {
        let kernels = std::array::from_fn(|axis| {
            let pair = stencil.kernels(grid.shape[axis], grid.step[axis] / grid.least_step());
            KernelPair { slope: pair.slope.scaled(1.0 / grid.step[axis]), ..pair }
        });
        let radius = kernels[D - 1].average.radius();
        let plane = grid.shape[..D - 1].iter().product();
        Self { fill, shape: grid.shape, plane, kernels, radius, smoothed: false }
    }

    /// The same pass, with smoothed samples beside their slopes.
    pub(crate) fn with_smoothed(self) -> Self {
        Self { smoothed: true, ..self }
    }

    /// Samples of a plane across the last axis.
    pub(crate) fn plane(&self) -> usize {
        self.plane
    }

    /// The fewest planes worth a task: before its first it has to read as many as the kernel is long.
    pub(crate) fn least_planes(&self) -> usize {
        (4 * self.radius).max(1)
    }

    /// Planes weighted along the last axis at once: more of them read the ring from memory less often.
    fn group(&self) -> usize {
        self.radius.max(1)
    }

    /// Planes held at a time.
    fn depth(&self) -> usize {
        2 * self.radius + self.group()
    }

    /// Shows `visit` all samples of some planes, each once. Those of a plane come in their order, and planes end in
    /// their order.
    pub(crate) fn run(&self, planes: Range<usize>, visit: &mut impl FnMut(&Run<D>)) {
        let (first, count) = (planes.start, planes.len());
        let empty = || vec![0.0; self.plane];
        let slot = || RingPlane { values: empty(), blank: vec![true; self.plane.div_ceil(CHUNK)] };
        let mut ring: [Vec<RingPlane>; D] =
            std::array::from_fn(|_| (0..self.depth()).map(|_| slot()).collect());
        let empties = || std::array::from_fn(|_| empty());
        let mut planes = Planes { done: empties(), next: empties(), row: Vec::new() };
        let mut arrived = 0;
        for start in (0..count).step_by(self.group()) {
            let group = start..count.min(start + self.group());
            let needed = group.end + 2 * self.radius;
            for arrival in arrived..needed {
                let place = (first + arrival) as isize - self.radius as isize;
                let source = mirrored(place, self.shape[D - 1]);
                self.weigh_within(source * self.plane, &mut planes);
                for (ring, plane) in ring.iter_mut().zip(&mut planes.done) {
                    ring[arrival % self.depth()].take(plane);
                }
            }
            arrived = needed;
            for column in (0..self.plane).step_by(CHUNK) {
                self.combine(&ring, first, group.clone(), column, visit);
            }
        }
    }

    /// Weighs the plane that starts at sample `start` along all axes but the last.
    fn weigh_within(&self, start: usize, planes: &mut Planes<D>) {
        if D == 1 {
            return (self.fill)(start, &mut planes.done[0]);
        }
        self.weigh_along_rows(start, planes);
        let mut inner = self.shape[0];
        for axis in 1..D - 1 {
            std::mem::swap(&mut planes.done, &mut planes.next);
            let part = inner * self.shape[axis];
            for start in (0..self.plane).step_by(part) {
                self.weigh_across(axis, start..start + part, inner, planes);
            }
            inner = part;
        }
    }

    /// Reads the plane that starts at sample `start`, row by row: averages and slopes along the first
    /// axis.
    fn weigh_along_rows(&self, start: usize, planes: &mut Planes<D>) {
        let (n, pair) = (self.shape[0], &self.kernels[0]);
        let r = pair.average.radius();
        planes.row.resize(n + 2 * r, 0.0);
        let (slopes, averages) = planes.done.split_at_mut(D - 1);
        let rows = averages[0].chunks_exact_mut(n).zip(slopes[0].chunks_exact_mut(n));
        for (row, (average, slope)) in rows.enumerate() {
            (self.fill)(start + row * n, &mut planes.row[r..r + n]);
            for i in 0..r {
                planes.row[i] = planes.row[r + mirrored(i as isize - r as isize, n)];
                planes.row[r + n + i] = planes.row[r + mirrored((n + i) as isize, n)];
            }
            if is_blank(&planes.row[r..r + n]) {
                average.fill(0.0);
                slope.fill(0.0);
                continue;
            }
            let shifted: Vec<&[f32]> = (0..=2 * r).map(|t| &planes.row[t..t + n]).collect();
            pair.weigh_rows(&shifted, average, slope);
        }
    }

    /// Weighs a part of `planes.next` across lines of `inner` samples into the same part of
    /// `planes.done`: slopes along earlier axes are averaged; averages are averaged, and give the slope along this axis.
    fn weigh_across(&self, axis: usize, part: Range<usize>, inner: usize, planes: &mut Planes<D>) {
        let pair = &self.kernels[axis];
        let Planes { done, next, .. } = planes;
        let r = pair.average.radius();
        for c in 0..axis {
            let lines = Lines::padded(&next[c][part.clone()], inner, r);
            for (i, out) in done[c][part.clone()].chunks_exact_mut(inner).enumerate() {
                match lines.around(i, 2 * r + 1) {
                    Some(lines) => pair.average.weigh_rows(lines, out),
                    None => out.fill(0.0),
                }
            }
        }
        let lines = Lines::padded(&next[D - 1][part.clone()], inner, r);
        let (slopes, averages) = done.split_at_mut(D - 1);
        let averages = averages[0][part.clone()].chunks_exact_mut(inner);
        let outs = averages.zip(slopes[axis][part].chunks_exact_mut(inner));
        for (i, (average, slope)) in outs.enumerate() {
            match lines.around(i, 2 * r + 1) {
                Some(lines) => pair.weigh_rows(lines, average, slope),
                None => {
                    average.fill(0.0);
                    slope.fill(0.0);
                }
            }
        }
    }

    /// Weighs a chunk of columns along the last axis, for all planes of a group. Its planes are counted from plane
    /// `first`; each needs the arrivals from its own number on.
    fn combine(
        &self,
        ring: &[Vec<RingPlane>; D],
        first: usize,
        group: Range<usize>,
        column: usize,
        visit: &mut impl FnMut(&Run<D>),
    ) {
        let columns = column..column + CHUNK.min(self.plane - column);
        let mut buffers = ([0.0; CHUNK], [[0.0; CHUNK]; D]);
        let arrivals = group.start..group.end + 2 * self.radius;
        let lines = ring.each_ref().map(|ring| {
            let slot = |arrival: usize| &ring[arrival % self.depth()];
            Lines {
                lines: arrivals.clone().map(|a| &slot(a).values[columns.clone()]).collect(),
                blank: arrivals.clone().map(|a| slot(a).blank[column / CHUNK]).collect(),
            }
        });
        let last = &self.kernels[D - 1];
        let weigh = |kernel: &Kernel, c: usize, p: usize, out: &mut [f32]| match lines[c]
            .around(p, 2 * self.radius + 1)
        {
            Some(lines) => kernel.weigh_rows(lines, out),
            None => out.fill(0.0),
        };
        for p in group.clone() {
            let (average, slopes) = &mut buffers;
            for (c, slope) in slopes.iter_mut().enumerate() {
                let kernel = if c == D - 1 { &last.slope } else { &last.average };
                weigh(kernel, c, p - group.start, &mut slope[..columns.len()]);
            }
            if self.smoothed {
                weigh(&last.average, D - 1, p - group.start, &mut average[..columns.len()]);
            }
            visit(&Run {
                plane: first + p,
                column,
                average: &average[..columns.len()],
                slopes: slopes.each_ref().map(|slope| &slope[..columns.len()]),
            });
        }
    }
}

/// Lines to be weighted against each other, and which of them are 0 throughout.
struct Lines<'a> {
    lines: Vec<&'a [f32]>,
    blank: Vec<bool>,
}

impl<'a> Lines<'a> {
    /// The lines of `inner` samples in order, with `r` mirrored ones before and behind them.
    fn padded(values: &'a [f32], inner: usize, r: usize) -> Self {
        let n = values.len() / inner;
        let line = |i: usize| &values[mirrored(i as isize - r as isize, n) * inner..][..inner];
        let lines: Vec<&[f32]> = (0..n + 2 * r).map(line).collect();
        Self { blank: lines.iter().map(|line| is_blank(line)).collect(), lines }
    }

    /// The `count` lines from `first` on; `None` if they are all 0, and so is any sum of them.
    fn around(&self, first: usize, count: usize) -> Option<&[&'a [f32]]> {
        let within = first..first + count;
        let blank = self.blank[within.clone()].iter().all(|&blank| blank);
        (!blank).then(|| &self.lines[within])
    }
}

/// Whether all values are 0, and none −0.
fn is_blank(values: &[f32]) -> bool {
    // without a branch in the inner loop, which is then vectorised
    values.chunks(64).all(|some| some.iter().fold(0, |bits, v| bits | v.to_bits()) == 0)
}
