//! Separable convolution: arrays are cut into rows and columns, and weighted along one axis after another.
//!
//! Results depend neither on where the blocks end nor on the number of threads: see `kernel`.
//!
//! Outside the image samples are mirrored about its edges, `d c b a | a b c d | d c b a`.

use super::kernel::{Kernel, LANES};
use crate::parallel::prelude::*;

/// Samples in a scratch block: 256 KiB, half of a small second-level cache.
const BLOCK_SAMPLES: usize = 1 << 16;

/// The sample of an axis of `n` that stands `i` places from the axis' first, mirrored at both ends.
pub(super) fn mirrored(i: isize, n: usize) -> usize {
    let n = n as isize;
    let phase = i.rem_euclid(2 * n);
    (if phase < n { phase } else { 2 * n - 1 - phase }) as usize
}

/// Convolves `values` in place along every axis that has a kernel.
///
/// Scratch: one block of [`BLOCK_SAMPLES`] or a little more per thread.
pub(super) fn convolve<const D: usize>(
    values: &mut [f32],
    shape: [usize; D],
    kernels: &[Option<Kernel>; D],
) {
    convolve_between(values, shape, kernels, |_, _| {}, |_| {});
}

/// [`convolve`], where `before(start, part)` may change the samples from index `start` on just before they are
/// convolved, and `after(part)` just after, while they are in the cache: large images are read from memory less often.
pub(super) fn convolve_between<const D: usize>(
    values: &mut [f32],
    shape: [usize; D],
    kernels: &[Option<Kernel>; D],
    before: impl Fn(usize, &mut [f32]) + Sync,
    after: impl Fn(&mut [f32]) + Sync,
) {
    assert_eq!(values.len(), shape.iter().product::<usize>(), "samples for shape {shape:?}");
    if values.is_empty() {
        return;
    }
    let slab: usize = shape[..D - 1].iter().product();
    let few = BLOCK_SAMPLES.div_ceil(slab); // rows are small work: hand out many at once
    let slabs = values.par_chunks_mut(slab).with_min_len(few).enumerate();
    slabs.for_each_init(Vec::new, |scratch, (i, slab)| {
        before(i * slab.len(), slab);
        convolve_slab(slab, &shape[..D - 1], &kernels[..D - 1], scratch);
    });
    let Some(kernel) = &kernels[D - 1] else {
        return values.par_chunks_mut(BLOCK_SAMPLES).for_each(&after);
    };
    let width = block_width(shape[D - 1], kernel);
    let mut columns = Columns::new(values, slab, width);
    loop {
        // a few thousand lines at a time: the list of lines stays small beside the image
        let mut batch: Vec<_> = columns.by_ref().take(64).collect();
        if batch.is_empty() {
            break;
        }
        batch.par_iter_mut().for_each_init(Vec::new, |scratch, lines| {
            convolve_lines(lines, kernel, scratch);
            lines.iter_mut().for_each(|line| after(line));
        });
    }
}

/// Convolves one slab on this thread, along the axes that it has.
fn convolve_slab(
    slab: &mut [f32],
    shape: &[usize],
    kernels: &[Option<Kernel>],
    scratch: &mut Vec<f32>,
) {
    let mut inner = 1;
    for (&n, kernel) in shape.iter().zip(kernels) {
        if let Some(kernel) = kernel {
            for part in slab.chunks_exact_mut(n * inner) {
                if inner == 1 {
                    convolve_row(part, kernel, scratch);
                } else {
                    for mut lines in Columns::new(part, inner, block_width(n, kernel)) {
                        convolve_lines(&mut lines, kernel, scratch);
                    }
                }
            }
        }
        inner *= n;
    }
}

/// The columns of a block such that all of its lines, padded, fill the scratch.
fn block_width(n: usize, kernel: &Kernel) -> usize {
    let fitting = BLOCK_SAMPLES / (n + 2 * kernel.radius());
    (fitting / LANES * LANES).clamp(2 * LANES, 32 * LANES)
}

/// Convolves contiguous samples.
fn convolve_row(row: &mut [f32], kernel: &Kernel, scratch: &mut Vec<f32>) {
    let (n, r) = (row.len(), kernel.radius());
    pad_row(row, r, scratch);
    let shifted: Vec<&[f32]> = (0..=2 * r).map(|t| &scratch[t..t + n]).collect();
    kernel.weigh_rows(&shifted, row);
}

/// Writes `row` to `padded` with `r` mirrored samples before and behind it.
fn pad_row(row: &[f32], r: usize, padded: &mut Vec<f32>) {
    let n = row.len();
    padded.clear();
    padded.extend((0..r).map(|i| row[mirrored(i as isize - r as isize, n)]));
    padded.extend_from_slice(row);
    padded.extend((n..n + r).map(|i| row[mirrored(i as isize, n)]));
}

/// Convolves across lines of equal length, which lie at successive places along the axis.
fn convolve_lines(lines: &mut [&mut [f32]], kernel: &Kernel, scratch: &mut Vec<f32>) {
    let (n, r, width) = (lines.len(), kernel.radius(), lines[0].len());
    scratch.clear();
    for i in 0..n + 2 * r {
        scratch.extend_from_slice(lines[mirrored(i as isize - r as isize, n)]);
    }
    let rows: Vec<&[f32]> = scratch.chunks_exact(width).collect();
    for (line, rows) in lines.iter_mut().zip(rows.windows(2 * r + 1)) {
        kernel.weigh_rows(rows, line);
    }
}

/// Cuts an array of lines of `inner` samples into blocks of columns, each given as its lines.
struct Columns<'a> {
    lines: Vec<std::slice::ChunksMut<'a, f32>>,
}

impl<'a> Columns<'a> {
    fn new(values: &'a mut [f32], inner: usize, width: usize) -> Self {
        Self { lines: values.chunks_exact_mut(inner).map(|l| l.chunks_mut(width)).collect() }
    }
}

impl<'a> Iterator for Columns<'a> {
    type Item = Vec<&'a mut [f32]>;

    fn next(&mut self) -> Option<Self::Item> {
        self.lines.iter_mut().map(Iterator::next).collect()
    }
}
