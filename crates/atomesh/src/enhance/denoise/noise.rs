//! The level of an image's noise.

use crate::parallel::prelude::*;

use crate::image::Grid;

/// The most samples whose second differences the noise is estimated from; more tell nothing new.
const ESTIMATE_SAMPLES: usize = 1 << 20;

/// The median of |x| for x of a normal distribution with standard deviation 1.
const NORMAL_MEDIAN: f64 = 0.674_489_75;

/// A sample's weight in a difference, and where it is.
#[derive(Clone, Copy)]
struct Tap {
    /// Samples from the middle, in memory.
    offset: isize,
    weight: f64,
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
    // the product of [1, −2, 1] along the axes
    let mut stencil = vec![Tap { offset: 0, weight: 1.0 }];
    for &k in &axes {
        let spread = |tap: &Tap| {
            [(-1, 1.0), (0, -2.0), (1, 1.0)].map(|(step, weight)| Tap {
                offset: tap.offset + step * strides[k] as isize,
                weight: tap.weight * weight,
            })
        };
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
    let indices = (0..values.len().div_ceil(step))
        .into_par_iter()
        .map(|at| at * step)
        .filter(|&index| is_inside(index));
    let mut sizes: Vec<f32> = indices
        .map(|index| {
            let value = |tap: &Tap| f64::from(values[index.wrapping_add_signed(tap.offset)]);
            stencil.iter().map(|tap| tap.weight * value(tap)).sum::<f64>().abs() as f32
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

fn common_divisor(a: usize, b: usize) -> usize {
    if b == 0 { a } else { common_divisor(b, a % b) }
}
