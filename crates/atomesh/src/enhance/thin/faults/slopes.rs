//! The slopes of layers: by how many samples they go down for one sample along x, and along y.

use crate::image::{Grid, StructureTensor, coordinates};
use crate::parallel::prelude::*;
use crate::watch::{Cancelled, Watch};

/// Standard deviation, in samples, of the Gaussian whose derivatives are taken: white noise passes, but is the
/// same in all directions and turns no normal, while a wider one would blur the jumps at faults.
const DERIVATIVE: f64 = 1.0;

/// Standard deviation, in samples, of the window along layers: short, lest layers be joined across faults.
const ACROSS: f64 = 3.0;

/// Standard deviation, in samples, of the window down: some layers, which slope alike.
const DOWN: f64 = 8.0;

/// The greatest slope along which layers are followed.
const STEEPEST: f32 = 2.0;

/// The slopes along x (and y), in samples of depth a sample, x fastest.
///
/// A layer of normal n slopes by −nₓ/n along x, over the last component of n.
pub(super) fn slopes<const D: usize>(
    values: &[f32],
    grid: &Grid<D>,
    watch: &mut dyn Watch,
) -> Result<Vec<Vec<f32>>, Cancelled> {
    let samples = Grid { shape: grid.shape, step: [1.0; D] };
    let window = std::array::from_fn(|k| if k + 1 == D { DOWN } else { ACROSS });
    let tensor = StructureTensor::new(values, &samples, DERIVATIVE, window, watch)?;
    let mut slopes = vec![vec![0.0; values.len()]; D - 1];
    let width = grid.shape[0];
    let mut parts: Vec<_> = slopes.iter_mut().map(|s| s.chunks_mut(width)).collect();
    let mut rows: Vec<Vec<&mut [f32]>> = (0..values.len() / width)
        .map(|_| parts.iter_mut().filter_map(Iterator::next).collect())
        .collect();
    rows.par_iter_mut().enumerate().for_each(|(row, slopes)| {
        let Some(normals) = tensor.row(coordinates(row * width, grid.shape)) else { return };
        for x in 0..width {
            let (normal, _) = normals.normal(x);
            for (axis, slopes) in slopes.iter_mut().enumerate() {
                let slope = -normal[axis] / normal[D - 1]; // infinite where a layer stands on end
                slopes[x] = if slope.is_nan() { 0.0 } else { slope.clamp(-STEEPEST, STEEPEST) };
            }
        }
    });
    Ok(slopes)
}
