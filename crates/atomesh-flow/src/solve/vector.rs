//! Sums over vectors: over fixed blocks in a fixed order, so that bits do not depend on threads.

use rayon::prelude::*;

/// Terms per block of a sum; the sums of blocks are added in their order.
const BLOCK: usize = 8192;

/// The inner product.
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    let of_block = |(a, b): (&[f64], &[f64])| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    if a.len() <= BLOCK {
        return of_block((a, b));
    }
    let sums: Vec<f64> = a.par_chunks(BLOCK).zip(b.par_chunks(BLOCK)).map(of_block).collect();
    sums.iter().sum()
}

/// The Euclidean norm; neither overflows nor underflows before its parts do.
pub fn norm(a: &[f64]) -> f64 {
    let square = dot(a, a);
    if (1e-200..1e200).contains(&square) || square.is_nan() {
        return square.sqrt();
    }
    let largest = a.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    if largest == 0.0 || !largest.is_finite() {
        return largest;
    }
    largest * a.iter().map(|x| (x / largest) * (x / largest)).sum::<f64>().sqrt()
}

/// `y = f(y, x)`, component by component.
pub fn update(y: &mut [f64], x: &[f64], change: impl Fn(f64, f64) -> f64 + Sync) {
    y.par_chunks_mut(BLOCK).zip(x.par_chunks(BLOCK)).for_each(|(y, x)| {
        for (y, &x) in y.iter_mut().zip(x) {
            *y = change(*y, x);
        }
    });
}
