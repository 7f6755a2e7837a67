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
//! (Darbon et al. 2008), three or five terms at once or widths doubling, so that the cost hardly grows with the patch and
//! sums do not drift.
//!
//! Departures: exp(−u) is (1 − u/32)³² up to u = 32, then 0, within 0.008 of it and far cheaper; outside the
//! image samples are mirrored about the outermost ones.
//!
//! Cost: O(samples · (2 search + 1)^D). Memory: one f32 a sample for the result, and a megabyte a thread. Same
//! bytes at any number of threads, since blocks are of one size.

mod block;
mod noise;

#[cfg(test)]
mod tests;

pub use noise::noise_level;

use crate::parallel::prelude::*;
use serde::{Deserialize, Serialize};

use crate::image::Grid;
use crate::watch::{Cancelled, Phase, Watch, check};

use block::{NoisyImage, index, place, row_place};

/// The samples of a block along each axis, in 2-D and 3-D: what stays in a second-level cache, in long rows.
const BLOCKS: [[usize; 3]; 2] = [[128, 128, 1], [64, 32, 8]];

/// The least noise that single precision tells from rounding, over the greatest sample.
const LEAST_NOISE: f64 = 1e-6;

/// The greatest radius of patches and windows; beyond it a run would never end.
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
    // enough at a time for every thread, few enough to look at the watch often
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
