//! Limiting the gradient of a function on a grid.
//!
//! The greatest function below f whose slope nowhere exceeds g is `min over y of f(y) + g |x − y|`,
//! and it solves |∇u| = g wherever it is below f. That is swept in all directions in turn with
//! Godunov's upwind scheme until nothing changes (Zhao 2005, *A fast sweeping method for Eikonal
//! equations*): first order, O(nodes) for each of a few rounds, and no node rises or falls below
//! the least of its neighbours, so that the minimum stays.
//!
//! Nodes are swept in tiles. A tile waits only for those before it along an axis, so that tiles of one
//! diagonal are swept at a time, by any number of threads, with the bits of a sweep node by node. A tile
//! is swept only if a node of it or beside it has fallen since it was last.

use std::sync::atomic::{AtomicBool, AtomicU32, Ordering::Relaxed};

use crate::parallel::prelude::*;

/// Rounds of sweeps; each carries values across the grid, so that few are needed.
const ROUNDS: usize = 64;

/// Falls by a smaller share of the value are rounding and end the sweeping.
const TOLERANCE: f64 = 1e-5;

/// Nodes along the axes of a tile: some thousands in all, tens of microseconds of work.
const TILE: [usize; 3] = [64, 8, 8];

/// Lowers `values`, x fastest, until their slope per unit is at most `limit` everywhere.
pub(super) fn limit_gradient<const D: usize>(
    values: &mut [f32],
    shape: [usize; D],
    step: [f64; D],
    limit: f64,
) {
    let scheme = Scheme::new(shape, step, limit);
    let given = &*values;
    let steep = |tile: usize| AtomicBool::new(scheme.is_steep(tile, |node| given[node]));
    let tile_count = scheme.tiles.iter().product();
    let mut pending: Vec<AtomicBool> = (0..tile_count).into_par_iter().map(steep).collect();
    if !pending.iter_mut().any(|p| *p.get_mut()) {
        return;
    }
    // threads share the nodes; no two write or read the same at a time
    let nodes: Vec<AtomicU32> = values.par_iter().map(|v| AtomicU32::new(v.to_bits())).collect();
    for _ in 0..ROUNDS {
        let mut changed = false;
        for direction in 0..1 << D {
            changed |= scheme.sweep(&nodes, &pending, direction);
        }
        if !changed {
            break;
        }
    }
    values.par_iter_mut().zip(nodes).for_each(|(v, node)| *v = f32::from_bits(node.into_inner()));
}

/// Index offsets to the neighbours before and after along an axis; 0 where there is none.
type Sides = [usize; 2];

struct Scheme<const D: usize> {
    shape: [usize; D],
    inverse_step: [f64; D],
    limit: f64,
    /// How much higher than its lower neighbour along an axis a node may be, the others being no lower.
    alone: [f64; D],
    /// Tiles along each axis.
    tiles: [usize; D],
}

impl<const D: usize> Scheme<D> {
    fn new(shape: [usize; D], step: [f64; D], limit: f64) -> Self {
        let inverse_step = step.map(f64::recip);
        let alone = inverse_step.map(|i| (i * i * (limit * limit)).sqrt() / (i * i));
        let tiles = std::array::from_fn(|k| shape[k].div_ceil(TILE[k]));
        Self { shape, inverse_step, limit, alone, tiles }
    }

    /// The first node of a tile along each axis, and the one past its last.
    fn ranges(&self, tile: usize) -> ([usize; D], [usize; D]) {
        let at = split(tile, &self.tiles);
        let end = std::array::from_fn(|k| ((at[k] + 1) * TILE[k]).min(self.shape[k]));
        (std::array::from_fn(|k| at[k] * TILE[k]), end)
    }

    fn is_steep(&self, tile: usize, value: impl Fn(usize) -> f32) -> bool {
        let (first, end) = self.ranges(tile);
        (0..row_count(&first, &end)).any(|row| {
            let (start, _, sides) = self.row(row, 0, &first, &end);
            (first[0]..end[0]).any(|x| self.lowered(&value, start + x, x, &sides).is_some())
        })
    }

    /// Visits all nodes, backwards along the axes whose bit in `direction` is set; says whether one fell.
    fn sweep(&self, nodes: &[AtomicU32], pending: &[AtomicBool], direction: usize) -> bool {
        let diagonal_count = self.tiles.iter().sum::<usize>() + 1 - D;
        let mut diagonals: Vec<Vec<usize>> = vec![Vec::new(); diagonal_count];
        for tile in 0..pending.len() {
            let at = split(tile, &self.tiles);
            let along = |k: usize| {
                if direction >> k & 1 == 0 { at[k] } else { self.tiles[k] - 1 - at[k] }
            };
            diagonals[(0..D).map(along).sum::<usize>()].push(tile);
        }
        let mut changed = false;
        for mut diagonal in diagonals {
            diagonal.retain(|&tile| pending[tile].swap(false, Relaxed));
            let sweep = |tile: usize| self.sweep_tile(tile, nodes, pending, direction);
            changed |= match diagonal[..] {
                [] => false,
                [tile] => sweep(tile),
                _ => diagonal.into_par_iter().map(sweep).reduce(|| false, |a, b| a | b),
            };
        }
        changed
    }

    /// Sweeps one tile; notes it and those beside it for another visit where nodes fell.
    fn sweep_tile(
        &self,
        tile: usize,
        nodes: &[AtomicU32],
        pending: &[AtomicBool],
        direction: usize,
    ) -> bool {
        let (first, end) = self.ranges(tile);
        let value = |node: usize| f32::from_bits(nodes[node].load(Relaxed));
        let (mut low, mut high) = (end, [0; D]);
        for row in 0..row_count(&first, &end) {
            let (start, mut at, sides) = self.row(row, direction, &first, &end);
            let n = end[0] - first[0];
            for i in 0..n {
                let x = if direction & 1 == 0 { first[0] + i } else { end[0] - 1 - i };
                if let Some(lower) = self.lowered(&value, start + x, x, &sides) {
                    nodes[start + x].store(lower.to_bits(), Relaxed);
                    at[0] = x;
                    for k in 0..D {
                        (low[k], high[k]) = (low[k].min(at[k]), high[k].max(at[k]));
                    }
                }
            }
        }
        let changed = low[0] < end[0];
        if changed {
            pending[tile].store(true, Relaxed);
            let mut stride = 1;
            for k in 0..D {
                if low[k] == first[k] && first[k] > 0 {
                    pending[tile - stride].store(true, Relaxed);
                }
                if high[k] + 1 == end[k] && end[k] < self.shape[k] {
                    pending[tile + stride].store(true, Relaxed);
                }
                stride *= self.tiles[k];
            }
        }
        changed
    }

    /// Of the `row`-th row visited of a tile: where x = 0 of it is, its place across, and its neighbours.
    fn row(
        &self,
        row: usize,
        direction: usize,
        first: &[usize; D],
        end: &[usize; D],
    ) -> (usize, [usize; D], [Sides; D]) {
        let (mut rest, mut start, mut stride) = (row, 0, self.shape[0]);
        let (mut place, mut sides) = ([0; D], [[0; 2]; D]);
        for k in 1..D {
            let n = end[k] - first[k];
            let forward = rest % n;
            let at =
                if direction >> k & 1 == 0 { first[k] + forward } else { end[k] - 1 - forward };
            sides[k] =
                [if at > 0 { stride } else { 0 }, if at + 1 < self.shape[k] { stride } else { 0 }];
            place[k] = at;
            start += at * stride;
            rest /= n;
            stride *= self.shape[k];
        }
        (start, place, sides)
    }

    /// The value that the node should fall to, if its slope is too great.
    #[inline(always)]
    fn lowered(
        &self,
        value: &impl Fn(usize) -> f32,
        node: usize,
        x: usize,
        across: &[Sides; D],
    ) -> Option<f32> {
        let here = f64::from(value(node));
        let mut lower = [0.0; D];
        let mut slope_squared = 0.0;
        for k in 0..D {
            let [before, after] = if k == 0 {
                [usize::from(x > 0), usize::from(x + 1 < self.shape[0])]
            } else {
                across[k]
            };
            lower[k] = f64::from(value(node - before).min(value(node + after)));
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
    #[inline(always)]
    fn solve(&self, mut lower: [f64; D]) -> f64 {
        let mut order: [usize; D] = std::array::from_fn(|k| k);
        for end in (1..D).rev() {
            for k in 0..end {
                if lower[k] > lower[k + 1] {
                    lower.swap(k, k + 1);
                    order.swap(k, k + 1);
                }
            }
        }
        // with offsets from the least of the a_k nothing large cancels
        let least = lower[0];
        let first = self.inverse_step[order[0]];
        let (mut weight, mut linear, mut square) = (first * first, 0.0, 0.0);
        let mut u = self.alone[order[0]];
        for k in 1..D {
            let a = lower[k] - least;
            if u <= a {
                break;
            }
            let w = self.inverse_step[order[k]] * self.inverse_step[order[k]];
            weight += w;
            linear += w * a;
            square += w * a * a;
            let discriminant = linear * linear - weight * (square - self.limit * self.limit);
            u = (linear + discriminant.max(0.0).sqrt()) / weight;
        }
        least + u
    }
}

/// The place along each axis of the `index`-th of `counts`.
fn split<const D: usize>(mut index: usize, counts: &[usize; D]) -> [usize; D] {
    counts.map(|n| {
        let at = index % n;
        index /= n;
        at
    })
}

/// Rows of a tile.
fn row_count<const D: usize>(first: &[usize; D], end: &[usize; D]) -> usize {
    (1..D).map(|k| end[k] - first[k]).product()
}

#[cfg(test)]
#[path = "limit_tests.rs"]
mod tests;
