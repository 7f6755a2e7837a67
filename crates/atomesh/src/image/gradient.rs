//! The magnitude of an image's gradient, by Prewitt's operator or by derivatives of Gaussians.
//!
//! Both operators are separable: along one axis a slope, along the others an average. The image is
//! streamed along its last axis: per plane that comes in, each component is weighted within the
//! plane and kept in a ring, from which the planes that have become complete are weighted along the
//! last axis. So the memory beside image and result is 3 r D planes a thread, of a kernel that
//! reaches r samples, and the image may stay in the type of its file.

use super::convolve::{Kernel, convolve_slab, mirrored};
use super::gaussian::kernel;
use super::{Grid, Samples};
use crate::watch::Cancelled;
use rayon::prelude::*;
use std::cmp::Ordering;

/// Columns weighted at once along the last axis: 2 KiB a plane, so that the planes of a ring stay in
/// the second-level cache meanwhile.
const CHUNK: usize = 512;

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
    fn kernels(self, n: usize, ratio: f64) -> (Kernel, Kernel) {
        match self {
            Stencil::Prewitt => {
                (Kernel::new(&[1.0 / 3.0; 2], false, n), Kernel::new(&[0.0, 0.5], true, n))
            }
            Stencil::Gaussian(sigma) => {
                let sigma = (sigma / ratio).max(sigma.min(NARROWEST));
                (kernel(sigma, 0, n), kernel(sigma, 1, n))
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
    /// Of each component, a slope along its own axis and averages along later ones; the averages
    /// along earlier ones are shared between components.
    kernels: [[Option<Kernel>; D]; D],
    /// Per axis, the average along it alone.
    shared: [[Option<Kernel>; D]; D],
    /// How far kernels reach along the last axis.
    radius: usize,
}

impl<F: Fn(usize, &mut [f32]) + Sync, const D: usize> Stream<F, D> {
    fn new(fill: F, grid: &Grid<D>, stencil: Stencil) -> Self {
        let pairs: [_; D] = std::array::from_fn(|axis| {
            stencil.kernels(grid.shape[axis], grid.step[axis] / grid.least_step())
        });
        let kernels = std::array::from_fn(|component| {
            std::array::from_fn(|axis| {
                let (average, slope): &(Kernel, Kernel) = &pairs[axis];
                match axis.cmp(&component) {
                    Ordering::Less => None,
                    Ordering::Equal => Some(slope.scaled(1.0 / grid.step[axis])),
                    Ordering::Greater => Some(average.clone()),
                }
            })
        });
        let shared = std::array::from_fn(|along| {
            std::array::from_fn(|axis| (axis == along).then(|| pairs[axis].0.clone()))
        });
        let (average, slope) = &pairs[D - 1];
        let radius = average.radius().max(slope.radius());
        let plane = grid.shape[..D - 1].iter().product();
        Self { fill, shape: grid.shape, plane, kernels, shared, radius }
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
        let depth = self.depth();
        let mut ring: [Vec<f32>; D] = std::array::from_fn(|_| vec![0.0; depth * self.plane]);
        let mut scratch = Vec::new();
        let mut arrived = 0;
        for (g, out) in out.chunks_mut(self.group() * self.plane).enumerate() {
            let start = g * self.group();
            let needed = start + out.len() / self.plane + 2 * self.radius;
            for arrival in arrived..needed {
                let place = (first + arrival) as isize - self.radius as isize;
                let source = mirrored(place, self.shape[D - 1]);
                let at = arrival % depth * self.plane;
                let slots = ring.each_mut().map(|r| &mut r[at..at + self.plane]);
                self.weigh_within(source * self.plane, slots, &mut scratch);
            }
            arrived = needed;
            for column in (0..self.plane).step_by(CHUNK) {
                self.combine(&ring, start, column, out);
            }
        }
    }

    /// Weighs the plane that starts at sample `start` along all axes but the last, per component.
    fn weigh_within(&self, start: usize, mut slots: [&mut [f32]; D], scratch: &mut Vec<f32>) {
        let Some((average, slopes)) = slots.split_last_mut() else { return };
        let shape = &self.shape[..D - 1];
        (self.fill)(start, average);
        for (component, slope) in slopes.iter_mut().enumerate() {
            slope.copy_from_slice(average);
            convolve_slab(slope, shape, &self.kernels[component][..D - 1], scratch);
            convolve_slab(average, shape, &self.shared[component][..D - 1], scratch);
        }
    }

    /// Weighs a chunk of columns along the last axis, for all planes of `out`.
    ///
    /// The arrival `start` is the first that the first of these planes needs.
    fn combine(&self, ring: &[Vec<f32>; D], start: usize, column: usize, out: &mut [f32]) {
        let width = CHUNK.min(self.plane - column);
        let mut slope = [0.0; CHUNK];
        let slope = &mut slope[..width];
        for (ring, kernels) in ring.iter().zip(&self.kernels) {
            let Some(kernel) = &kernels[D - 1] else { continue };
            let nearer = self.radius - kernel.radius();
            let planes = out.len() / self.plane;
            let rows: Vec<&[f32]> = (start + nearer..start + planes + 2 * self.radius - nearer)
                .map(|arrival| &ring[arrival % self.depth() * self.plane + column..][..width])
                .collect();
            let windows = rows.windows(2 * kernel.radius() + 1);
            for (out, rows) in out.chunks_exact_mut(self.plane).zip(windows) {
                kernel.weigh_rows(rows, slope);
                for (sum, s) in out[column..column + width].iter_mut().zip(slope.iter()) {
                    *sum += s * s;
                }
            }
        }
        for out in out.chunks_exact_mut(self.plane) {
            for sum in &mut out[column..column + width] {
                *sum = sum.sqrt();
            }
        }
    }
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

    fn streamed_equals_whole<const D: usize>(shape: [usize; D]) {
        let grid = Grid { shape, step: std::array::from_fn(|k| 1.0 + k as f64) };
        let samples = noise(grid.sample_count());
        let values = samples.to_f32();
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
        streamed_equals_whole([90, 130]);
        streamed_equals_whole([40, 23, 71]);
        streamed_equals_whole([1, 50]);
        streamed_equals_whole([50, 1]);
        streamed_equals_whole([20, 3, 2]);
        streamed_equals_whole([200]);
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
