//! Exact order statistics in O(N), without sorting or copying.
//!
//! Small integers are counted value by value, in one pass. The bits of real numbers above 0, read as integers, are in
//! the order of the numbers. One pass counts their upper halves, which finds that of the value wanted; a second counts
//! the lower halves of the values with that upper half. Counts are integers, so that threads may add them in any order.

use crate::parallel::prelude::*;

/// Samples read at once.
const BLOCK: usize = 1 << 14;

/// Samples counted by one thread before counts are added up.
const PART: usize = 1 << 20;

/// A value of a certain rank, and how many samples are on either side of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Ranked {
    pub(super) value: f32,
    /// Samples less than the value.
    pub(super) below: usize,
    /// Samples greater than the value.
    pub(super) above: usize,
}

/// Samples whose order is known.
pub(super) trait Ranks {
    /// The sample with `rank` others before it in ascending order. Ranks beyond the last are the
    /// last; 0 without samples.
    fn ranked(&self, rank: usize) -> Ranked;
}

/// Samples of few values: how many there are of each, in ascending order of the values.
pub(super) struct Levels {
    values: Vec<f32>,
    counts: Vec<u64>,
}

impl Levels {
    /// Counts `samples`, whose `level` is a place in `values`.
    pub(super) fn new<T: Copy + Sync>(
        samples: &[T],
        level: impl Fn(T) -> u16 + Sync,
        values: Vec<f32>,
    ) -> Self {
        let empty = || vec![0u64; values.len()];
        let count_part = |mut counts: Vec<u64>, part: &[T]| {
            // two counts in turn: successive additions to one count would wait for each other
            let mut others = vec![0u64; values.len()];
            for pair in part.chunks(2) {
                counts[level(pair[0]) as usize] += 1;
                if let &[_, other] = pair {
                    others[level(other) as usize] += 1;
                }
            }
            add(counts, others)
        };
        let counts = samples.par_chunks(PART).fold(empty, count_part).reduce(empty, add);
        Self { values, counts }
    }
}

impl Ranks for Levels {
    fn ranked(&self, rank: usize) -> Ranked {
        let count = self.counts.iter().sum::<u64>() as usize;
        let (level, below) = locate(&self.counts, rank.min(count.saturating_sub(1)));
        let above = count - below - self.counts[level as usize] as usize;
        Ranked { value: if count > 0 { self.values[level as usize] } else { 0.0 }, below, above }
    }
}

/// The order of the samples, none negative, that `fill(start, out)` writes.
pub(super) struct Order<F> {
    count: usize,
    fill: F,
    /// How many samples have each upper half.
    upper_halves: Vec<u64>,
}

impl<F: Fn(usize, &mut [f32]) + Sync> Order<F> {
    pub(super) fn new(count: usize, fill: F) -> Self {
        let upper_halves = histogram(count, &fill, |bits| Some(bits >> 16));
        Self { count, fill, upper_halves }
    }
}

impl<F: Fn(usize, &mut [f32]) + Sync> Ranks for Order<F> {
    fn ranked(&self, rank: usize) -> Ranked {
        let rank = rank.min(self.count.saturating_sub(1));
        let (upper, before_upper) = locate(&self.upper_halves, rank);
        let lower_halves = histogram(self.count, &self.fill, |bits| {
            (bits >> 16 == upper).then_some(bits & 0xffff)
        });
        let (lower, before_lower) = locate(&lower_halves, rank - before_upper);
        let below = before_upper + before_lower;
        let equal = lower_halves[lower as usize] as usize;
        let value = f32::from_bits(upper << 16 | lower);
        Ranked { value, below, above: self.count - below - equal }
    }
}

/// The bin that holds the sample with `rank` others before it, and the samples in earlier bins.
fn locate(bins: &[u64], rank: usize) -> (u32, usize) {
    let mut before = 0;
    for (bin, &here) in bins.iter().enumerate() {
        if rank < before + here as usize {
            return (bin as u32, before);
        }
        before += here as usize;
    }
    (0, 0) // no samples
}

/// How many samples fall into each of 2¹⁶ bins.
fn histogram(
    count: usize,
    fill: &(impl Fn(usize, &mut [f32]) + Sync),
    bin: impl Fn(u32) -> Option<u32> + Sync,
) -> Vec<u64> {
    let empty = || vec![0u64; 1 << 16];
    let count_part = |mut bins: Vec<u64>, part: usize| {
        let end = count.min((part + 1) * PART);
        let mut block = [0.0; BLOCK];
        let mut zeros = 0;
        for start in (part * PART..end).step_by(BLOCK) {
            let block = &mut block[..BLOCK.min(end - start)];
            fill(start, block);
            for value in block {
                // + 0.0 turns −0 into 0, whose bits are in order
                let bits = (*value + 0.0).to_bits();
                if bits == 0 {
                    zeros += 1; // there may be many in a row, each waiting for the one before
                } else if let Some(bin) = bin(bits) {
                    bins[bin as usize] += 1;
                }
            }
        }
        if let Some(bin) = bin(0) {
            bins[bin as usize] += zeros;
        }
        bins
    };
    (0..count.div_ceil(PART)).into_par_iter().fold(empty, count_part).reduce(empty, add)
}

/// The sums of counts.
fn add(mut a: Vec<u64>, b: Vec<u64>) -> Vec<u64> {
    a.iter_mut().zip(b).for_each(|(a, b)| *a += b);
    a
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn of(values: &[f32], rank: usize) -> Ranked {
        let fill = |start: usize, out: &mut [f32]| {
            out.copy_from_slice(&values[start..start + out.len()]);
        };
        Order::new(values.len(), fill).ranked(rank)
    }

    proptest! {
        #[test]
        fn equals_the_sorted_sample(
            mut values in prop::collection::vec(
                prop_oneof![0.0f32..1.0, Just(0.5), Just(0.0), Just(-0.0), 0.0f32..1e-30], 1..300
            ),
            rank in 0usize..300,
        ) {
            let found = of(&values, rank);
            values.sort_by(f32::total_cmp);
            let value = values[rank.min(values.len() - 1)];
            prop_assert_eq!(found.value, value);
            prop_assert_eq!(found.below, values.iter().filter(|&&v| v < value).count());
            prop_assert_eq!(found.above, values.iter().filter(|&&v| v > value).count());
        }
    }

    proptest! {
        #[test]
        fn counted_levels_have_the_order_of_their_values(
            samples in prop::collection::vec(
                prop_oneof![any::<i8>(), Just(-3i8), Just(i8::MIN), Just(i8::MAX)], 1..300
            ),
            rank in 0usize..300,
        ) {
            let value = |s: i8| f32::from(s) + 128.0;
            let values = (i8::MIN..=i8::MAX).map(value).collect();
            let levels = Levels::new(&samples, |s| (s as u8 ^ 0x80).into(), values);
            let reals: Vec<f32> = samples.iter().map(|&s| value(s)).collect();
            prop_assert_eq!(levels.ranked(rank), of(&reals, rank));
        }
    }

    #[test]
    fn several_parts_add_up() {
        let values: Vec<f32> = (0..2 * PART + 77).map(|i| (i % 1000) as f32).collect();
        let found = of(&values, values.len() / 2);
        let below = values.iter().filter(|&&v| v < found.value).count();
        assert_eq!((found.value, found.below), (499.0, below));
    }

    #[test]
    fn no_samples_have_rank_zero() {
        let none = Ranked { value: 0.0, below: 0, above: 0 };
        assert_eq!(of(&[], 3), none);
        assert_eq!(Levels::new(&[0u8; 0], u16::from, vec![7.0; 256]).ranked(3), none);
    }
}
