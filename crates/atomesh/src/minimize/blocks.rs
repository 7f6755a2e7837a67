//! Vector operations over fixed blocks: parallel, and the same to the last bit at any thread count.

use crate::parallel::prelude::*;

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

/// The inner products of each of some vectors with `a`, `b` and `c`, all of one length, in one pass over
/// memory.
pub(super) fn dots(vectors: &[&[f32]], a: &[f32], b: &[f32], c: &[f64]) -> Vec<[f64; 3]> {
    let length = a.len();
    let of_block = |start: usize| {
        let part = start..(start + BLOCK).min(length);
        let (a, b, c) = (&a[part.clone()], &b[part.clone()], &c[part.clone()]);
        vectors.iter().map(|v| three_dots(&v[part.clone()], a, b, c)).collect::<Vec<[f64; 3]>>()
    };
    let starts: Vec<usize> = (0..length).step_by(BLOCK).collect();
    let partial: Vec<Vec<[f64; 3]>> = starts.par_iter().map(|&start| of_block(start)).collect();
    let mut sums = vec![[0.0; 3]; vectors.len()];
    for part in &partial {
        for (sum, term) in sums.iter_mut().zip(part) {
            (0..3).for_each(|n| sum[n] += term[n]);
        }
    }
    sums
}

/// The inner products of one vector with three, within a block.
fn three_dots(v: &[f32], a: &[f32], b: &[f32], c: &[f64]) -> [f64; 3] {
    let mut lanes = [[0.0f64; 4]; 3];
    let mut add = |l: usize, v: f32, [a, b, c]: [f64; 3]| {
        lanes[0][l] += f64::from(v) * a;
        lanes[1][l] += f64::from(v) * b;
        lanes[2][l] += f64::from(v) * c;
    };
    let (whole, rest) = v.as_chunks::<4>();
    let fours = whole.iter().zip(a.as_chunks::<4>().0).zip(b.as_chunks::<4>().0);
    for (((v, a), b), c) in fours.zip(c.as_chunks::<4>().0) {
        for l in 0..4 {
            add(l, v[l], [a[l].into(), b[l].into(), c[l]]);
        }
    }
    for (l, &v) in rest.iter().enumerate() {
        let i = 4 * whole.len() + l;
        add(l, v, [a[i].into(), b[i].into(), c[i]]);
    }
    lanes.map(|[a, b, c, d]| (a + b) + (c + d))
}

/// Writes the sum of `first`, times its weight, and of the vectors, times theirs, into `target`, in
/// one pass over memory.
pub(super) fn combine(target: &mut [f64], first: &[f64], weight: f64, vectors: &[(&[f32], f64)]) {
    target.par_chunks_mut(BLOCK).zip(first.par_chunks(BLOCK)).enumerate().for_each(
        |(b, (target, first))| {
            target.iter_mut().zip(first).for_each(|(t, x)| *t = weight * x);
            for (vector, weight) in vectors {
                let part = &vector[b * BLOCK..][..target.len()];
                target.iter_mut().zip(part).for_each(|(t, &x)| *t += weight * f64::from(x));
            }
        },
    );
}
