//! From the grey at every point to samples: rendering, blur, noise, bytes.

use super::random::Random;
use super::{Shade, SynthError, SynthOptions};
use crate::image::{Grid, Samples, gaussian};
use rayon::prelude::*;

/// Samples drawn by one task; even, since noise comes in pairs.
const BLOCK: usize = 4096;

/// The samples of a scene, x fastest.
///
/// Bytes that need no blur are drawn block by block, so that only they are held.
pub(super) fn draw<const D: usize>(
    shade: &Shade<D>,
    grid: &Grid<D>,
    options: &SynthOptions<D>,
) -> Result<Samples, SynthError> {
    let render = |block: usize, values: &mut [f32]| {
        for (i, value) in values.iter_mut().enumerate() {
            *value = shade(&position(grid, block * BLOCK + i)) as f32;
        }
    };
    if options.bytes && options.blur == 0.0 {
        return draw_bytes(&render, grid, options);
    }
    let mut values = zeros(0.0f32, grid)?;
    values.par_chunks_mut(BLOCK).enumerate().for_each(|(block, values)| render(block, values));
    if options.blur > 0.0 {
        gaussian(&mut values, grid.shape, [options.blur; D]);
    }
    if options.noise > 0.0 {
        let range = values.par_chunks(BLOCK).map(range_of).reduce(|| NO_RANGE, wider);
        let noise = Noise::new(options, range);
        let blocks = values.par_chunks_mut(BLOCK).enumerate();
        blocks.for_each(|(block, values)| noise.add(block, values));
    }
    Ok(if options.bytes {
        Samples::U8(values.par_iter().map(|&v| rounded(v)).collect())
    } else {
        Samples::F32(values)
    })
}

/// The same as bytes that need no blur. With noise the scene is drawn twice, since the noise depends on
/// its range.
fn draw_bytes<const D: usize>(
    render: &(impl Fn(usize, &mut [f32]) + Sync),
    grid: &Grid<D>,
    options: &SynthOptions<D>,
) -> Result<Samples, SynthError> {
    let noise = (options.noise > 0.0).then(|| {
        let count = grid.sample_count();
        let ends = (0..count.div_ceil(BLOCK)).into_par_iter().map(|block| {
            let mut values = [0.0; BLOCK];
            let values = &mut values[..BLOCK.min(count - block * BLOCK)];
            render(block, values);
            range_of(values)
        });
        Noise::new(options, ends.reduce(|| NO_RANGE, wider))
    });
    let mut bytes = zeros(0u8, grid)?;
    bytes.par_chunks_mut(BLOCK).enumerate().for_each(|(block, bytes)| {
        let mut values = [0.0; BLOCK];
        let values = &mut values[..bytes.len()];
        render(block, values);
        if let Some(noise) = &noise {
            noise.add(block, values);
        }
        bytes.iter_mut().zip(values).for_each(|(byte, value)| *byte = rounded(*value));
    });
    Ok(Samples::U8(bytes))
}

/// As many values as the grid has samples.
fn zeros<T: Copy, const D: usize>(zero: T, grid: &Grid<D>) -> Result<Vec<T>, SynthError> {
    let mut values = Vec::new();
    values
        .try_reserve_exact(grid.sample_count())
        .map_err(|_| SynthError::Memory { shape: grid.shape.to_vec() })?;
    values.resize(grid.sample_count(), zero);
    Ok(values)
}

/// The nearest byte.
fn rounded(value: f32) -> u8 {
    value.round() as u8 // `as` clips to 0..=255
}

/// The range of no samples.
const NO_RANGE: (f32, f32) = (f32::INFINITY, f32::NEG_INFINITY);

/// The least and greatest of samples, which are finite, since the greys are.
fn range_of(values: &[f32]) -> (f32, f32) {
    values.iter().fold(NO_RANGE, |range, &v| wider(range, (v, v)))
}

fn wider(a: (f32, f32), b: (f32, f32)) -> (f32, f32) {
    (a.0.min(b.0), a.1.max(b.1))
}

/// The lattice coordinates of a sample, which are world coordinates in a frame with origin 0.
fn position<const D: usize>(grid: &Grid<D>, mut index: usize) -> [f64; D] {
    std::array::from_fn(|k| {
        let i = index % grid.shape[k];
        index /= grid.shape[k];
        i as f64 * grid.step[k]
    })
}

/// White Gaussian noise, its deviation a share of the contrast.
struct Noise {
    seed: u64,
    deviation: f64,
}

impl Noise {
    /// The noise for samples of a range.
    fn new<const D: usize>(options: &SynthOptions<D>, (least, greatest): (f32, f32)) -> Self {
        Self { seed: options.seed, deviation: options.noise * f64::from(greatest - least) }
    }

    /// Adds the noise of a block to its samples.
    fn add(&self, block: usize, values: &mut [f32]) {
        let mut random = Random::noise(self.seed, block * BLOCK);
        for pair in values.chunks_mut(2) {
            for (value, normal) in pair.iter_mut().zip(random.normal_pair()) {
                *value = (f64::from(*value) + self.deviation * normal) as f32;
            }
        }
    }
}
