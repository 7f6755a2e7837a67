//! From the grey at every point to samples: rendering, blur, noise, bytes.

use super::random::Random;
use super::{Shade, SynthError, SynthOptions};
use crate::image::{Grid, Samples, gaussian};
use rayon::prelude::*;

/// Samples drawn by one task; even, since noise comes in pairs.
const BLOCK: usize = 4096;

/// The samples of a scene, x fastest.
pub(super) fn draw<const D: usize>(
    shade: &Shade<D>,
    grid: &Grid<D>,
    options: &SynthOptions<D>,
) -> Result<Samples, SynthError> {
    let mut values = Vec::new();
    values
        .try_reserve_exact(grid.sample_count())
        .map_err(|_| SynthError::Memory { shape: grid.shape.to_vec() })?;
    values.resize(grid.sample_count(), 0.0f32);
    values.par_chunks_mut(BLOCK).enumerate().for_each(|(block, values)| {
        for (i, value) in values.iter_mut().enumerate() {
            *value = shade(&position(grid, block * BLOCK + i)) as f32;
        }
    });
    if options.blur > 0.0 {
        gaussian(&mut values, grid.shape, [options.blur; D]);
    }
    if options.noise > 0.0 {
        add_noise(&mut values, options);
    }
    Ok(if options.bytes {
        // `as` clips to 0..=255
        Samples::U8(values.par_iter().map(|v| v.round() as u8).collect())
    } else {
        Samples::F32(values)
    })
}

/// The lattice coordinates of a sample, which are world coordinates in a frame with origin 0.
fn position<const D: usize>(grid: &Grid<D>, mut index: usize) -> [f64; D] {
    std::array::from_fn(|k| {
        let i = index % grid.shape[k];
        index /= grid.shape[k];
        i as f64 * grid.step[k]
    })
}

/// Adds white Gaussian noise, its deviation a share of the contrast.
fn add_noise<const D: usize>(values: &mut [f32], options: &SynthOptions<D>) {
    // the samples are finite, since the greys are
    let (least, greatest) = values
        .par_iter()
        .fold(|| (f32::INFINITY, f32::NEG_INFINITY), |(a, b), &v| (a.min(v), b.max(v)))
        .reduce(|| (f32::INFINITY, f32::NEG_INFINITY), |a, b| (a.0.min(b.0), a.1.max(b.1)));
    let deviation = options.noise * f64::from(greatest - least);
    values.par_chunks_mut(BLOCK).enumerate().for_each(|(block, values)| {
        let mut random = Random::noise(options.seed, block * BLOCK);
        for pair in values.chunks_mut(2) {
            for (value, normal) in pair.iter_mut().zip(random.normal_pair()) {
                *value = (f64::from(*value) + deviation * normal) as f32;
            }
        }
    });
}
