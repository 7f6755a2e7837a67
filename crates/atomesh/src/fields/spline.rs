//! The cubic B-spline through samples (Unser 1999), with mirrored ends (… 2 1 0 1 2 …).

use crate::parallel::prelude::*;

use crate::geometry::Point;
use crate::image::Grid;

/// The pole of the cubic spline's recursive filter, √3 − 2.
const POLE: f32 = -0.267_949_2;

/// The coefficients of the spline through the samples: a recursive filter along each axis.
pub(super) fn coefficients<const D: usize>(samples: &[f32], shape: [usize; D]) -> Vec<f32> {
    let mut c = samples.to_vec();
    let mut stride = 1;
    for n in shape {
        if n > 1 {
            // lines of one slab (n · stride samples) lie side by side, so they filter together
            c.par_chunks_mut(n * stride).for_each(|slab| filter(slab, n, stride));
        }
        stride *= n;
    }
    c
}

/// Filters `stride` lines of `n` samples that lie side by side.
fn filter(slab: &mut [f32], n: usize, stride: usize) {
    let gain = (1.0 - POLE) * (1.0 - 1.0 / POLE);
    slab.iter_mut().for_each(|c| *c *= gain);
    // The causal start is the mirrored sum Σ z^k c_k, exact for short lines, cut where z^k < 1e-7.
    let reach = n.min(12);
    for line in 0..stride {
        let mut sum = slab[line];
        let mut power = POLE;
        for k in 1..reach {
            sum += power * slab[line + k * stride];
            power *= POLE;
        }
        if reach == n {
            for k in (1..n - 1).rev() {
                sum += power * slab[line + k * stride];
                power *= POLE;
            }
            sum /= 1.0 - power;
        }
        slab[line] = sum;
    }
    for k in 1..n {
        let (before, here) = slab.split_at_mut(k * stride);
        let before = &before[(k - 1) * stride..];
        here[..stride].iter_mut().zip(before).for_each(|(c, p)| *c += POLE * p);
    }
    let end = (n - 1) * stride;
    for line in 0..stride {
        let (last, previous) = (slab[line + end], slab[line + end - stride]);
        slab[line + end] = POLE / (POLE * POLE - 1.0) * (last + POLE * previous);
    }
    for k in (0..n - 1).rev() {
        let (here, after) = slab.split_at_mut((k + 1) * stride);
        here[k * stride..].iter_mut().zip(after).for_each(|(c, a)| *c = POLE * (*a - *c));
    }
}

/// The four weights of the cubic B-spline at fraction `t` between samples, and their slopes.
#[inline]
fn weights(t: f64) -> ([f64; 4], [f64; 4]) {
    let s = 1.0 - t;
    (
        [
            s * s * s / 6.0,
            (4.0 - 3.0 * t * t * (2.0 - t)) / 6.0,
            (4.0 - 3.0 * s * s * (2.0 - s)) / 6.0,
            t * t * t / 6.0,
        ],
        [-0.5 * s * s, t * (1.5 * t - 2.0), s * (2.0 - 1.5 * s), 0.5 * t * t],
    )
}

/// The spline's value at a lattice point, and its gradient per lattice unit.
pub(super) fn evaluate<const D: usize>(
    coefficients: &[f32],
    grid: &Grid<D>,
    p: &Point<D>,
    gradient: &mut Point<D>,
) -> f64 {
    let mut value_weights = [[0.0; 4]; D];
    let mut slope_weights = [[0.0; 4]; D];
    let mut offsets = [[0usize; 4]; D];
    let strides = grid.strides();
    for k in 0..D {
        let n = grid.shape[k];
        let s = (p[k] / grid.step[k]).clamp(0.0, (n - 1) as f64);
        let i = (s as usize).min(n.saturating_sub(2));
        (value_weights[k], slope_weights[k]) = weights(s - i as f64);
        offsets[k] = std::array::from_fn(|j| mirror(i as isize + j as isize - 1, n) * strides[k]);
    }
    *gradient = [0.0; D];
    let mut value = 0.0;
    for tap in 0..1usize << (2 * D) {
        let digit = |k: usize| tap >> (2 * k) & 3;
        let at: usize = (0..D).map(|k| offsets[k][digit(k)]).sum();
        let c = f64::from(coefficients[at]);
        value += c * (0..D).map(|k| value_weights[k][digit(k)]).product::<f64>();
        for axis in 0..D {
            let weight = |k: usize| {
                if k == axis { slope_weights[k][digit(k)] } else { value_weights[k][digit(k)] }
            };
            gradient[axis] += c * (0..D).map(weight).product::<f64>() / grid.step[axis];
        }
    }
    value
}

/// The index that a mirror at the first and last of `n` samples brings inside.
fn mirror(i: isize, n: usize) -> usize {
    let last = n as isize - 1;
    if last == 0 {
        return 0;
    }
    let folded = i.rem_euclid(2 * last);
    folded.min(2 * last - folded) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_sum_to_one_and_their_slopes_to_zero() {
        for k in 0..=20 {
            let (value, slope) = weights(f64::from(k) / 20.0);
            assert!((value.iter().sum::<f64>() - 1.0).abs() < 1e-15);
            assert!(slope.iter().sum::<f64>().abs() < 1e-15);
        }
    }

    #[test]
    fn mirrors_repeat_neither_end() {
        let inside: Vec<usize> = (-3..8).map(|i| mirror(i, 4)).collect();
        assert_eq!(inside, [3, 2, 1, 0, 1, 2, 3, 2, 1, 0, 1]);
        assert_eq!(mirror(-1, 1), 0);
    }
}
