//! Means, percentiles and histograms, summed in a fixed order.

use crate::parallel::prelude::*;
use std::ops::Range;

/// Up to this many values are summed one after another.
const SHORT: usize = 64;
/// Up to this many values are summed by one thread.
const SERIAL: usize = 8192;

/// The sum of `value` over a range, by halves: the same at any thread count, since only the range
/// decides where it is cut, and its rounding error grows with the logarithm of the count.
pub(super) fn sum(range: Range<usize>, value: &(impl Fn(usize) -> f64 + Sync)) -> f64 {
    let count = range.len();
    if count <= SHORT {
        return range.map(value).sum();
    }
    let middle = range.start + count / 2;
    let (first, second) = (range.start..middle, middle..range.end);
    let (first, second) = if count <= SERIAL {
        (sum(first, value), sum(second, value))
    } else {
        rayon::join(|| sum(first, value), || sum(second, value))
    };
    first + second
}

/// [`sum`] of several values at once.
pub(super) fn sums<const N: usize>(
    range: Range<usize>,
    values: &(impl Fn(usize) -> [f64; N] + Sync),
) -> [f64; N] {
    let count = range.len();
    let add = |a: [f64; N], b: [f64; N]| std::array::from_fn(|k| a[k] + b[k]);
    if count <= SHORT {
        return range.map(values).fold([0.0; N], add);
    }
    let middle = range.start + count / 2;
    let (first, second) = (range.start..middle, middle..range.end);
    let (first, second) = if count <= SERIAL {
        (sums(first, values), sums(second, values))
    } else {
        rayon::join(|| sums(first, values), || sums(second, values))
    };
    add(first, second)
}

/// The least of the values; infinite if there are none.
pub(super) fn least(values: &[f64]) -> f64 {
    let of = |part: &[f64]| part.iter().copied().fold(f64::INFINITY, f64::min);
    values.par_chunks(SERIAL).map(of).reduce(|| f64::INFINITY, f64::min)
}

/// The percentile `percent` in 0..=100, linear between ranks as in NumPy's default; reorders
/// `values`.
///
/// # Panics
/// If there are no values.
pub(super) fn percentile(values: &mut [f64], percent: f64) -> f64 {
    let rank = percent / 100.0 * (values.len() - 1) as f64;
    let below = rank.floor() as usize;
    let (_, &mut low, above) = values.select_nth_unstable_by(below, f64::total_cmp);
    match above.iter().copied().min_by(f64::total_cmp) {
        Some(high) => low + (rank - below as f64) * (high - low),
        None => low,
    }
}

/// Counts of values in bins of equal width, the first of which starts at 0.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Histogram {
    /// The width of a bin, in the unit of the values.
    pub width: f64,
    /// How many values each bin holds: bin i those in [i, i + 1) · width, the last also those beyond.
    pub counts: Vec<u64>,
}

impl Histogram {
    /// Counts values of 0 or more.
    pub(super) fn of(values: &[f64], width: f64, bins: usize) -> Self {
        let part = |values: &[f64]| {
            let mut counts = vec![0; bins];
            for value in values {
                counts[((value / width) as usize).min(bins - 1)] += 1;
            }
            counts
        };
        let add = |mut a: Vec<u64>, b: Vec<u64>| {
            a.iter_mut().zip(b).for_each(|(a, b)| *a += b);
            a
        };
        let counts = values.par_chunks(SERIAL).map(part).reduce(|| vec![0; bins], add);
        Self { width, counts }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_linear_between_ranks() {
        // NumPy: percentile([4, 1, 3, 2], [0, 10, 50, 95, 100]) is 1, 1.3, 2.5, 3.85, 4
        for (percent, expected) in
            [(0.0, 1.0), (10.0, 1.3), (50.0, 2.5), (95.0, 3.85), (100.0, 4.0)]
        {
            let found = percentile(&mut [4.0, 1.0, 3.0, 2.0], percent);
            assert!((found - expected).abs() < 1e-15, "{percent}: {found}");
        }
        assert_eq!(percentile(&mut [7.0], 33.0), 7.0);
    }

    #[test]
    fn sums_do_not_depend_on_the_thread_count() {
        let value = |i: usize| 1.0 / (i as f64 + 1.0);
        let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        let three = rayon::ThreadPoolBuilder::new().num_threads(3).build().unwrap();
        let sums = [&one, &three].map(|pool| pool.install(|| sum(0..100_000, &value)));
        assert_eq!(sums[0].to_bits(), sums[1].to_bits());
        // harmonic number: ln n + γ + 1/2n − …, to the next term 1/12n²
        let expected = 1e5f64.ln() + 0.577_215_664_901_532_9 + 0.5e-5;
        assert!((sums[0] - expected).abs() < 2e-11);
    }

    #[test]
    fn sums_of_several_values_are_the_sums_of_each() {
        let value = |i: usize| [1.0 / (i as f64 + 1.0), (i as f64).sin()];
        for count in [0, 1, 64, 65, 9000, 20_001] {
            let both = sums(0..count, &value);
            assert_eq!(both, [sum(0..count, &|i| value(i)[0]), sum(0..count, &|i| value(i)[1])]);
        }
        assert_eq!(least(&[3.0, -1.0, 2.0]), -1.0);
    }

    #[test]
    fn bins_hold_their_lower_end_and_the_last_holds_the_rest() {
        let h = Histogram::of(&[0.0, 0.24, 0.25, 0.99, 1.0], 0.25, 4);
        assert_eq!(h.counts, [2, 1, 0, 2]);
    }
}
