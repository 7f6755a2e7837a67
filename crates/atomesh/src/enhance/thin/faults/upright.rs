//! Means down planes of one dip, by two-sided exponentials.
//!
//! The weights a^|k| of the nodes k above and below a sample are summed by two recursions, one down and one up. They run
//! along the dip: each row's samples are first interpolated to places that lie on the planes through the places of the row
//! before, and the sums are interpolated back. So a mean is interpolated twice, whatever its reach is. Rows hold the
//! places in the image and one beyond: a plane that leaves the image goes on along the row's end, where all sums are alike.

use std::ops::Range;

/// A shift of rows by any number of samples.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shift {
    whole: isize,
    fraction: f32,
}

impl Shift {
    pub fn new(by: f64) -> Self {
        let whole = by.floor();
        Self { whole: whole as isize, fraction: (by - whole) as f32 }
    }

    /// Adds to each place of `out`, times `weight`, the value of `row` by the shift behind it, linear between samples;
    /// beyond its ends a row is constant.
    pub fn add(&self, row: &[f32], out: &mut [f32], weight: f32) {
        let (n, count) = (row.len() as isize, out.len() as isize);
        let low = (-self.whole).clamp(0, count);
        let high = (n - 1 - self.whole).clamp(low, count);
        let (before, rest) = out.split_at_mut(low as usize);
        let (inside, behind) = rest.split_at_mut((high - low) as usize);
        before.iter_mut().for_each(|out| *out += weight * row[0]);
        if !inside.is_empty() {
            let row = &row[(low + self.whole) as usize..];
            for ((out, a), b) in inside.iter_mut().zip(row).zip(&row[1..]) {
                *out += weight * (a + self.fraction * (b - a));
            }
        }
        behind.iter_mut().for_each(|out| *out += weight * row[row.len() - 1]);
    }
}

/// Rows of samples, each with one more at both of its ends.
pub(super) struct Rows<'a> {
    pub values: &'a [f32],
    /// The samples of a row.
    pub across: usize,
}

impl Rows<'_> {
    fn row(&self, row: usize) -> &[f32] {
        &self.values[row * (self.across + 2)..][..self.across + 2]
    }
}

/// A dip, in samples across a row, and the factor by which weights along it fall.
#[derive(Clone, Copy, Debug)]
pub(super) struct Slant {
    pub dip: f64,
    pub keep: f32,
}

impl Slant {
    /// How far the places of a row are from its samples: place i is at i − 1 and the shift's fraction.
    fn shift(&self, row: isize) -> Shift {
        Shift::new(self.dip * row as f64)
    }

    /// By how many places the next row's are behind those on the same planes.
    fn lag(&self, row: isize) -> isize {
        self.shift(row + 1).whole - self.shift(row).whole
    }
}

/// Weighted sums along one dip.
#[derive(Default)]
pub(super) struct Upright {
    /// Weighted sums of each row and those above it, nothing first; places, and at both ends more that go on level.
    above: Vec<f32>,
    /// The same of a row and those below it.
    below: Vec<f32>,
    /// The same of the row before it.
    next: Vec<f32>,
    sum: Vec<f32>,
}

/// The sums of a row, at its places.
pub(super) struct Sums<'a> {
    places: &'a [f32],
    fraction: f32,
}

impl Sums<'_> {
    /// Keeps at each sample of a row the greater of its sum and what there is, and the number of the greater.
    pub fn keep_greater(&self, number: u32, greatest: &mut [f32], numbers: &mut [u32]) {
        let n = greatest.len();
        let (before, after, numbers) = (&self.places[..n], &self.places[1..=n], &mut numbers[..n]);
        for u in 0..n {
            let sum = after[u] + self.fraction * (before[u] - after[u]);
            // all bits or none: a choice without a branch, in lanes of one width
            let better = u32::from(sum > greatest[u]).wrapping_neg();
            numbers[u] = (better & number) | (!better & numbers[u]);
            greatest[u] = if sum > greatest[u] { sum } else { greatest[u] };
        }
    }
}

impl Upright {
    /// Gives `take` the number of each row wanted, from the last to the first, and its sums.
    pub fn each_row_back(
        &mut self,
        rows: &Rows<'_>,
        slant: Slant,
        wanted: &Range<usize>,
        mut take: impl FnMut(usize, Sums<'_>),
    ) {
        let (places, count) = (rows.across + 1, rows.values.len() / (rows.across + 2));
        let pad = slant.dip.abs().ceil() as usize + 1;
        let wide = places + 2 * pad;
        let inside = pad..pad + places;
        for scratch in [&mut self.below, &mut self.next] {
            scratch.clear();
            scratch.resize(wide, 0.0);
        }
        self.sum.resize(places, 0.0);
        self.above.resize((wanted.end + 1) * wide, 0.0);
        self.above[..wide].fill(0.0);
        for row in 0..wanted.end {
            let (before, here) = self.above[row * wide..].split_at_mut(wide);
            let part = Part {
                values: rows.row(row),
                share: slant.shift(row as isize).fraction,
                keep: slant.keep,
            };
            let from = pad.wrapping_add_signed(-slant.lag(row as isize - 1));
            part.add(&before[from..from + places], &mut here[inside.clone()]);
            part.add_ends(before, &mut here[..wide], pad);
        }
        for row in (wanted.start..count).rev() {
            let part = Part {
                values: rows.row(row),
                share: slant.shift(row as isize).fraction,
                keep: slant.keep,
            };
            let from = pad.wrapping_add_signed(slant.lag(row as isize));
            let before = &self.below[from..from + places];
            let here = &mut self.next[inside.clone()];
            if row < wanted.end {
                let above = &self.above[(row + 1) * wide..][inside.clone()];
                part.add_and_sum(before, here, above, &mut self.sum);
                take(row, Sums { places: &self.sum, fraction: part.share });
            } else {
                part.add(before, here);
            }
            part.add_ends(&self.below, &mut self.next, pad);
            std::mem::swap(&mut self.below, &mut self.next);
        }
    }
}

/// A row that is added to weighted sums.
#[derive(Clone, Copy)]
struct Part<'a> {
    values: &'a [f32],
    /// Of the next sample, at a place.
    share: f32,
    /// What is kept of the sums before.
    keep: f32,
}

impl Part<'_> {
    /// The sums at each place, of those before it on the same plane.
    fn add(&self, before: &[f32], here: &mut [f32]) {
        let n = here.len();
        let (before, low, high) = (&before[..n], &self.values[..n], &self.values[1..=n]);
        for i in 0..n {
            here[i] = low[i] + self.share * (high[i] - low[i]) + self.keep * before[i];
        }
    }

    /// The same, and the sums to both sides, of which `above` are one.
    fn add_and_sum(&self, before: &[f32], here: &mut [f32], above: &[f32], sum: &mut [f32]) {
        let n = here.len();
        let (before, low, high) = (&before[..n], &self.values[..n], &self.values[1..=n]);
        let (above, sum) = (&above[..n], &mut sum[..n]);
        for i in 0..n {
            let others = self.keep * before[i];
            sum[i] = above[i] + others;
            here[i] = low[i] + self.share * (high[i] - low[i]) + others;
        }
    }

    /// The sums beyond both ends of a row, where rows go on level.
    fn add_ends(&self, before: &[f32], here: &mut [f32], pad: usize) {
        let (last, end) = (here.len() - 1, here.len() - pad);
        let first = self.values[0] + self.keep * before[0];
        let last = self.values[self.values.len() - 1] + self.keep * before[last];
        here[..pad].fill(first);
        here[end..].fill(last);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The mean along a dip at a sample, by its definition.
    fn direct(values: &[f32], width: usize, slant: Slant, row: usize, u: usize) -> f64 {
        let (mut sum, mut total) = (0.0, 0.0);
        for (other, values) in values.chunks(width).enumerate() {
            let away = other as f64 - row as f64;
            let weight = f64::from(slant.keep).powf(away.abs());
            let at = (u as f64 + slant.dip * away).clamp(0.0, (width - 1) as f64);
            let i = (at as usize).min(width - 2);
            let (a, b) = (f64::from(values[i]), f64::from(values[i + 1]));
            sum += weight * (a + (at - i as f64) * (b - a));
            total += weight;
        }
        sum / total
    }

    /// The means along a dip are those of the definition, to roundings, at the samples of a range of each row.
    fn equals_direct(values: &[f32], width: usize, slant: Slant, within: Range<usize>) {
        let count = values.len() / width;
        let longer: Vec<f32> = values
            .chunks(width)
            .flat_map(|row| [&row[..1], row, &row[width - 1..]].concat())
            .collect();
        let rows = Rows { values: &longer, across: width };
        for wanted in [0..count, 2..count - 3] {
            let mut seen = 0;
            Upright::default().each_row_back(&rows, slant, &wanted, |row, sums| {
                let (mut greatest, mut numbers) = (vec![-1e3; width], vec![0; width]);
                sums.keep_greater(7, &mut greatest, &mut numbers);
                let keep = f64::from(slant.keep);
                let total: f64 = (0..count).map(|k| keep.powi(k.abs_diff(row) as i32)).sum();
                for u in within.clone() {
                    let slow = direct(values, width, slant, row, u);
                    let fast = f64::from(greatest[u]) / total;
                    // of values below 10, some dozens are added
                    assert!((fast - slow).abs() < 1e-4, "{fast} {slow} at {u}, {row}: {slant:?}");
                }
                assert!(numbers.iter().all(|&number| number == 7) && wanted.contains(&row));
                seen += 1;
            });
            assert_eq!(seen, wanted.len());
        }
    }

    #[test]
    fn means_along_a_dip_are_those_of_the_definition() {
        let width = 41;
        let any: Vec<f32> = (0..width * 9).map(|i| (i * i * 31 % 97) as f32 / 10.0).collect();
        for dip in [0.0, 1.0, -1.0, 2.0, -5.0] {
            // from sample to sample: nothing is interpolated, and rows' ends go on level
            equals_direct(&any, width, Slant { dip, keep: 0.8 }, 0..width);
        }
        let sloping = |i: usize| 0.1 * (i % width) as f32 + (i / width * 7 % 5) as f32;
        let sloping: Vec<f32> = (0..width * 9).map(sloping).collect();
        for dip in [0.3, -0.85, 1.21] {
            // a slope is exact between samples, where no plane leaves the rows
            equals_direct(&sloping, width, Slant { dip, keep: 0.9 }, 11..width - 11);
        }
    }

    #[test]
    fn the_greater_sum_is_kept_with_its_number() {
        let sums = Sums { places: &[1.0, 3.0, 5.0, 7.0], fraction: 0.25 };
        let (mut greatest, mut numbers) = ([2.0, 4.6, 6.5], [1, 2, 3]);
        sums.keep_greater(9, &mut greatest, &mut numbers);
        assert_eq!((greatest, numbers), ([2.5, 4.6, 6.5], [9, 2, 3]));
    }
}
