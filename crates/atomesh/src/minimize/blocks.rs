//! Vector operations over fixed blocks: parallel, and the same to the last bit at any thread count.

use rayon::prelude::*;

/// Variables a block; a block's sum is taken in order, and so is the sum of the blocks.
const BLOCK: usize = 8192;

/// A number that can stand in a vector: `f64`, or `f32` for a history that is kept small.
pub(super) trait Number: Copy + Send + Sync + Into<f64> {}
impl Number for f32 {}
impl Number for f64 {}

/// The sum over the blocks of `term(block of a, block of b)`.
fn sum<A: Sync, B: Sync>(a: &[A], b: &[B], term: impl Fn(&[A], &[B]) -> f64 + Sync) -> f64 {
    if a.len() <= BLOCK {
        return term(a, b);
    }
    let partial: Vec<f64> =
        a.par_chunks(BLOCK).zip(b.par_chunks(BLOCK)).map(|(a, b)| term(a, b)).collect();
    partial.iter().sum()
}

/// The inner product of two vectors.
pub(super) fn dot<A: Number, B: Number>(a: &[A], b: &[B]) -> f64 {
    sum(a, b, |a, b| {
        // Four sums at once let the processor add in parallel; their order is fixed.
        let mut lanes = [0.0f64; 4];
        let (ca, cb) = (a.chunks_exact(4), b.chunks_exact(4));
        let rest: f64 =
            ca.remainder().iter().zip(cb.remainder()).map(|(&x, &y)| x.into() * y.into()).sum();
        for (x, y) in ca.zip(cb) {
            for k in 0..4 {
                lanes[k] += x[k].into() * y[k].into();
            }
        }
        (lanes[0] + lanes[1]) + (lanes[2] + lanes[3]) + rest
    })
}

/// Calls `update` with each entry of `target` and the entry of `source` at the same place.
pub(super) fn update<T: Send, S: Sync + Copy>(
    target: &mut [T],
    source: &[S],
    update: impl Fn(&mut T, S) + Sync,
) {
    let each = |t: &mut [T], s: &[S]| t.iter_mut().zip(s).for_each(|(t, &s)| update(t, s));
    if target.len() <= BLOCK {
        return each(target, source);
    }
    target.par_chunks_mut(BLOCK).zip(source.par_chunks(BLOCK)).for_each(|(t, s)| each(t, s));
}
