//! Limiting the gradient of a function on a grid.
//!
//! The greatest function below f whose slope nowhere exceeds g is `min over y of f(y) + g |x − y|`,
//! and it solves |∇u| = g wherever it is below f. That is swept in all directions in turn with
//! Godunov's upwind scheme until nothing changes (Zhao 2005, *A fast sweeping method for Eikonal
//! equations*): first order, O(nodes) for each of a few rounds, and no node rises or falls below
//! the least of its neighbours, so that the minimum stays.

use rayon::prelude::*;

/// Rounds of sweeps; each carries values across the grid, so that few are needed.
const ROUNDS: usize = 64;

/// Falls by a smaller share of the value are rounding and end the sweeping.
const TOLERANCE: f64 = 1e-5;

/// Lowers `values`, x fastest, until their slope per unit is at most `limit` everywhere.
pub(super) fn limit_gradient<const D: usize>(
    values: &mut [f32],
    shape: [usize; D],
    step: [f64; D],
    limit: f64,
) {
    let scheme = Scheme::new(shape, step, limit);
    let rows = values.len() / shape[0];
    let steep = |row: usize| {
        let (start, sides) = scheme.row(row, 0);
        (0..shape[0]).any(|x| scheme.lowered(values, start + x, x, &sides).is_some())
    };
    if !(0..rows).into_par_iter().any(steep) {
        return;
    }
    for _ in 0..ROUNDS {
        let mut changed = false;
        for direction in 0..1 << D {
            changed |= scheme.sweep(values, direction);
        }
        if !changed {
            break;
        }
    }
}

/// Index offsets to the neighbours before and after along an axis; 0 where there is none.
type Sides = [usize; 2];

struct Scheme<const D: usize> {
    shape: [usize; D],
    inverse_step: [f64; D],
    limit: f64,
}

impl<const D: usize> Scheme<D> {
    fn new(shape: [usize; D], step: [f64; D], limit: f64) -> Self {
        Self { shape, inverse_step: step.map(f64::recip), limit }
    }

    /// Visits all nodes, backwards along the axes whose bit in `direction` is set.
    fn sweep(&self, values: &mut [f32], direction: usize) -> bool {
        let n = self.shape[0];
        let mut changed = false;
        for row in 0..values.len() / n {
            let (start, sides) = self.row(row, direction);
            for i in 0..n {
                let x = if direction & 1 == 0 { i } else { n - 1 - i };
                if let Some(lower) = self.lowered(values, start + x, x, &sides) {
                    values[start + x] = lower;
                    changed = true;
                }
            }
        }
        changed
    }

    /// The first node of the `row`-th row visited, and its neighbours across the row.
    fn row(&self, row: usize, direction: usize) -> (usize, [Sides; D]) {
        let (mut rest, mut start, mut stride) = (row, 0, self.shape[0]);
        let mut sides = [[0; 2]; D];
        for k in 1..D {
            let n = self.shape[k];
            let forward = rest % n;
            let at = if direction >> k & 1 == 0 { forward } else { n - 1 - forward };
            sides[k] = [if at > 0 { stride } else { 0 }, if at + 1 < n { stride } else { 0 }];
            start += at * stride;
            rest /= n;
            stride *= n;
        }
        (start, sides)
    }

    /// The value that the node should fall to, if its slope is too great.
    #[inline(always)]
    fn lowered(&self, values: &[f32], node: usize, x: usize, across: &[Sides; D]) -> Option<f32> {
        let here = f64::from(values[node]);
        let mut lower = [0.0; D];
        let mut slope_squared = 0.0;
        for k in 0..D {
            let [before, after] = if k == 0 {
                [usize::from(x > 0), usize::from(x + 1 < self.shape[0])]
            } else {
                across[k]
            };
            lower[k] = f64::from(values[node - before].min(values[node + after]));
            let slope = (here - lower[k]).max(0.0) * self.inverse_step[k];
            slope_squared += slope * slope;
        }
        if slope_squared <= self.limit * self.limit {
            return None;
        }
        let value = self.solve(lower);
        (here - value > TOLERANCE * here).then_some(value as f32)
    }

    /// The u with Σ max(0, (u − a_k) / h_k)² = g².
    fn solve(&self, lower: [f64; D]) -> f64 {
        let mut order: [usize; D] = std::array::from_fn(|k| k);
        order.sort_unstable_by(|&a, &b| lower[a].total_cmp(&lower[b]));
        // with offsets from the least of the a_k nothing large cancels
        let least = lower[order[0]];
        let (mut weight, mut linear, mut square) = (0.0, 0.0, 0.0);
        let mut u = f64::INFINITY;
        for &k in &order {
            let a = lower[k] - least;
            if u <= a {
                break;
            }
            let w = self.inverse_step[k] * self.inverse_step[k];
            weight += w;
            linear += w * a;
            square += w * a * a;
            let discriminant = linear * linear - weight * (square - self.limit * self.limit);
            u = (linear + discriminant.max(0.0).sqrt()) / weight;
        }
        least + u
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::distance_squared;
    use proptest::prelude::*;

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
}
