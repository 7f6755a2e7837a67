//! The magnitude of an image's gradient, by Prewitt's operator or by derivatives of Gaussians.
//!
//! Both operators are separable: along one axis a slope, along the others an average. The image is
//! streamed along its last axis: a plane that comes in is weighted within the plane, axis by axis, what
//! components share once for all of them, and kept in a ring, from which the planes that have become
//! complete are weighted along the last axis. So the memory beside image and result is 3 r D planes a
//! thread, of a kernel that reaches r samples, and the image may stay in the type of its file.
//!
//! Where all samples that count are 0, as about a scanned head, so is the slope: such rows are passed over.

use super::convolve::{Kernel, KernelPair, mirrored};
use super::gaussian::kernel;
use super::{Grid, Samples};
use crate::watch::Cancelled;
use rayon::prelude::*;
use std::ops::Range;

/// Columns weighted at once along the last axis: 1 KiB a plane, so that the planes of a ring stay in
/// the second-level cache meanwhile.
const CHUNK: usize = 256;

/// Samples between two looks at whether to go on: a fraction of a second's work.
const BATCH_SAMPLES: usize = 1 << 25;

/// A Gaussian is not made narrower than this many samples along an axis that is coarser than others: at
/// 0.7 the slope of a ramp is still right to 0.6 %.
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
    /// The kernels along an axis of `n` samples, `ratio` times as far apart as those of the finest axis:
    /// average, slope per sample.
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

/// The magnitude of the gradient by Prewitt's operator, in sample values per lattice unit.
///
/// Along each axis the centred difference of the two neighbours, averaged over the three samples
/// across it along each other axis: 3 × 3 weights in 2-D, 3 × 3 × 3 in 3-D, scaled so that the
/// slope of a ramp is exact whatever the steps. Source: Hale (2001), section 4, applies it to
/// medical images. Samples are mirrored about the image's edges.
///
/// # Panics
/// If there are not as many samples as the grid's shape says.
pub fn prewitt_magnitude<const D: usize>(samples: &Samples, grid: &Grid<D>) -> Vec<f32> {
    plain_magnitude(samples, grid, Stencil::Prewitt)
}

/// The magnitude of the gradient of the smoothed image, in sample values per lattice unit.
///
/// Derivatives of a Gaussian of standard deviation `sigma`, in least steps of the grid, as of
/// [`gaussian_derivative`](super::gaussian_derivative), each over its axis' step. The Gaussian is as wide
/// in lattice units along every axis, so that edges of all directions are alike, but for coarse axes,
/// along which it is not narrower than 0.7 samples. Below 0.5 or so a
/// Gaussian is narrower than the samples are apart, and slopes come out too small; below 1/8 it
/// reaches no neighbour, and they are 0.
///
/// # Panics
/// If there are not as many samples as the grid's shape says, or σ is not finite and above 0.
pub fn gradient_magnitude<const D: usize>(
    samples: &Samples,
    grid: &Grid<D>,
    sigma: f64,
) -> Vec<f32> {
    assert!(sigma.is_finite() && sigma > 0.0, "σ is {sigma}");
    plain_magnitude(samples, grid, Stencil::Gaussian(sigma))
}

fn plain_magnitude<const D: usize>(
    samples: &Samples,
    grid: &Grid<D>,
    stencil: Stencil,
) -> Vec<f32> {
    assert_eq!(samples.len(), grid.sample_count(), "samples for shape {:?}", grid.shape);
    let fill = |start, out: &mut [f32]| samples.map_into(start, out, |s| s as f32);
    let result = magnitude(fill, grid, stencil, &mut |_| Ok(()));
    result.unwrap_or_default() // cannot be cancelled
}

/// The magnitude of the gradient of the samples that `fill(start, out)` writes.
///
/// `go_on` is asked now and then, with the share done.
///
/// # Errors
/// What `go_on` answers.
pub(crate) fn magnitude<const D: usize>(
    fill: impl Fn(usize, &mut [f32]) + Sync,
    grid: &Grid<D>,
    stencil: Stencil,
    go_on: &mut dyn FnMut(f64) -> Result<(), Cancelled>,
) -> Result<Vec<f32>, Cancelled> {
    if grid.sample_count() == 0 {
        return Ok(Vec::new());
    }
    let stream = Stream::new(fill, grid, stencil);
    let planes = grid.shape[D - 1];
    // each task starts by filling its ring, so that it should be long beside the kernel
    let fair = planes.div_ceil(2 * rayon::current_num_threads());
    let task = fair.min(BATCH_SAMPLES / stream.plane).max(4 * stream.radius).max(1) * stream.plane;
    let batch = task * (BATCH_SAMPLES / task).max(rayon::current_num_threads());

    let mut out = vec![0.0; grid.sample_count()];
    let count = out.len();
    for (b, part) in out.chunks_mut(batch).enumerate() {
        go_on((b * batch) as f64 / count as f64)?;
        part.par_chunks_mut(task).enumerate().for_each(|(t, part)| {
            stream.run((b * batch + t * task) / stream.plane, part);
        });
    }
    Ok(out)
}

/// What all tasks of one gradient share.
struct Stream<F, const D: usize> {
    fill: F,
    shape: [usize; D],
    /// Samples of a plane across the last axis.
    plane: usize,
    /// Per axis, the average, and the slope per lattice unit.
    kernels: [KernelPair; D],
    /// How far kernels reach along the last axis.
    radius: usize,
}

/// The planes that one task works on: `D` of a kind, the last of which holds averages alone, the one
/// before those with a slope along the last axis but one, and so on.
struct Planes<const D: usize> {
    /// Weighted along the axes so far.
    done: [Vec<f32>; D],
    /// Being weighted along one more.
    next: [Vec<f32>; D],
    /// A row of samples with its mirrored ends.
    row: Vec<f32>,
}

/// A plane kept in the ring, and which chunks of it are 0 throughout.
struct Slot {
    values: Vec<f32>,
    blank: Vec<bool>,
}

impl Slot {
    /// Takes a plane in exchange for the one that is no longer needed.
    fn take(&mut self, plane: &mut Vec<f32>) {
        std::mem::swap(&mut self.values, plane);
        for (blank, chunk) in self.blank.iter_mut().zip(self.values.chunks(CHUNK)) {
            *blank = is_blank(chunk);
        }
    }
}

impl<F: Fn(usize, &mut [f32]) + Sync, const D: usize> Stream<F, D> {
    fn new(fill: F, grid: &Grid<D>, stencil: Stencil) -> Self {
        let kernels = std::array::from_fn(|axis| {
            let pair = stencil.kernels(grid.shape[axis], grid.step[axis] / grid.least_step());
            KernelPair { slope: pair.slope.scaled(1.0 / grid.step[axis]), ..pair }
        });
        let radius = kernels[D - 1].average.radius();
        let plane = grid.shape[..D - 1].iter().product();
        Self { fill, shape: grid.shape, plane, kernels, radius }
    }

    /// Planes weighted along the last axis at once, so that the ring is read from memory few times.
    fn group(&self) -> usize {
        self.radius.max(1)
    }

    /// Planes held at a time.
    fn depth(&self) -> usize {
        2 * self.radius + self.group()
    }

    /// Writes the planes from `first` on, as many as fit in `out`.
    fn run(&self, first: usize, out: &mut [f32]) {
        let empty = || vec![0.0; self.plane];
        let slot = || Slot { values: empty(), blank: vec![true; self.plane.div_ceil(CHUNK)] };
        let mut ring: [Vec<Slot>; D] =
            std::array::from_fn(|_| (0..self.depth()).map(|_| slot()).collect());
        let empties = || std::array::from_fn(|_| empty());
        let mut planes = Planes { done: empties(), next: empties(), row: Vec::new() };
        let mut arrived = 0;
        for (g, out) in out.chunks_mut(self.group() * self.plane).enumerate() {
            let start = g * self.group();
            let needed = start + out.len() / self.plane + 2 * self.radius;
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
                self.combine(&ring, start, column, out);
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
    /// `planes.done`: slopes along earlier axes are averaged, of the averages the slope is taken too.
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

    /// Weighs a chunk of columns along the last axis, for all planes of `out`.
    ///
    /// The arrival `start` is the first that the first of these planes needs.
    fn combine(&self, ring: &[Vec<Slot>; D], start: usize, column: usize, out: &mut [f32]) {
        let columns = column..column + CHUNK.min(self.plane - column);
        let mut buffers = [[0.0; CHUNK]; 2];
        let [slope, sum] = buffers.each_mut().map(|b| &mut b[..columns.len()]);
        let arrivals = start..start + out.len() / self.plane + 2 * self.radius;
        let lines = ring.each_ref().map(|ring| {
            let slot = |arrival: usize| &ring[arrival % self.depth()];
            Lines {
                lines: arrivals.clone().map(|a| &slot(a).values[columns.clone()]).collect(),
                blank: arrivals.clone().map(|a| slot(a).blank[column / CHUNK]).collect(),
            }
        });
        let last = &self.kernels[D - 1];
        for (p, out) in out.chunks_exact_mut(self.plane).enumerate() {
            sum.fill(0.0);
            for (c, lines) in lines.iter().enumerate() {
                let Some(lines) = lines.around(p, 2 * self.radius + 1) else { continue };
                let kernel = if c == D - 1 { &last.slope } else { &last.average };
                kernel.weigh_rows(lines, slope);
                for (sum, s) in sum.iter_mut().zip(slope.iter()) {
                    *sum += s * s;
                }
            }
            for (out, sum) in out[columns.clone()].iter_mut().zip(sum.iter()) {
                *out = sum.sqrt();
            }
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

    /// The `count` lines from `first` on; `None` if they are all 0, and so whatever is made of them.
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

#[cfg(test)]
mod tests {
    use super::super::gaussian_derivative;
    use super::*;
    use rand::{RngExt, SeedableRng};

    fn noise(count: usize) -> Samples {
        let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(2);
        Samples::U8((0..count).map(|_| random.random::<u8>()).collect())
    }

    #[test]
    fn a_ramp_has_its_slope_per_lattice_unit() {
        let grid = Grid { shape: [30, 20, 25], step: [0.5, 2.0, 4.0] };
        let ramp = Samples::F32(
            (0..grid.sample_count())
                .map(|i| (3 * (i % 30) + 4 * (i / 30 % 20) + 12 * (i / 600)) as f32)
                .collect(),
        );
        let expected = (6.0f32.powi(2) + 2.0f32.powi(2) + 3.0f32.powi(2)).sqrt();
        let centre = 12 * 600 + 10 * 30 + 15;
        let prewitt = prewitt_magnitude(&ramp, &grid);
        assert!((prewitt[centre] - expected).abs() < 1e-4, "{}", prewitt[centre]);
        // a Gaussian cut at 4σ loses 0.1 % of its second moment
        let smooth = gradient_magnitude(&ramp, &grid, 1.5);
        assert!((smooth[centre] / expected - 1.0).abs() < 2e-3, "{}", smooth[centre]);
    }

    #[test]
    fn prewitt_is_the_printed_stencil() {
        let grid = Grid { shape: [5, 5], step: [1.0; 2] };
        let mut values = vec![0.0f32; 25];
        values[12] = 6.0;
        let found = prewitt_magnitude(&Samples::F32(values), &grid);
        let (d, l) = (2f32.sqrt(), 1.0);
        #[rustfmt::skip]
        let expected = [
            0.0, 0.0, 0.0, 0.0, 0.0,
            0.0,   d,   l,   d, 0.0,
            0.0,   l, 0.0,   l, 0.0,
            0.0,   d,   l,   d, 0.0,
            0.0, 0.0, 0.0, 0.0, 0.0,
        ];
        for (f, e) in found.iter().zip(expected) {
            assert!((f - e).abs() < 1e-6, "{found:?}");
        }
    }

    fn streamed_equals_whole<const D: usize>(shape: [usize; D], blank: Range<usize>) {
        let grid = Grid { shape, step: std::array::from_fn(|k| 1.0 + k as f64) };
        let mut values = noise(grid.sample_count()).to_f32();
        values[blank].fill(0.0);
        let samples = Samples::F32(values.clone());
        let mut squared = vec![0.0f32; values.len()];
        for k in 0..D {
            let order = std::array::from_fn(|axis| u8::from(axis == k));
            // as wide in lattice units along every axis
            let sigma = grid.step.map(|step| (1.5 / step).max(0.7));
            let slope = gaussian_derivative(&values, shape, sigma, order);
            for (sum, s) in squared.iter_mut().zip(slope) {
                *sum += (s / grid.step[k] as f32).powi(2);
            }
        }
        let streamed = gradient_magnitude(&samples, &grid, 1.5);
        for (i, (a, b)) in streamed.iter().zip(&squared).enumerate() {
            // values up to 255, each rounded a few dozen times
            assert!((a - b.sqrt()).abs() < 1e-3, "{a} {} at {i} of {shape:?}", b.sqrt());
        }
    }

    #[test]
    fn the_streamed_gradient_equals_the_one_from_whole_derivatives() {
        streamed_equals_whole([90, 130], 0..0);
        streamed_equals_whole([40, 23, 71], 0..0);
        streamed_equals_whole([1, 50], 0..0);
        streamed_equals_whole([50, 1], 0..0);
        streamed_equals_whole([20, 3, 2], 0..0);
        streamed_equals_whole([200], 0..0);
    }

    #[test]
    fn blank_rows_are_passed_over_where_nothing_is_near_alone() {
        streamed_equals_whole([90, 130], 20 * 90..60 * 90);
        streamed_equals_whole([40, 23, 71], 10 * 40 * 23 + 77..50 * 40 * 23 + 5);
        streamed_equals_whole([40, 60, 20], 8 * 40 * 60..9 * 40 * 60);
        streamed_equals_whole([70, 60], 0..70 * 60);
    }

    #[test]
    fn bits_do_not_depend_on_the_number_of_threads() {
        let grid = Grid { shape: [65, 33, 90], step: [1.0; 3] };
        let samples = noise(grid.sample_count());
        let run = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| gradient_magnitude(&samples, &grid, 1.0))
        };
        assert_eq!(run(1), run(3));
    }
}
