//! From the grey at every point to samples: rendering, blur, noise, bytes.

use super::random::Random;
use super::{Shade, SynthError, SynthOptions};
use crate::image::{Grid, Samples, coordinates, gaussian};
use crate::parallel::prelude::*;

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
        let ends = values.par_chunks(BLOCK).map(Ends::of).reduce(|| Ends::NONE, Ends::union);
        let noise = Noise::new(options, ends);
        let blocks = values.par_chunks_mut(BLOCK).enumerate();
        blocks.for_each(|(block, values)| noise.add(block, values));
    }
    Ok(if options.bytes {
        Samples::U8(values.par_iter().map(|&v| rounded(v)).collect())
    } else {
        Samples::F32(values.into())
    })
}

/// The samples as bytes that need no blur. With noise the scene is drawn twice, since the noise depends on its contrast.
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
            Ends::of(values)
        });
        Noise::new(options, ends.reduce(|| Ends::NONE, Ends::union))
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
    Ok(Samples::U8(bytes.into()))
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

/// The least and the greatest of some samples, which are finite, since the greys are.
#[derive(Clone, Copy)]
struct Ends {
    least: f32,
    greatest: f32,
}

impl Ends {
    /// Those of no samples.
    const NONE: Self = Self { least: f32::INFINITY, greatest: f32::NEG_INFINITY };

    fn of(values: &[f32]) -> Self {
        values.iter().fold(Self::NONE, |ends, &v| ends.union(Self { least: v, greatest: v }))
    }

    fn union(self, other: Self) -> Self {
        Self { least: self.least.min(other.least), greatest: self.greatest.max(other.greatest) }
    }
}

/// The lattice coordinates of a sample, which are world coordinates in a frame with origin 0.
fn position<const D: usize>(grid: &Grid<D>, index: usize) -> [f64; D] {
    let sample = coordinates(index, grid.shape);
    std::array::from_fn(|k| sample[k] as f64 * grid.step[k])
}

/// White Gaussian noise, its deviation a share of the contrast.
struct Noise {
    seed: u64,
    deviation: f64,
}

impl Noise {
    /// The noise for samples between `ends`.
    fn new<const D: usize>(options: &SynthOptions<D>, ends: Ends) -> Self {
        let contrast = f64::from(ends.greatest - ends.least);
        Self { seed: options.seed, deviation: options.noise * contrast }
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
