//! Weighted sums of rows: one routine serves every axis.
//!
//! Along y and z the rows are rows of the image; along x they are one padded row, shifted. The weights are even or odd, so
//! that samples at equal distance are paired before the multiplication. Every sample goes through the same additions in
//! the same order wherever blocks of registers end, and however wide they are.

/// Samples summed at once: eight vectors of four, which fit in the registers of any x86-64.
pub(super) const LANES: usize = 32;

/// Samples summed at once where vectors have eight.
#[cfg(target_arch = "x86_64")]
const WIDE_LANES: usize = 64;

/// Weights `w` of `Σ w[t] · f[i + t]` for t in −r…r, of which `half` holds 0…r.
#[derive(Clone, Debug)]
pub(super) struct Kernel {
    half: Vec<f32>,
    odd: bool,
}

impl Kernel {
    /// A kernel with the weights of t = 0…r; those of −t are the same, or opposite if `odd`.
    ///
    /// Mirrored samples repeat after 2n, so that a kernel which reaches beyond an axis of `n`
    /// samples is folded onto that period: the result is the same, the cost at most O(n).
    pub(super) fn new(half: &[f64], odd: bool, n: usize) -> Self {
        let mut folded = vec![0.0; half.len().min(n + 1)];
        let sign = if odd { -1.0 } else { 1.0 };
        for (t, &w) in half.iter().enumerate() {
            // t and −t both stand in the sum; on the circle they may meet, at 0 and at n
            match t % (2 * n) {
                0 if t == 0 => folded[0] += w,
                0 => folded[0] += w + sign * w,
                phase if phase == n => folded[n] += 0.5 * (w + sign * w),
                phase if phase < n => folded[phase] += w,
                phase => folded[2 * n - phase] += sign * w,
            }
        }
        Self { half: folded.iter().map(|&w| w as f32).collect(), odd }
    }

    /// The kernel with every weight times `factor`.
    pub(super) fn scaled(&self, factor: f64) -> Self {
        let half = self.half.iter().map(|&w| (f64::from(w) * factor) as f32).collect();
        Self { half, odd: self.odd }
    }

    /// How far the kernel reaches, in samples.
    pub(super) fn radius(&self) -> usize {
        self.half.len() - 1
    }

    /// Writes `Σ w[t] · rows[r + t]` for t in −r…r to `out`; no row may be shorter than `out`.
    pub(super) fn weigh_rows(&self, rows: &[&[f32]], out: &mut [f32]) {
        #[cfg(target_arch = "x86_64")]
        if std::arch::is_x86_feature_detected!("avx2") {
            // SAFETY: the processor has been asked whether it has these instructions.
            return unsafe { self.weigh_rows_wide(rows, out) };
        }
        self.weigh_rows_in::<LANES>(rows, out);
    }

    /// The same with wider registers. The operations are the same, in the same order, each rounded
    /// once, so the result is the same to the last bit.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn weigh_rows_wide(&self, rows: &[&[f32]], out: &mut [f32]) {
        self.weigh_rows_in::<WIDE_LANES>(rows, out);
    }

    #[inline(always)]
    fn weigh_rows_in<const N: usize>(&self, rows: &[&[f32]], out: &mut [f32]) {
        if self.odd {
            self.weigh::<N>(rows, out, |left, right| right - left);
        } else {
            self.weigh::<N>(rows, out, |left, right| right + left);
        }
    }

    #[inline(always)]
    fn weigh<const N: usize>(
        &self,
        rows: &[&[f32]],
        out: &mut [f32],
        pair: impl Fn(f32, f32) -> f32 + Copy,
    ) {
        for start in block_starts::<N>(out.len()) {
            self.weigh_at::<N>(rows, start, &mut out[start..start + N], pair);
        }
        for i in singles::<N>(out.len()) {
            self.weigh_at::<1>(rows, i, &mut out[i..i + 1], pair);
        }
    }

    #[inline(always)]
    fn weigh_at<const N: usize>(
        &self,
        rows: &[&[f32]],
        start: usize,
        out: &mut [f32],
        pair: impl Fn(f32, f32) -> f32,
    ) {
        let r = self.radius();
        let (first, beyond) = (self.half[0], &self.half[1..]);
        let centre = &rows[r][start..start + N];
        let mut sum = [0.0f32; N];
        for i in 0..N {
            sum[i] = first * centre[i];
        }
        for (t, &w) in beyond.iter().enumerate() {
            let left = &rows[r - 1 - t][start..start + N];
            let right = &rows[r + 1 + t][start..start + N];
            for i in 0..N {
                sum[i] += w * pair(left[i], right[i]);
            }
        }
        out.copy_from_slice(&sum);
    }
}

/// An even kernel and an odd one of the same reach, for the same rows.
#[derive(Clone, Debug)]
pub(super) struct KernelPair {
    pub(super) average: Kernel,
    pub(super) slope: Kernel,
}

impl KernelPair {
    /// Writes what both kernels make of the rows, reading these once; see [`Kernel::weigh_rows`].
    pub(super) fn weigh_rows(&self, rows: &[&[f32]], average: &mut [f32], slope: &mut [f32]) {
        #[cfg(target_arch = "x86_64")]
        if std::arch::is_x86_feature_detected!("avx2") {
            // SAFETY: the processor has been asked whether it has these instructions.
            return unsafe { self.weigh_rows_wide(rows, average, slope) };
        }
        self.weigh_rows_in::<{ LANES / 2 }>(rows, average, slope);
    }

    /// The same with wider registers, to the last bit.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn weigh_rows_wide(&self, rows: &[&[f32]], average: &mut [f32], slope: &mut [f32]) {
        self.weigh_rows_in::<{ WIDE_LANES / 2 }>(rows, average, slope);
    }

    #[inline(always)]
    fn weigh_rows_in<const N: usize>(
        &self,
        rows: &[&[f32]],
        average: &mut [f32],
        slope: &mut [f32],
    ) {
        debug_assert!(!self.average.odd && self.slope.odd);
        for start in block_starts::<N>(average.len()) {
            let within = start..start + N;
            self.weigh_at::<N>(rows, start, &mut average[within.clone()], &mut slope[within]);
        }
        for i in singles::<N>(average.len()) {
            self.weigh_at::<1>(rows, i, &mut average[i..i + 1], &mut slope[i..i + 1]);
        }
    }

    #[inline(always)]
    fn weigh_at<const N: usize>(
        &self,
        rows: &[&[f32]],
        start: usize,
        average: &mut [f32],
        slope: &mut [f32],
    ) {
        let r = self.average.radius();
        let (even, odd) = (&self.average.half[..r + 1], &self.slope.half[..r + 1]);
        let centre = &rows[r][start..start + N];
        let (mut sum, mut rise) = ([0.0f32; N], [0.0f32; N]);
        for i in 0..N {
            sum[i] = even[0] * centre[i];
            rise[i] = odd[0] * centre[i];
        }
        for t in 1..=r {
            let left = &rows[r - t][start..start + N];
            let right = &rows[r + t][start..start + N];
            for i in 0..N {
                sum[i] += even[t] * (right[i] + left[i]);
                rise[i] += odd[t] * (right[i] - left[i]);
            }
        }
        average.copy_from_slice(&sum);
        slope.copy_from_slice(&rise);
    }
}

/// Where blocks of `N` start that cover `count` places: the last ends at the end and may overlap the one
/// before, whose places are then worked out twice, alike. None if there are fewer than `N` places.
#[inline(always)]
fn block_starts<const N: usize>(count: usize) -> impl Iterator<Item = usize> {
    let blocks = if count < N { 0 } else { count.div_ceil(N) };
    (0..blocks).map(move |b| (b * N).min(count - N))
}

/// The places to be worked out one by one.
#[inline(always)]
fn singles<const N: usize>(count: usize) -> std::ops::Range<usize> {
    if count < N { 0..count } else { count..count }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values between −1 and 1 without a pattern.
    fn values(count: usize) -> Vec<f32> {
        (0..count).map(|i| ((i * i * 7919 + 3 * i) % 1999) as f32 / 999.5 - 1.0).collect()
    }

    /// A smoothing kernel and a differentiating one, reaching `r` samples.
    fn kernels(r: usize) -> KernelPair {
        let half: Vec<f64> = (0..=r).map(|t| 1.0 / (1.0 + t as f64)).collect();
        let odd: Vec<f64> = (0..=r).map(|t| t as f64 / 7.0).collect();
        KernelPair {
            average: Kernel::new(&half, false, 1000),
            slope: Kernel::new(&odd, true, 1000),
        }
    }

    #[test]
    fn registers_of_any_width_and_pairs_of_kernels_give_the_same_bits() {
        for (count, r) in [(1, 2), (31, 1), (32, 3), (64, 6), (97, 4), (197, 6), (300, 0)] {
            let pair = kernels(r);
            let lines = values((2 * r + 1) * count);
            let rows: Vec<&[f32]> = lines.chunks(count).collect();
            let weighed = |weigh: &dyn Fn(&mut [f32])| {
                let mut out = vec![f32::NAN; count];
                weigh(&mut out);
                out.into_iter().map(f32::to_bits).collect::<Vec<u32>>()
            };
            let [average, slope] = [&pair.average, &pair.slope].map(|kernel| {
                let slow = weighed(&|out| kernel.weigh_rows_in::<1>(&rows, out));
                assert_eq!(weighed(&|out| kernel.weigh_rows(&rows, out)), slow, "{count} {r}");
                assert_eq!(weighed(&|out| kernel.weigh_rows_in::<LANES>(&rows, out)), slow);
                slow
            });
            let mut other = vec![f32::NAN; count];
            assert_eq!(weighed(&|out| pair.weigh_rows(&rows, out, &mut other.clone())), average);
            assert_eq!(
                weighed(&|out| pair.weigh_rows_in::<16>(&rows, &mut other.clone(), out)),
                slope
            );
            pair.weigh_rows(&rows, &mut vec![0.0; count], &mut other);
            assert_eq!(other.into_iter().map(f32::to_bits).collect::<Vec<u32>>(), slope);
        }
    }
}
