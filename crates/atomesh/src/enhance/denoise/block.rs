//! One block of an image, denoised: weighted means over all offsets of the search window.

use super::DenoiseOptions;
use crate::image::Grid;

/// The weight of a sample in its own mean where no other patch is like its own.
pub(super) const LEAST_WEIGHT: f32 = 1e-6;

/// 1 − u / 32 below which a weight is taken as 0: it would be 1e-29, which nothing adds up to, and a little below numbers
/// lose digits, with which processors are slow.
const LEAST_BASE: f32 = 0.125;

/// Coordinate `axis` of element `number` of an array, its first axis fastest.
pub(super) fn place<const D: usize>(number: usize, axis: usize, shape: &[usize; D]) -> usize {
    number / shape[..axis].iter().product::<usize>() % shape[axis]
}

/// The same for row `row` of an array, at the row's beginning.
pub(super) fn row_place<const D: usize>(row: usize, axis: usize, shape: &[usize; D]) -> usize {
    place(row * shape[0], axis, shape)
}

pub(super) fn index<const D: usize>(at: &[usize; D], grid: &Grid<D>) -> usize {
    grid.strides().iter().zip(at).map(|(stride, i)| stride * i).sum()
}

/// The sample that stands at `at`, mirrored about the first and last of `count`.
pub(super) fn mirrored(at: isize, count: usize) -> usize {
    let period = 2 * (count as isize - 1).max(1);
    let at = at.rem_euclid(period);
    (at.min(period - at) as usize).min(count - 1)
}

/// What all blocks share.
pub(super) struct NoisyImage<'a, const D: usize> {
    pub values: &'a [f32],
    pub grid: &'a Grid<D>,
    pub options: &'a DenoiseOptions,
    /// σ.
    pub noise: f64,
}

/// Values of a part of the image, x fastest.
struct Part<const D: usize> {
    values: Vec<f32>,
    shape: [usize; D],
}

impl<const D: usize> Part<D> {
    /// Zeros.
    fn new(shape: [usize; D]) -> Self {
        Self { values: vec![0.0; shape.iter().product()], shape }
    }

    /// `count` values along the first axis, from a place on.
    fn run(&self, from: &[usize; D], count: usize) -> &[f32] {
        let (mut index, mut stride) = (0, 1);
        for k in 0..D {
            index += from[k] * stride;
            stride *= self.shape[k];
        }
        &self.values[index..][..count]
    }
}

/// Sums over the offsets of the search window, for each sample of a block.
struct Sums<const D: usize> {
    shape: [usize; D],
    /// Weights times samples.
    weighted: Vec<f32>,
    weights: Vec<f32>,
    /// The greatest weight: that of the sample itself.
    greatest: Vec<f32>,
}

impl<const D: usize> NoisyImage<'_, D> {
    /// The block of `shape` samples from `start` on, denoised.
    pub fn block(&self, start: [usize; D], shape: [usize; D]) -> Vec<f32> {
        #[cfg(target_arch = "x86_64")]
        if std::arch::is_x86_feature_detected!("avx2") {
            // SAFETY: the processor has what the function needs.
            return unsafe { self.block_avx2(start, shape) };
        }
        self.block_plain(start, shape)
    }

    /// The same with wider registers: each operation is rounded alone, so the bits are the same.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn block_avx2(&self, start: [usize; D], shape: [usize; D]) -> Vec<f32> {
        self.block_plain(start, shape)
    }

    #[inline(always)]
    fn block_plain(&self, start: [usize; D], shape: [usize; D]) -> Vec<f32> {
        let (patch, search) = (self.options.patch_radius, self.options.search_radius);
        let source = self.gather(start, shape.map(|n| n + 2 * (patch + search)));
        let count: usize = shape.iter().product();
        let zeros = || vec![0.0; count];
        let mut sums = Sums {
            shape,
            weighted: zeros(),
            weights: zeros(),
            greatest: vec![LEAST_WEIGHT; count],
        };
        let mut squares = Part::new(shape.map(|n| n + 2 * patch));
        let mut scratch = squares.values.clone();
        let grid = Grid { shape: squares.shape, step: [1.0; D] };
        let window = [2 * search + 1; D];
        for offset in 0..window.iter().product() {
            let offset: [usize; D] = std::array::from_fn(|k| place(offset, k, &window));
            if offset == [search; D] {
                continue;
            }
            square_differences(&source, &mut squares, offset, search);
            for stride in grid.strides() {
                moving_sum(&mut squares.values, &mut scratch, stride, 2 * patch + 1);
            }
            let corner = offset.map(|o| o + patch);
            self.add(&mut sums, &squares, &source, corner);
        }
        let scale = self.noise as f32;
        for row in 0..count / shape[0] {
            let at: [usize; D] =
                std::array::from_fn(|k| row_place(row, k, &shape) + patch + search);
            let own = source.run(&at, shape[0]);
            for (k, v) in (row * shape[0]..).zip(own) {
                let weight = sums.greatest[k];
                sums.weighted[k] += weight * v;
                sums.weights[k] += weight;
                sums.weighted[k] *= scale / sums.weights[k];
            }
        }
        sums.weighted
    }

    /// The samples of a block and around it, in units of σ.
    fn gather(&self, start: [usize; D], shape: [usize; D]) -> Part<D> {
        let margin = (self.options.patch_radius + self.options.search_radius) as isize;
        let scale = (1.0 / self.noise) as f32;
        let strides = self.grid.strides();
        let places: [Vec<usize>; D] = std::array::from_fn(|k| {
            let at = |i: usize| mirrored((start[k] + i) as isize - margin, self.grid.shape[k]);
            (0..shape[k]).map(|i| at(i) * strides[k]).collect()
        });
        let mut values = Vec::with_capacity(shape.iter().product());
        for row in 0..shape[1..].iter().product() {
            let base: usize = (1..D).map(|k| places[k][row_place(row, k, &shape)]).sum();
            values.extend(places[0].iter().map(|x| scale * self.values[base + x]));
        }
        Part { values, shape }
    }

    /// Adds the samples of `source` from `corner` on, weighted by how alike the patches are.
    #[inline(always)]
    fn add(&self, sums: &mut Sums<D>, squares: &Part<D>, source: &Part<D>, corner: [usize; D]) {
        let strength = self.options.strength.powi(2);
        let samples = (2 * self.options.patch_radius + 1).pow(D as u32) as f64;
        // 1 − u / 32, u = (d² − 2) / h², all in units of σ
        let slope = (1.0 / (32.0 * strength * samples)) as f32;
        let at_zero = (1.0 + 2.0 / (32.0 * strength)) as f32;
        let (shape, n) = (sums.shape, sums.shape[0]);
        for row in 0..shape[1..].iter().product() {
            let at: [usize; D] = std::array::from_fn(|k| row_place(row, k, &shape));
            let squares = squares.run(&at, n);
            let moved = std::array::from_fn(|k| at[k] + corner[k]);
            let source = source.run(&moved, n);
            let own = row * n..(row + 1) * n;
            let weighted = &mut sums.weighted[own.clone()];
            let weights = &mut sums.weights[own.clone()];
            let greatest = &mut sums.greatest[own];
            for k in 0..n {
                let base = lower(at_zero - slope * squares[k], 1.0);
                let weight = to_the_32nd(if base < LEAST_BASE { 0.0 } else { base });
                weighted[k] += weight * source[k];
                weights[k] += weight;
                greatest[k] = greater(greatest[k], weight);
            }
        }
    }
}

/// The greater of two, neither of them NaN: one instruction.
#[inline(always)]
fn greater(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// The lower of two, neither of them NaN.
#[inline(always)]
fn lower(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// Squared five times: the same bits on every machine, which `powi` does not promise.
#[inline(always)]
fn to_the_32nd(base: f32) -> f32 {
    let square = |v: f32| v * v;
    square(square(square(square(square(base)))))
}

/// (v(x) − v(x + t))² on a block and a patch around it; `offset` is t plus the search radius.
#[inline(always)]
fn square_differences<const D: usize>(
    source: &Part<D>,
    squares: &mut Part<D>,
    offset: [usize; D],
    search: usize,
) {
    let (shape, n) = (squares.shape, squares.shape[0]);
    for (row, squares) in squares.values.chunks_exact_mut(n).enumerate() {
        let at: [usize; D] = std::array::from_fn(|k| row_place(row, k, &shape));
        let own = source.run(&at.map(|i| i + search), n);
        let moved = std::array::from_fn(|k| at[k] + offset[k]);
        let other = source.run(&moved, n);
        for ((square, a), b) in squares.iter_mut().zip(own).zip(other) {
            *square = (a - b) * (a - b);
        }
    }
}

/// Replaces v(i) by v(i) + v(i + stride) + …, `width` terms, by sums of 1, 2, 4 … terms. Where terms are past
/// the end they are left out.
#[inline(always)]
pub(super) fn moving_sum(
    values: &mut Vec<f32>,
    scratch: &mut Vec<f32>,
    stride: usize,
    width: usize,
) {
    match width {
        3 => sum_at_once(values, scratch, stride, |[a, b, c]| a + (b + c)),
        5 => sum_at_once(values, scratch, stride, |[a, b, c, d, e]| a + ((b + c) + (d + e))),
        _ => sum_doubling(values, scratch, stride, width),
    }
    std::mem::swap(values, scratch);
}

/// The sums of the patches that are usual, in one pass and to the same bits as [`sum_doubling`].
#[inline(always)]
fn sum_at_once<const N: usize>(
    values: &[f32],
    sums: &mut [f32],
    stride: usize,
    sum: impl Fn([f32; N]) -> f32,
) {
    let whole = values.len().saturating_sub((N - 1) * stride);
    let moved: [&[f32]; N] = std::array::from_fn(|k| &values[(k * stride).min(values.len())..]);
    let (inside, rest) = sums.split_at_mut(whole);
    if whole > 0 {
        let moved = moved.map(|values| &values[..whole]);
        for (i, out) in inside.iter_mut().enumerate() {
            *out = sum(moved.map(|values| values[i]));
        }
    }
    for (i, out) in (whole..).zip(rest) {
        *out = sum(moved.map(|values| values.get(i).copied().unwrap_or(0.0)));
    }
}

/// Sums of any width.
#[inline(always)]
fn sum_doubling(values: &mut [f32], sums: &mut [f32], stride: usize, width: usize) {
    sums.fill(0.0);
    let (mut done, mut span) = (0, 1);
    loop {
        if width & span != 0 {
            let from = (done * stride).min(values.len());
            sums.iter_mut().zip(&values[from..]).for_each(|(sum, v)| *sum += v);
            done += span;
        }
        if done == width {
            break;
        }
        let shift = (span * stride).min(values.len());
        for i in 0..values.len() - shift {
            values[i] += values[i + shift];
        }
        span *= 2;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_at_once_are_those_by_doubling() {
        let values: Vec<f32> = (0..200).map(|i| (i * i * 31 % 97) as f32 / 9.7).collect();
        for (width, stride) in [(3, 1), (3, 20), (5, 1), (5, 17), (5, 90), (3, 300)] {
            let (mut fast, mut slow, mut sums) = (values.clone(), values.clone(), values.clone());
            moving_sum(&mut fast, &mut vec![7.0; 200], stride, width);
            sum_doubling(&mut slow, &mut sums, stride, width);
            assert_eq!(fast, sums, "{width} {stride}");
        }
    }
}
