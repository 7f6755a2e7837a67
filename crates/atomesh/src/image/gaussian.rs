//! Gaussian smoothing and derivatives of Gaussians.
//!
//! Kernels are sampled Gaussians cut off at four standard deviations, smoothing ones with sum 1;
//! samples are mirrored about the edges of the image. These are SciPy's conventions
//! (`scipy.ndimage.gaussian_filter` with its defaults), so that results can be checked against it.
//!
//! Cost: O(σ) per sample and axis.

use super::convolve::{convolve, convolve_between};
use super::kernel::Kernel;

/// Where kernels end, in standard deviations.
const TRUNCATE: f64 = 4.0;

/// Smooths `values`, x fastest, in place by a Gaussian of standard deviation `sigma` in samples.
///
/// A σ of 0 leaves its axis alone. An axis may be shorter than the kernel. Scratch memory is about
/// 256 KiB a thread. The result does not depend on the number of threads.
///
/// # Panics
/// If there are not as many values as `shape` says, or a σ is negative or not finite.
///
/// ```
/// let mut values = vec![0.0, 0.0, 4.0, 0.0, 0.0];
/// atomesh::image::gaussian(&mut values, [5, 1], [1.0, 0.0]);
/// assert!(values[2] < 2.0 && values[1] > 0.5 && values[1] == values[3]);
/// ```
pub fn gaussian<const D: usize>(values: &mut [f32], shape: [usize; D], sigma: [f64; D]) {
    convolve(values, shape, &kernels(shape, sigma, [0; D]));
}

/// [`gaussian`], where `before(start, part)` makes the samples from index `start` on just before they are
/// smoothed, and `after(part)` may change them just after: large images are read from memory less often.
pub(crate) fn gaussian_between<const D: usize>(
    values: &mut [f32],
    shape: [usize; D],
    sigma: [f64; D],
    before: impl Fn(usize, &mut [f32]) + Sync,
    after: impl Fn(&mut [f32]) + Sync,
) {
    convolve_between(values, shape, &kernels(shape, sigma, [0; D]), before, after);
}

/// The derivative of the smoothed `values`, `order[k]` times along axis k, per sample.
///
/// Orders are 0, 1 or 2. The kernel is the sampled Gaussian, made to sum 1, times the polynomial
/// of its derivative: −x/σ² or (x² − σ²)/σ⁴. Cutting it off makes it 0.1 % weak for σ of 1 and more.
///
/// # Panics
/// As [`gaussian`]; also if an order exceeds 2, or is above 0 on an axis with σ = 0.
pub fn gaussian_derivative<const D: usize>(
    values: &[f32],
    shape: [usize; D],
    sigma: [f64; D],
    order: [u8; D],
) -> Vec<f32> {
    let mut derivative = vec![0.0; values.len()];
    gaussian_derivative_into(&mut derivative, values, shape, sigma, order);
    derivative
}

/// [`gaussian_derivative`] written to `out`, of the same length.
pub(crate) fn gaussian_derivative_into<const D: usize>(
    out: &mut [f32],
    values: &[f32],
    shape: [usize; D],
    sigma: [f64; D],
    order: [u8; D],
) {
    let copy = |start, part: &mut [f32]| {
        let end = start + part.len();
        part.copy_from_slice(&values[start..end]);
    };
    convolve_between(out, shape, &kernels(shape, sigma, order), copy, |_| {});
}

/// The kernels per axis; none where nothing is to be done.
fn kernels<const D: usize>(
    shape: [usize; D],
    sigma: [f64; D],
    order: [u8; D],
) -> [Option<Kernel>; D] {
    std::array::from_fn(|k| {
        assert!(sigma[k] >= 0.0 && sigma[k].is_finite(), "σ is {} along axis {k}", sigma[k]);
        assert!(order[k] <= 2, "derivative of order {} along axis {k}", order[k]);
        assert!(order[k] == 0 || sigma[k] > 0.0, "derivative with σ = 0 along axis {k}");
        (sigma[k] > 0.0 && shape[k] > 0).then(|| kernel(sigma[k], order[k], shape[k]))
    })
}

/// The kernel of a derivative for an axis of `n` samples.
pub(super) fn kernel(sigma: f64, order: u8, n: usize) -> Kernel {
    // mirrored samples repeat: far beyond the axis a wider Gaussian is as flat to rounding
    let sigma = sigma.min(16.0 * n as f64);
    let radius = (TRUNCATE * sigma + 0.5) as usize;
    let variance = sigma * sigma;
    let mut half: Vec<f64> =
        (0..=radius).map(|t| (-0.5 * (t * t) as f64 / variance).exp()).collect();
    let sum = half[0] + 2.0 * half[1..].iter().sum::<f64>();
    for (t, w) in half.iter_mut().enumerate() {
        let t = t as f64;
        // as weights of f[i + t] an odd derivative has the sign of t
        *w *= match order {
            0 => 1.0,
            1 => t / variance,
            _ => (t * t - variance) / (variance * variance),
        } / sum;
    }
    Kernel::new(&half, order == 1, n)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    /// Seeded samples in 0..1.
    fn noise(count: usize, seed: u64) -> Vec<f32> {
        let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(seed);
        (0..count).map(|_| random.random::<f32>()).collect()
    }

    fn mirrored(i: i64, n: usize) -> usize {
        let n = n as i64;
        let mut i = i;
        // step by step, unlike the fast path
        while i < 0 || i >= n {
            i = if i < 0 { -1 - i } else { 2 * n - 1 - i };
        }
        i as usize
    }

    /// The definition, one axis after another, in double precision.
    fn direct<const D: usize>(
        values: &[f32],
        shape: [usize; D],
        sigma: [f64; D],
        order: [u8; D],
    ) -> Vec<f64> {
        let mut f: Vec<f64> = values.iter().map(|&v| v.into()).collect();
        let mut stride = 1;
        for k in 0..D {
            let (n, s) = (shape[k], sigma[k]);
            if s > 0.0 {
                let r = (4.0 * s + 0.5) as i64;
                let gauss = |t: i64| (-0.5 * (t * t) as f64 / (s * s)).exp();
                let sum: f64 = (-r..=r).map(gauss).sum();
                let weight = |t: i64| {
                    let x = t as f64;
                    let polynomial = match order[k] {
                        0 => 1.0,
                        1 => x / (s * s),
                        _ => (x * x / (s * s) - 1.0) / (s * s),
                    };
                    polynomial * gauss(t) / sum
                };
                f = (0..f.len())
                    .map(|i| {
                        let at = (i / stride % n) as i64;
                        let start = i - at as usize * stride;
                        (-r..=r).map(|t| weight(t) * f[start + mirrored(at + t, n) * stride]).sum()
                    })
                    .collect();
            }
            stride *= n;
        }
        f
    }

    fn equals_direct<const D: usize>(shape: [usize; D], sigma: [f64; D], order: [u8; D]) {
        let values = noise(shape.iter().product(), 7);
        let fast = gaussian_derivative(&values, shape, sigma, order);
        let slow = direct(&values, shape, sigma, order);
        for (i, (f, s)) in fast.iter().zip(&slow).enumerate() {
            // a few dozen roundings of values below 1, less where they cancel
            assert!(
                (f64::from(*f) - s).abs() < 2e-6,
                "{f} {s} at {i}: {shape:?} {sigma:?} {order:?}"
            );
        }
    }

    #[test]
    fn the_fast_way_equals_the_definition() {
        for order in [[0, 0], [1, 0], [0, 1], [2, 0], [1, 1], [0, 2]] {
            equals_direct([70, 41], [2.0, 1.3], order);
        }
        for order in [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 0, 2]] {
            equals_direct([67, 18, 9], [1.0, 0.6, 2.4], order);
        }
        equals_direct([300], [3.0], [1]);
    }

    #[test]
    fn axes_may_be_shorter_than_the_kernel() {
        for n in 1..=9 {
            for order in 0..=2 {
                for sigma in [0.7, 2.0, 5.0, 9.25] {
                    equals_direct([n, 3], [sigma, 0.0], [order, 0]);
                    equals_direct([3, n], [0.0, sigma], [0, order]);
                }
            }
        }
    }

    #[test]
    fn an_impulse_becomes_the_kernel() {
        let mut values = vec![0.0; 41 * 41];
        values[20 * 41 + 20] = 1.0;
        gaussian(&mut values, [41, 41], [2.0, 2.0]);
        for y in -7..=7_i32 {
            for x in -7..=7_i32 {
                let expected =
                    (-f64::from(x * x + y * y) / 8.0).exp() / (8.0 * std::f64::consts::PI);
                let found = values[((20 + y) * 41 + 20 + x) as usize];
                // cutting at 4σ takes 6e-5 off the sum of each axis
                assert!((f64::from(found) - expected).abs() < 2e-4 * expected);
            }
        }
    }

    #[test]
    fn constants_and_ramps_stay_away_from_the_edges() {
        let ramp: Vec<f32> = (0..60 * 50).map(|i| 3.0 + 0.5 * (i % 60) as f32).collect();
        let mut smooth = ramp.clone();
        gaussian(&mut smooth, [60, 50], [2.0, 3.0]);
        for (i, (a, b)) in ramp.iter().zip(&smooth).enumerate() {
            if (8..52).contains(&(i % 60)) {
                assert!((a - b).abs() < 1e-5 * a, "{a} became {b}");
            }
        }
        let mut flat = vec![7.5; 17 * 5 * 3];
        gaussian(&mut flat, [17, 5, 3], [4.0, 4.0, 40.0]);
        assert!(flat.iter().all(|v| (v - 7.5).abs() < 1e-5));
    }

    #[test]
    fn derivatives_of_a_parabola_are_a_ramp_and_a_constant() {
        let parabola: Vec<f32> = (0..101_i32).map(|i| ((i - 50) * (i - 50)) as f32).collect();
        let slope = gaussian_derivative(&parabola, [101], [2.5], [1]);
        let bend = gaussian_derivative(&parabola, [101], [2.5], [2]);
        for i in 30..=70 {
            // the part of the moments beyond 4σ is missing
            let expected = 2.0 * (i as f32 - 50.0);
            assert!((slope[i] - expected).abs() <= 2e-3 * expected.abs() + 1e-4);
        }
        // at the vertex: twice the fourth moment's share, x⁴/σ⁴ − x²/σ², cut at 4σ
        assert!((bend[50] - 2.0).abs() < 0.03, "{}", bend[50]);
    }

    #[test]
    fn a_wide_gaussian_gives_the_mean() {
        let mut values = noise(50 * 40, 3);
        let mean = values.iter().map(|&v| f64::from(v)).sum::<f64>() / 2000.0;
        gaussian(&mut values, [50, 40], [1e9, 400.0]);
        assert!(values.iter().all(|&v| (f64::from(v) - mean).abs() < 1e-4));
    }

    #[test]
    fn a_sigma_of_zero_leaves_its_axis_alone() {
        let values = noise(64 * 32, 5);
        let mut same = values.clone();
        gaussian(&mut same, [64, 32], [0.0, 0.0]);
        assert_eq!(same, values);
        gaussian(&mut same, [64, 32], [1.5, 0.0]);
        for (row, of) in same.chunks(64).zip(values.chunks(64)) {
            let mut alone = of.to_vec();
            gaussian(&mut alone, [64], [1.5]);
            assert_eq!(row, alone);
        }
    }

    #[test]
    fn bits_do_not_depend_on_the_number_of_threads() {
        let values = noise(130 * 61 * 37, 11);
        let run = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let mut v = values.clone();
            pool.install(|| gaussian(&mut v, [130, 61, 37], [1.0, 2.0, 3.0]));
            v
        };
        assert_eq!(run(1), run(3));
    }
}
