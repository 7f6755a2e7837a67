//! Noise taken off, edges kept: non-local means (Buades, Coll & Morel 2005), in any dimension.
//!
//! A sample becomes the weighted mean of those around it whose neighbourhoods, *patches*, look like its own.
//! A weight falls with the mean squared difference d² of two patches beyond 2σ², what noise of standard
//! deviation σ alone makes: exp(−max(d² − 2σ², 0) / h²), h = strength · σ. An edge is so averaged along itself
//! and not across.
//!
//! Order of the work: σ is estimated unless it is given; the image is cut into blocks, which are independent
//! of each other; in a block, for every offset of the search window, the squared differences of the block and
//! the block moved by the offset are summed over patches by moving sums along one axis after the other
//! (Darbon et al. 2008), widths doubling, so that the cost hardly grows with the patch and sums do not drift.
//!
//! Departures: exp(−u) is (1 − u/32)³² up to u = 32, then 0, within 0.008 of it and far cheaper; outside the
//! image samples are mirrored about the outermost ones.
//!
//! Cost: O(samples · (2 search + 1)^D). Memory: one f32 a sample for the result, and a megabyte a thread. Same
//! bytes at any number of threads, since blocks are of one size.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::image::Grid;
use crate::watch::{Cancelled, Phase, Watch, check};

/// The samples of a block along each axis, in 2-D and 3-D: what stays in a second-level cache.
const BLOCKS: [[usize; 3]; 2] = [[128, 128, 1], [32, 32, 16]];

/// Samples whose second differences the noise is estimated from, at most; more tell nothing new.
const ESTIMATE_SAMPLES: usize = 1 << 20;

/// The median of |x| for x of a normal distribution with standard deviation 1.
const NORMAL_MEDIAN: f64 = 0.674_489_75;

/// Noise over the greatest sample that single precision cannot tell from rounding.
const LEAST_NOISE: f64 = 1e-6;

/// The weight that a sample has in its own mean where no other patch is like its own.
const LEAST_WEIGHT: f32 = 1e-6;

/// The largest patch and search window that anyone could want; above, a run would never end.
const MOST_RADIUS: usize = 64;

/// How an image is denoised.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub struct DenoiseOptions {
    /// σ, the standard deviation of the noise, in the image's values. Default: [`noise_level`] of the image.
    pub noise: Option<f64>,
    /// h / σ: how different patches may be and still count. Default 0.4 (Buades, Coll & Morel 2011).
    pub strength: f64,
    /// Samples from a patch's middle to its sides. Default 2 in 2-D, 1 in 3-D: patches of 25 and 27 samples.
    pub patch_radius: usize,
    /// Samples from the window's middle to its sides. Default 10 in 2-D, 3 in 3-D: 441 and 343 patches.
    pub search_radius: usize,
}

impl DenoiseOptions {
    /// The defaults for images of `dimension` axes.
    pub fn for_dimension(dimension: usize) -> Self {
        let (patch_radius, search_radius) = if dimension == 2 { (2, 10) } else { (1, 3) };
        Self { noise: None, strength: 0.4, patch_radius, search_radius }
    }

    /// Whether every value is within its range.
    ///
    /// # Errors
    /// [`DenoiseError::Option`] names the first that is not.
    pub fn validate(&self) -> Result<(), DenoiseError> {
        let range = |name, value: f64, is_fine: bool, expected| match is_fine {
            true => Ok(()),
            false => Err(DenoiseError::Option { name, value, expected }),
        };
        let noise = self.noise.unwrap_or(0.0);
        range("noise", noise, noise.is_finite() && noise >= 0.0, "a finite number of 0 or more")?;
        let strength = self.strength;
        let is_fine = (0.01..=100.0).contains(&strength);
        range("strength", strength, is_fine, "a number from 0.01 to 100")?;
        let whole = |name, radius: usize| {
            range(name, radius as f64, radius <= MOST_RADIUS, "0 to 64 samples")
        };
        whole("patch radius", self.patch_radius)?;
        whole("search radius", self.search_radius)
    }
}

/// Why an image could not be denoised.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DenoiseError {
    /// The watch ended the work.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// An option is out of its range.
    #[error("{name} of denoising is {value}; expected {expected}")]
    Option {
        /// The option.
        name: &'static str,
        /// Its value.
        value: f64,
        /// What would have been right.
        expected: &'static str,
    },
    /// There are not as many samples as the grid says.
    #[error("{found} samples for a grid of {expected}")]
    SampleCount {
        /// The product of the grid's shape.
        expected: usize,
        /// The number of samples given.
        found: usize,
    },
}

/// σ of white noise, from the second differences along all axes one after another (Immerkær 1996): smooth
/// images and straight edges along an axis have none. The median of their sizes, over its value for σ = 1, so
/// that other edges hardly count.
///
/// Noise that is smooth itself, as after a filter, is underestimated.
pub fn noise_level<const D: usize>(values: &[f32], grid: &Grid<D>) -> f64 {
    let shape = grid.shape;
    let strides = grid.strides();
    let axes: Vec<usize> = (0..D).filter(|&k| shape[k] >= 3).collect();
    if axes.is_empty() {
        return 0.0;
    }
    // offset and weight of each sample of the product of [1, −2, 1] along the axes
    let mut stencil = vec![(0_isize, 1.0_f64)];
    for &k in &axes {
        let along = [(-1, 1.0), (0, -2.0), (1, 1.0)];
        let spread =
            |&(at, w): &(isize, f64)| along.map(|(j, v)| (at + j * strides[k] as isize, w * v));
        stencil = stencil.iter().flat_map(spread).collect();
    }
    let is_inside = |index: usize| {
        axes.iter().all(|&k| (1..shape[k] - 1).contains(&(index / strides[k] % shape[k])))
    };
    // a step that shares no factor with the rows visits all columns alike
    let mut step = values.len().div_ceil(ESTIMATE_SAMPLES);
    while common_divisor(step, shape[0]) > 1 {
        step += 1;
    }
    let indices = (0..values.len()).into_par_iter().step_by(step).filter(|&index| is_inside(index));
    let mut sizes: Vec<f32> = indices
        .map(|index| {
            let at = |&(j, w): &(isize, f64)| w * f64::from(values[index.wrapping_add_signed(j)]);
            stencil.iter().map(at).sum::<f64>().abs() as f32
        })
        .collect();
    if sizes.is_empty() {
        return 0.0;
    }
    let middle = sizes.len() / 2;
    let (_, median, _) = sizes.select_nth_unstable_by(middle, f32::total_cmp);
    // each axis multiplies the variance by 1² + 2² + 1²
    f64::from(*median) / (NORMAL_MEDIAN * 6f64.sqrt().powi(axes.len() as i32))
}

/// The image without its noise. `values` are finite, x fastest; only the grid's shape counts, since patches
/// and windows are in samples.
///
/// Where there is no noise (σ = 0, or not above rounding) the image is returned as it is.
///
/// # Errors
/// [`DenoiseError`].
pub fn denoise<const D: usize>(
    values: &[f32],
    grid: &Grid<D>,
    options: &DenoiseOptions,
    watch: &mut dyn Watch,
) -> Result<Vec<f32>, DenoiseError> {
    options.validate()?;
    let (found, expected) = (values.len(), grid.sample_count());
    if found != expected {
        return Err(DenoiseError::SampleCount { expected, found });
    }
    let mut result = values.to_vec();
    let noise = options.noise.unwrap_or_else(|| noise_level(values, grid));
    let greatest = values.par_iter().map(|v| v.abs()).reduce(|| 0.0, f32::max);
    if noise <= LEAST_NOISE * f64::from(greatest) {
        return Ok(result);
    }
    let image = NoisyImage { values, grid, options, noise };
    let size: [usize; D] = std::array::from_fn(|k| BLOCKS[D - 2][k]);
    let counts: [usize; D] = std::array::from_fn(|k| grid.shape[k].div_ceil(size[k]));
    let count: usize = counts.iter().product();
    // so many at a time that every thread has some, and the watch is asked often
    let batch = 2 * rayon::current_num_threads();
    for first in (0..count).step_by(batch) {
        check(watch, Phase::Potential, first as f64 / count as f64, None)?;
        let numbers = (first..count.min(first + batch)).into_par_iter();
        let blocks: Vec<_> = numbers
            .map(|number| {
                let start = std::array::from_fn(|k| place(number, k, &counts) * size[k]);
                let shape = std::array::from_fn(|k| size[k].min(grid.shape[k] - start[k]));
                (start, shape, image.block(start, shape))
            })
            .collect();
        for (start, shape, block) in blocks {
            for (row, values) in block.chunks_exact(shape[0]).enumerate() {
                let at =
                    index(&std::array::from_fn(|k| start[k] + row_place(row, k, &shape)), grid);
                result[at..at + shape[0]].copy_from_slice(values);
            }
        }
    }
    Ok(result)
}

fn common_divisor(a: usize, b: usize) -> usize {
    if b == 0 { a } else { common_divisor(b, a % b) }
}

/// Coordinate `axis` of element `number` of an array, its first axis fastest.
fn place<const D: usize>(number: usize, axis: usize, shape: &[usize; D]) -> usize {
    number / shape[..axis].iter().product::<usize>() % shape[axis]
}

/// The same for row `row` of an array, at the row's beginning.
fn row_place<const D: usize>(row: usize, axis: usize, shape: &[usize; D]) -> usize {
    place(row * shape[0], axis, shape)
}

fn index<const D: usize>(at: &[usize; D], grid: &Grid<D>) -> usize {
    grid.strides().iter().zip(at).map(|(stride, i)| stride * i).sum()
}

/// The sample that stands at `at`, mirrored about the first and last of `count`.
fn mirrored(at: isize, count: usize) -> usize {
    let period = 2 * (count as isize - 1).max(1);
    let at = at.rem_euclid(period);
    (at.min(period - at) as usize).min(count - 1)
}

/// What all blocks share.
struct NoisyImage<'a, const D: usize> {
    values: &'a [f32],
    grid: &'a Grid<D>,
    options: &'a DenoiseOptions,
    noise: f64,
}

/// Arrays of one shape, reused for every offset.
struct Sums {
    /// Weights times samples.
    weighted: Vec<f32>,
    weights: Vec<f32>,
    /// The greatest weight: that of the sample itself.
    greatest: Vec<f32>,
}

impl<const D: usize> NoisyImage<'_, D> {
    /// The block of `shape` samples from `start` on, denoised.
    fn block(&self, start: [usize; D], shape: [usize; D]) -> Vec<f32> {
        let (patch, search) = (self.options.patch_radius, self.options.search_radius);
        let wide = Grid { shape: shape.map(|n| n + 2 * (patch + search)), step: [1.0; D] };
        let source = self.gather(start, wide.shape);
        let patched = Grid { shape: shape.map(|n| n + 2 * patch), step: [1.0; D] };
        let count: usize = shape.iter().product();
        let zeros = || vec![0.0; count];
        let mut sums =
            Sums { weighted: zeros(), weights: zeros(), greatest: vec![LEAST_WEIGHT; count] };
        let mut squares = vec![0.0; patched.sample_count()];
        let mut scratch = squares.clone();
        let window = [2 * search + 1; D];
        for offset in 0..window.iter().product() {
            let offset: [usize; D] = std::array::from_fn(|k| place(offset, k, &window));
            if offset == [search; D] {
                continue;
            }
            square_differences(&source, &wide, (&mut squares, &patched), offset, search);
            for stride in patched.strides() {
                moving_sum(&mut squares, &mut scratch, stride, 2 * patch + 1);
            }
            let corner = offset.map(|o| o + patch);
            self.add(&mut sums, &shape, (&squares, &patched), (&source, &wide, corner));
        }
        let scale = self.noise as f32;
        for row in 0..count / shape[0] {
            let at: [usize; D] =
                std::array::from_fn(|k| row_place(row, k, &shape) + patch + search);
            let own = &source[index(&at, &wide)..][..shape[0]];
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
    fn gather(&self, start: [usize; D], shape: [usize; D]) -> Vec<f32> {
        let margin = (self.options.patch_radius + self.options.search_radius) as isize;
        let scale = (1.0 / self.noise) as f32;
        let strides = self.grid.strides();
        let places: [Vec<usize>; D] = std::array::from_fn(|k| {
            let at = |i: usize| mirrored((start[k] + i) as isize - margin, self.grid.shape[k]);
            (0..shape[k]).map(|i| at(i) * strides[k]).collect()
        });
        let mut samples = Vec::with_capacity(shape.iter().product());
        for row in 0..shape[1..].iter().product() {
            let base: usize = (1..D).map(|k| places[k][row_place(row, k, &shape)]).sum();
            samples.extend(places[0].iter().map(|x| scale * self.values[base + x]));
        }
        samples
    }

    /// Adds the samples at an offset, weighted by how alike the patches are.
    fn add(
        &self,
        sums: &mut Sums,
        shape: &[usize; D],
        (squares, patched): (&[f32], &Grid<D>),
        (source, wide, corner): (&[f32], &Grid<D>, [usize; D]),
    ) {
        let strength = self.options.strength.powi(2);
        let samples = (2 * self.options.patch_radius + 1).pow(D as u32) as f64;
        // 1 − u / 32, u = (d² − 2) / h², all in units of σ
        let slope = (1.0 / (32.0 * strength * samples)) as f32;
        let at_zero = (1.0 + 2.0 / (32.0 * strength)) as f32;
        let n = shape[0];
        for row in 0..shape[1..].iter().product() {
            let at: [usize; D] = std::array::from_fn(|k| row_place(row, k, shape));
            let squares = &squares[index(&at, patched)..][..n];
            let moved = std::array::from_fn(|k| at[k] + corner[k]);
            let source = &source[index(&moved, wide)..][..n];
            let own = row * n..(row + 1) * n;
            let weighted = &mut sums.weighted[own.clone()];
            let weights = &mut sums.weights[own.clone()];
            let greatest = &mut sums.greatest[own];
            for k in 0..n {
                let base = (at_zero - slope * squares[k]).clamp(0.0, 1.0);
                let weight = to_the_32nd(base);
                weighted[k] += weight * source[k];
                weights[k] += weight;
                greatest[k] = greatest[k].max(weight);
            }
        }
    }
}

/// Squared five times: the same bits on every machine, which `powi` does not promise.
#[inline]
fn to_the_32nd(base: f32) -> f32 {
    let square = |v: f32| v * v;
    square(square(square(square(square(base)))))
}

/// (v(x) − v(x + t))² on a block and a patch around it; `offset` is t plus the search radius.
fn square_differences<const D: usize>(
    source: &[f32],
    wide: &Grid<D>,
    (squares, patched): (&mut [f32], &Grid<D>),
    offset: [usize; D],
    search: usize,
) {
    let n = patched.shape[0];
    for (row, squares) in squares.chunks_exact_mut(n).enumerate() {
        let at: [usize; D] = std::array::from_fn(|k| row_place(row, k, &patched.shape));
        let own = &source[index(&at.map(|i| i + search), wide)..][..n];
        let moved = std::array::from_fn(|k| at[k] + offset[k]);
        let other = &source[index(&moved, wide)..][..n];
        for ((square, a), b) in squares.iter_mut().zip(own).zip(other) {
            *square = (a - b) * (a - b);
        }
    }
}

/// Replaces v(i) by v(i) + v(i + stride) + …, `width` terms, by sums of 1, 2, 4 … terms. Where terms are past
/// the end they are left out.
fn moving_sum(values: &mut Vec<f32>, scratch: &mut Vec<f32>, stride: usize, width: usize) {
    scratch.fill(0.0);
    let (mut done, mut span) = (0, 1);
    loop {
        if width & span != 0 {
            let from = (done * stride).min(values.len());
            scratch.iter_mut().zip(&values[from..]).for_each(|(sum, v)| *sum += v);
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
    std::mem::swap(values, scratch);
}

#[cfg(test)]
#[path = "denoise_tests.rs"]
mod tests;
