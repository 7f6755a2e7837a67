use super::block::{LEAST_WEIGHT, mirrored, moving_sum};
use super::*;
use crate::watch::Silent;
use std::ops::ControlFlow;

fn grid<const D: usize>(shape: [usize; D]) -> Grid<D> {
    Grid { shape, step: [1.0; D] }
}

/// Nearly normal numbers of standard deviation 1: sums of twelve equal ones.
fn noise(count: usize, seed: u64) -> Vec<f32> {
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    let mut unit = move || {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f32 / (1_u32 << 24) as f32
    };
    (0..count).map(|_| (0..12).map(|_| unit()).sum::<f32>() - 6.0).collect()
}

/// 0 left of the middle and `contrast` right of it, with noise.
fn step_edge<const D: usize>(shape: [usize; D], contrast: f32, seed: u64) -> Vec<f32> {
    let noise = noise(shape.iter().product(), seed).into_iter().enumerate();
    let side = |k: usize| if k % shape[0] < shape[0] / 2 { 0.0 } else { contrast };
    noise.map(|(k, n)| n + side(k)).collect()
}

/// The formula, sample by sample.
fn direct<const D: usize>(values: &[f32], grid: &Grid<D>, options: &DenoiseOptions) -> Vec<f64> {
    let sigma = options.noise.unwrap();
    let of = |radius: usize| {
        let sides = [2 * radius + 1; D];
        let at = move |k: usize| -> [isize; D] {
            std::array::from_fn(|a| place(k, a, &sides) as isize - radius as isize)
        };
        (0..sides.iter().product()).map(at).collect::<Vec<_>>()
    };
    let (patch, window) = (of(options.patch_radius), of(options.search_radius));
    let read = |x: &[isize; D]| {
        let at = std::array::from_fn(|k| mirrored(x[k], grid.shape[k]));
        f64::from(values[index(&at, grid)])
    };
    let plus =
        |a: &[isize; D], b: &[isize; D]| -> [isize; D] { std::array::from_fn(|k| a[k] + b[k]) };
    let one = |number: usize| {
        let x: [isize; D] = std::array::from_fn(|k| place(number, k, &grid.shape) as isize);
        let (mut weighted, mut weights, mut greatest) = (0.0, 0.0, f64::from(LEAST_WEIGHT));
        for t in window.iter().filter(|t| **t != [0; D]) {
            let moved = plus(&x, t);
            let square = |p: &[isize; D]| (read(&plus(&x, p)) - read(&plus(&moved, p))).powi(2);
            let distance = patch.iter().map(square).sum::<f64>() / patch.len() as f64;
            let u = (distance / sigma.powi(2) - 2.0).max(0.0) / options.strength.powi(2);
            let weight = (1.0 - u / 32.0).max(0.0).powi(32);
            weighted += weight * read(&moved);
            weights += weight;
            greatest = greatest.max(weight);
        }
        (weighted + greatest * read(&x)) / (weights + greatest)
    };
    (0..values.len()).map(one).collect()
}

fn fast_is_direct<const D: usize>(shape: [usize; D], patch_radius: usize, search_radius: usize) {
    let (values, grid) = (step_edge(shape, 6.0, 3), grid(shape));
    let options = DenoiseOptions { noise: Some(1.1), strength: 0.7, patch_radius, search_radius };
    let fast = denoise(&values, &grid, &options, &mut Silent).unwrap();
    for (k, (fast, direct)) in fast.iter().zip(direct(&values, &grid, &options)).enumerate() {
        // sums of up to 49 squares, and the 32nd power, in single precision
        assert!((f64::from(*fast) - direct).abs() < 2e-4, "{k}: {fast} {direct}");
    }
}

#[test]
fn the_moving_sums_give_the_formula() {
    // more than a block along one axis or two; patches and windows beyond the image
    fast_is_direct([150, 9], 3, 4);
    fast_is_direct([20, 140], 0, 3);
    fast_is_direct([3, 2], 2, 5);
    fast_is_direct([37, 6, 19], 1, 2);
    fast_is_direct([5, 34, 1], 2, 1);
}

#[test]
fn a_moving_sum_is_a_sum() {
    for width in [1, 3, 5, 7, 9, 13] {
        for stride in [1, 4] {
            let values: Vec<f32> = (0..60).map(|k| (k * k % 37) as f32).collect();
            let (mut sums, mut scratch) = (values.clone(), vec![0.0; 60]);
            moving_sum(&mut sums, &mut scratch, stride, width);
            for k in 0..60 - (width - 1) * stride {
                let sum: f32 = (0..width).map(|j| values[k + j * stride]).sum();
                assert_eq!(sums[k], sum, "width {width}, stride {stride}, at {k}"); // whole numbers
            }
        }
    }
}

/// Noise falls at least 20 times in variance where the image is flat, and the edge's two sides keep 90 % of
/// their contrast, four times the noise: the mean of a column of 90 noisy samples is known to a tenth.
fn noise_falls_and_the_edge_stays<const D: usize>(shape: [usize; D]) {
    let (contrast, n) = (4.0, shape[0]);
    let values = step_edge(shape, contrast, 5);
    let options = DenoiseOptions::for_dimension(D);
    let clean = denoise(&values, &grid(shape), &options, &mut Silent).unwrap();
    let column =
        |x: usize| -> Vec<f64> { clean.iter().skip(x).step_by(n).map(|&v| f64::from(v)).collect() };
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
    let flat: Vec<f64> = (4..n / 2 - 6).flat_map(column).collect();
    let variance = flat.iter().map(|v| v * v).sum::<f64>() / flat.len() as f64;
    assert!(variance < 1.0 / 20.0, "{variance}");
    let kept = mean(&column(n / 2)) - mean(&column(n / 2 - 1));
    assert!(kept > 0.9 * f64::from(contrast), "{kept}");
}

#[test]
fn noise_falls_and_edges_stay() {
    noise_falls_and_the_edge_stays([96, 90]);
    noise_falls_and_the_edge_stays([40, 30, 28]);
}

#[test]
fn constants_and_images_without_noise_stay() {
    let options = DenoiseOptions { noise: Some(3.0), ..DenoiseOptions::for_dimension(2) };
    let constant = vec![1234.5; 40 * 30];
    for v in denoise(&constant, &grid([40, 30]), &options, &mut Silent).unwrap() {
        assert!((v - 1234.5).abs() <= 1234.5 * 1e-5, "{v}"); // 441 roundings
    }
    let ramp: Vec<f32> = (0..1200).map(|k| (k % 40 + 2 * (k / 40)) as f32).collect();
    let estimated = DenoiseOptions::for_dimension(2);
    assert_eq!(denoise(&ramp, &grid([40, 30]), &estimated, &mut Silent).unwrap(), ramp);
}

#[test]
fn the_noise_is_estimated_beside_edges_and_slopes() {
    for (sigma, seed) in [(0.01, 1), (1.0, 2), (300.0, 3)] {
        let of = |count: usize| noise(count, seed).into_iter().enumerate();
        let flat: Vec<f32> = of(200 * 150)
            .map(|(k, n)| {
                sigma * (n + if k % 200 > k / 200 { 50.0 } else { 0.1 * (k % 200) as f32 })
            })
            .collect();
        let solid: Vec<f32> = of(40 * 40 * 40)
            .map(|(k, n)| sigma * (n + if k % 1600 > 700 { 9.0 } else { 0.0 }))
            .collect();
        let found = [noise_level(&flat, &grid([200, 150])), noise_level(&solid, &grid([40; 3]))];
        for found in found {
            // 30,000 samples tell the median to 1 %; the edges raise it by some more
            assert!((found / f64::from(sigma) - 1.0).abs() < 0.05, "{found} for {sigma}");
        }
    }
    assert_eq!(noise_level(&[1.0, 5.0], &grid([2, 1])), 0.0);
}

#[test]
fn the_scale_of_the_values_does_not_matter() {
    let (values, grid) = (step_edge([60, 40], 5.0, 8), grid([60, 40]));
    let options = DenoiseOptions::for_dimension(2);
    let clean = denoise(&values, &grid, &options, &mut Silent).unwrap();
    let scaled: Vec<f32> = values.iter().map(|v| 1024.0 * v).collect();
    let scaled = denoise(&scaled, &grid, &options, &mut Silent).unwrap();
    for (a, b) in clean.iter().zip(scaled) {
        assert!((a - b / 1024.0).abs() < 1e-5, "{a} {b}");
    }
}

#[test]
fn threads_do_not_show() {
    let values = step_edge([70, 50, 20], 5.0, 6);
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let options = DenoiseOptions::for_dimension(3);
        pool.install(|| denoise(&values, &grid([70, 50, 20]), &options, &mut Silent).unwrap())
    };
    assert_eq!(run(1), run(3));
}

#[test]
fn what_is_wrong_is_named_and_the_watch_ends_the_work() {
    struct No;
    impl Watch for No {
        fn step(&mut self, _: Phase, _: f64, _: Option<f64>) -> ControlFlow<()> {
            ControlFlow::Break(())
        }
    }
    let (values, shape) = (step_edge([30, 20], 5.0, 1), grid([30, 20]));
    let options = DenoiseOptions::for_dimension(2);
    let ended = denoise(&values, &shape, &options, &mut No);
    assert_eq!(ended, Err(DenoiseError::Cancelled(Cancelled)));
    let short = denoise(&values[1..], &shape, &options, &mut Silent).unwrap_err();
    assert_eq!(short.to_string(), "599 samples for a grid of 600");
    for (odd, words) in [
        (DenoiseOptions { noise: Some(f64::NAN), ..options }, "noise of denoising is NaN"),
        (DenoiseOptions { noise: Some(-1.0), ..options }, "is -1"),
        (DenoiseOptions { strength: 0.0, ..options }, "strength of denoising is 0"),
        (DenoiseOptions { patch_radius: 65, ..options }, "patch radius of denoising is 65"),
        (DenoiseOptions { search_radius: 100, ..options }, "0 to 64 samples"),
    ] {
        let error = denoise(&values, &shape, &odd, &mut Silent).unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    }
}
