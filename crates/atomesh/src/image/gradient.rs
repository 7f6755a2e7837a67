//! The magnitude of an image's gradient, by Prewitt's operator or by derivatives of Gaussians.
//!
//! The image is streamed: it stays in the type of its file, and no copy of it is made.

use super::stream::{Stencil, Stream};
use super::{Grid, Samples};
use crate::parallel::prelude::*;
use crate::watch::Cancelled;

/// Samples between two looks at the watch: a fraction of a second's work.
const BATCH_SAMPLES: usize = 1 << 25;

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
/// [`gaussian_derivative`](super::gaussian_derivative), each over its axis' step. The Gaussian has one width
/// in lattice units, so that edges of all directions are alike, but along coarse axes it is at least 0.7 samples wide.
/// Below σ = 0.5 or so a Gaussian is narrower than the samples are apart, and slopes come out too small; below 1/8 it
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
/// `go_on` is called now and then with the share done.
///
/// # Errors
/// Those of `go_on`.
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
    let plane = stream.plane();
    let task = fair.min(BATCH_SAMPLES / plane).max(stream.least_planes()) * plane;
    let batch = task * (BATCH_SAMPLES / task).max(rayon::current_num_threads());

    let mut out = vec![0.0; grid.sample_count()];
    let count = out.len();
    for (b, part) in out.chunks_mut(batch).enumerate() {
        go_on((b * batch) as f64 / count as f64)?;
        part.par_chunks_mut(task).enumerate().for_each(|(t, part)| {
            let first = (b * batch + t * task) / plane;
            stream.run(first..first + part.len() / plane, &mut |run| {
                let start = (run.plane - first) * plane + run.column;
                for (i, out) in part[start..start + run.slopes[0].len()].iter_mut().enumerate() {
                    let mut sum = 0.0;
                    for slope in run.slopes {
                        sum += slope[i] * slope[i];
                    }
                    *out = sum.sqrt();
                }
            });
        });
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::super::gaussian_derivative;
    use super::*;
    use rand::{RngExt, SeedableRng};
    use std::ops::Range;

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
        let found = prewitt_magnitude(&Samples::F32(values.into()), &grid);
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
        let samples = Samples::F32(values.clone().into());
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
