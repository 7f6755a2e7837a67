//! The limit of the slope against the minimum over all pairs of nodes, and tiles against plain sweeps.

use super::*;
use crate::geometry::distance_squared;
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};

fn places<const D: usize>(shape: [usize; D], step: [f64; D]) -> Vec<[f64; D]> {
    (0..shape.iter().product())
        .map(|mut i: usize| {
            std::array::from_fn(|k| {
                let at = i % shape[k];
                i /= shape[k];
                at as f64 * step[k]
            })
        })
        .collect()
}

/// Every pair of nodes.
fn direct<const D: usize>(
    values: &[f32],
    shape: [usize; D],
    step: [f64; D],
    limit: f64,
) -> Vec<f64> {
    let places = places(shape, step);
    let reach = |x: &[f64; D]| {
        let along = places.iter().zip(values);
        along
            .map(|(y, &v)| f64::from(v) + limit * distance_squared(x, y).sqrt())
            .fold(f64::INFINITY, f64::min)
    };
    places.iter().map(reach).collect()
}

fn swept_follows_direct<const D: usize>(shape: [usize; D], step: [f64; D]) {
    let count: usize = shape.iter().product();
    let mut values = vec![20.0f32; count];
    values[count / 2 + shape[0] / 3] = 2.0;
    values[5] = 4.0;
    let expected = direct(&values, shape, step, 0.25);
    limit_gradient(&mut values, shape, step, 0.25);
    let coarsest = step.iter().fold(0.0f64, |a, &b| a.max(b));
    for (u, e) in values.iter().zip(expected) {
        let error = f64::from(*u) - e;
        // the scheme is of first order: around a point it is late by a part of a step per axis
        // beyond the first; where the slopes around two points meet it is early, by at most
        // 1 − 1/√D of a step
        let late = 0.25 * coarsest * (D - 1) as f64;
        let early = 0.25 * coarsest * (1.0 - (D as f64).sqrt().recip());
        assert!(-early - 1e-4 < error && error < late, "{u} instead of {e}, {shape:?}");
    }
}

#[test]
fn the_sweep_follows_the_minimum_over_all_nodes() {
    swept_follows_direct([31, 24], [1.0, 1.0]);
    swept_follows_direct([31, 24], [1.0, 2.5]);
    swept_follows_direct([13, 11, 9], [1.0, 1.0, 1.0]);
    swept_follows_direct([13, 11, 9], [0.5, 2.0, 1.0]);
}

#[test]
fn along_a_line_it_is_exact() {
    let mut values = vec![9.0f32; 40];
    values[10] = 1.0;
    limit_gradient(&mut values, [40, 1], [0.5, 1.0], 0.2);
    for (x, u) in values.iter().enumerate() {
        let expected = (1.0 + 0.1 * (x as f64 - 10.0).abs()).min(9.0);
        assert!((f64::from(*u) - expected).abs() < 1e-5);
    }
}

#[test]
fn gentle_slopes_stay_to_the_bit() {
    let ramp: Vec<f32> =
        (0..600).map(|i| 3.0 + 0.1 * (i % 30) as f32 + 0.1 * (i / 30) as f32).collect();
    let mut values = ramp.clone();
    limit_gradient(&mut values, [30, 20], [1.0, 1.0], 0.15);
    assert_eq!(values, ramp);
}

/// The same sweeps node by node, each node of the grid in each.
fn swept_plainly<const D: usize>(
    values: &mut [f32],
    shape: [usize; D],
    step: [f64; D],
    limit: f64,
) {
    let scheme = Scheme::new(shape, step, limit);
    for _ in 0..ROUNDS {
        let mut changed = false;
        for direction in 0..1 << D {
            for i in 0..values.len() {
                let forward = split(i, &shape);
                let at: [usize; D] = std::array::from_fn(|k| {
                    let back = direction >> k & 1 == 1;
                    if back { shape[k] - 1 - forward[k] } else { forward[k] }
                });
                let (mut node, mut stride) = (0, 1);
                let sides = std::array::from_fn(|k| {
                    let sides = [at[k].min(1) * stride, (shape[k] - 1 - at[k]).min(1) * stride];
                    node += at[k] * stride;
                    stride *= shape[k];
                    sides
                });
                if let Some(lower) = scheme.lowered(&|i: usize| values[i], node, at[0], &sides) {
                    values[node] = lower;
                    changed = true;
                }
            }
        }
        if !changed {
            break;
        }
    }
}

fn tiles_give_the_bits_of_plain_sweeps<const D: usize>(shape: [usize; D], step: [f64; D]) {
    let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(D as u64);
    let count: usize = shape.iter().product();
    let before: Vec<f32> = (0..count)
        .map(|_| if random.random::<f32>() < 0.003 { 2.0 } else { 9.0 } + random.random::<f32>())
        .collect();
    let mut plain = before.clone();
    swept_plainly(&mut plain, shape, step, 0.2);
    for threads in [1, 3] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let mut tiled = before.clone();
        pool.install(|| limit_gradient(&mut tiled, shape, step, 0.2));
        assert_eq!(plain, tiled, "{shape:?}, {threads} threads");
    }
}

#[test]
fn tiles_on_any_threads_give_the_bits_of_plain_sweeps() {
    tiles_give_the_bits_of_plain_sweeps([200, 90], [1.0, 0.7]);
    tiles_give_the_bits_of_plain_sweeps([131, 1], [1.0, 1.0]);
    tiles_give_the_bits_of_plain_sweeps([1, 70], [1.0, 1.0]);
    tiles_give_the_bits_of_plain_sweeps([70, 19, 25], [1.0, 2.0, 0.5]);
}

proptest! {
    #[test]
    fn slopes_are_limited_values_only_fall_and_the_least_stays(
        before in prop::collection::vec(0.5f32..50.0, 6 * 5 * 4),
        step in [0.3f64..3.0, 0.3f64..3.0, 0.3f64..3.0],
        limit in 0.05f64..2.0,
    ) {
        let shape = [6, 5, 4];
        let mut after = before.clone();
        limit_gradient(&mut after, shape, step, limit);
        let least = |v: &[f32]| v.iter().copied().fold(f32::INFINITY, f32::min);
        prop_assert_eq!(least(&before), least(&after));
        prop_assert!(before.iter().zip(&after).all(|(b, a)| a <= b));
        let places = places(shape, step);
        for (a, x) in after.iter().zip(&places) {
            for (b, y) in after.iter().zip(&places) {
                // steps along the axes bound the difference; TOLERANCE · 50 is not pursued
                let path: f64 = (0..3).map(|k| (x[k] - y[k]).abs()).sum();
                prop_assert!(f64::from(a - b) <= limit * path + 5e-3);
            }
        }
    }
}
