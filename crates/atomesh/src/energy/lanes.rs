//! Operations on several numbers at once, where compilers do not vectorise the kernels themselves.
//!
//! [`Plain`] is the reference, for any processor; [`Avx2`] does the same with 256-bit instructions. Both
//! move and compare numbers, or round each operation once, so their results are the same to the last bit.
//! Nothing here fuses a product with a sum.

/// Lanes of single precision.
pub(super) const LANES: usize = crate::geometry::BLOCK;
/// Lanes of double precision.
pub(super) const WIDTH: usize = 4;

/// Operations on lanes.
pub(super) trait Lanes: Copy {
    /// [`WIDTH`] numbers of double precision.
    type Wide: Copy;

    /// The same number in all lanes.
    fn splat(x: f64) -> Self::Wide;
    /// These numbers.
    fn wide(lanes: [f64; WIDTH]) -> Self::Wide;
    /// The sum of the lanes of each: (a₀ + a₁) + (a₂ + a₃).
    fn totals(all: [Self::Wide; WIDTH]) -> [f64; WIDTH];
    /// The numbers.
    #[cfg(test)]
    fn lanes(a: Self::Wide) -> [f64; WIDTH];
    /// a + b
    fn add(a: Self::Wide, b: Self::Wide) -> Self::Wide;
    /// a − b
    fn sub(a: Self::Wide, b: Self::Wide) -> Self::Wide;
    /// a · b
    fn mul(a: Self::Wide, b: Self::Wide) -> Self::Wide;
    /// a / b
    fn div(a: Self::Wide, b: Self::Wide) -> Self::Wide;
    /// √a
    fn sqrt(a: Self::Wide) -> Self::Wide;
    /// The greater of both; b if they cannot be compared.
    fn max(a: Self::Wide, b: Self::Wide) -> Self::Wide;
    /// x where a < b, else 0, whatever x is there.
    fn where_less(a: Self::Wide, b: Self::Wide, x: Self::Wide) -> Self::Wide;

    /// Entries of a table.
    ///
    /// # Safety
    /// Every place must be within the table.
    unsafe fn pick(table: &[f64], places: &[u32; WIDTH]) -> Self::Wide;

    /// The columns of rows of a table of points.
    ///
    /// # Safety
    /// Every place must be within the table.
    unsafe fn columns<const D: usize>(table: &[[f64; D]], places: &[u32; WIDTH])
    -> [Self::Wide; D];

    /// The lanes where a < b, the first lane the lowest bit.
    fn less(a: &[f32; LANES], b: &[f32; LANES]) -> u8;

    /// The lanes of the set bits moved to the front, in order; what follows them is unspecified.
    fn front(lanes: &[u32; LANES], set: u8) -> [u32; LANES];
}

/// The reference, for any processor.
#[derive(Clone, Copy)]
pub(super) struct Plain;

fn each(a: [f64; WIDTH], b: [f64; WIDTH], f: impl Fn(f64, f64) -> f64) -> [f64; WIDTH] {
    std::array::from_fn(|l| f(a[l], b[l]))
}

impl Lanes for Plain {
    type Wide = [f64; WIDTH];

    fn splat(x: f64) -> Self::Wide {
        [x; WIDTH]
    }
    fn wide(lanes: [f64; WIDTH]) -> Self::Wide {
        lanes
    }
    fn totals(all: [Self::Wide; WIDTH]) -> [f64; WIDTH] {
        all.map(|[a, b, c, d]| (a + b) + (c + d))
    }
    #[cfg(test)]
    fn lanes(a: Self::Wide) -> [f64; WIDTH] {
        a
    }
    fn add(a: Self::Wide, b: Self::Wide) -> Self::Wide {
        each(a, b, |a, b| a + b)
    }
    fn sub(a: Self::Wide, b: Self::Wide) -> Self::Wide {
        each(a, b, |a, b| a - b)
    }
    fn mul(a: Self::Wide, b: Self::Wide) -> Self::Wide {
        each(a, b, |a, b| a * b)
    }
    fn div(a: Self::Wide, b: Self::Wide) -> Self::Wide {
        each(a, b, |a, b| a / b)
    }
    fn sqrt(a: Self::Wide) -> Self::Wide {
        a.map(f64::sqrt)
    }
    fn max(a: Self::Wide, b: Self::Wide) -> Self::Wide {
        each(a, b, |a, b| if a > b { a } else { b })
    }
    fn where_less(a: Self::Wide, b: Self::Wide, x: Self::Wide) -> Self::Wide {
        std::array::from_fn(|l| if a[l] < b[l] { x[l] } else { 0.0 })
    }
    unsafe fn pick(table: &[f64], places: &[u32; WIDTH]) -> Self::Wide {
        places.map(|place| table[place as usize])
    }
    unsafe fn columns<const D: usize>(
        table: &[[f64; D]],
        places: &[u32; WIDTH],
    ) -> [Self::Wide; D] {
        let rows = places.map(|place| table[place as usize]);
        std::array::from_fn(|k| rows.map(|row| row[k]))
    }

    fn less(a: &[f32; LANES], b: &[f32; LANES]) -> u8 {
        (0..LANES).fold(0, |set, l| set | u8::from(a[l] < b[l]) << l)
    }

    fn front(lanes: &[u32; LANES], set: u8) -> [u32; LANES] {
        let mut out = [0; LANES];
        let mut count = 0;
        for (l, lane) in lanes.iter().enumerate() {
            out[count % LANES] = *lane; // overwritten by the next one, unless its bit is set
            count += usize::from(set >> l & 1);
        }
        out
    }
}

/// The same with 256-bit registers. To be named only inside functions compiled for AVX2, which run only
/// where [`has_avx2`].
#[cfg(target_arch = "x86_64")]
#[derive(Clone, Copy)]
pub(super) struct Avx2;

/// For each set of lanes, which lane goes to each place.
#[cfg(target_arch = "x86_64")]
static FRONT: [[u32; LANES]; 256] = {
    let mut table = [[0; LANES]; 256];
    let mut set = 0;
    while set < 256 {
        let (mut lane, mut count) = (0, 0);
        while lane < LANES {
            if set >> lane & 1 == 1 {
                table[set][count] = lane as u32;
                count += 1;
            }
            lane += 1;
        }
        set += 1;
    }
    table
};

#[cfg(target_arch = "x86_64")]
mod avx2 {
    use std::arch::x86_64::*;
    use std::mem::transmute;

    use super::{Avx2, FRONT, LANES, Lanes, WIDTH};

    // SAFETY, for all below: that the processor has the instructions is the type's condition; loads are
    // unaligned and within arrays behind references, or, in `pick` and `columns`, within the table by the
    // caller's promise; transmutes are between plain numbers of one size.
    impl Lanes for Avx2 {
        type Wide = __m256d;

        #[inline(always)]
        fn splat(x: f64) -> __m256d {
            unsafe { _mm256_set1_pd(x) }
        }
        #[inline(always)]
        fn wide(lanes: [f64; WIDTH]) -> __m256d {
            unsafe { transmute(lanes) }
        }
        #[inline(always)]
        fn totals([a, b, c, d]: [__m256d; WIDTH]) -> [f64; WIDTH] {
            unsafe {
                // a₀ + a₁, b₀ + b₁, a₂ + a₃, b₂ + b₃
                let ab = _mm256_add_pd(_mm256_unpacklo_pd(a, b), _mm256_unpackhi_pd(a, b));
                let cd = _mm256_add_pd(_mm256_unpacklo_pd(c, d), _mm256_unpackhi_pd(c, d));
                let low = _mm256_permute2f128_pd::<0x20>(ab, cd);
                let high = _mm256_permute2f128_pd::<0x31>(ab, cd);
                transmute(_mm256_add_pd(low, high))
            }
        }
        #[cfg(test)]
        #[inline(always)]
        fn lanes(a: __m256d) -> [f64; WIDTH] {
            unsafe { transmute(a) }
        }
        #[inline(always)]
        fn add(a: __m256d, b: __m256d) -> __m256d {
            unsafe { _mm256_add_pd(a, b) }
        }
        #[inline(always)]
        fn sub(a: __m256d, b: __m256d) -> __m256d {
            unsafe { _mm256_sub_pd(a, b) }
        }
        #[inline(always)]
        fn mul(a: __m256d, b: __m256d) -> __m256d {
            unsafe { _mm256_mul_pd(a, b) }
        }
        #[inline(always)]
        fn div(a: __m256d, b: __m256d) -> __m256d {
            unsafe { _mm256_div_pd(a, b) }
        }
        #[inline(always)]
        fn sqrt(a: __m256d) -> __m256d {
            unsafe { _mm256_sqrt_pd(a) }
        }
        #[inline(always)]
        fn max(a: __m256d, b: __m256d) -> __m256d {
            unsafe { _mm256_max_pd(a, b) }
        }
        #[inline(always)]
        fn where_less(a: __m256d, b: __m256d, x: __m256d) -> __m256d {
            unsafe { _mm256_and_pd(_mm256_cmp_pd::<_CMP_LT_OQ>(a, b), x) }
        }
        #[inline(always)]
        unsafe fn pick(table: &[f64], places: &[u32; WIDTH]) -> __m256d {
            unsafe { transmute(places.map(|place| *table.get_unchecked(place as usize))) }
        }
        #[inline(always)]
        unsafe fn columns<const D: usize>(
            table: &[[f64; D]],
            places: &[u32; WIDTH],
        ) -> [__m256d; D] {
            const { assert!(D == 2 || D == 3) };
            unsafe {
                let rows = places.map(|place| table.get_unchecked(place as usize).as_ptr());
                // entries `at` and `at + 1` of rows l and l + 2 share a register
                let pair = |l: usize, at: usize| {
                    let low = _mm256_castpd128_pd256(_mm_loadu_pd(rows[l].add(at)));
                    _mm256_insertf128_pd::<1>(low, _mm_loadu_pd(rows[l + 2].add(at)))
                };
                let (a, b) = (pair(0, 0), pair(1, 0));
                let (x, y) = (_mm256_unpacklo_pd(a, b), _mm256_unpackhi_pd(a, b));
                let last = _mm256_unpackhi_pd(pair(0, D - 2), pair(1, D - 2));
                std::array::from_fn(|k| [x, y, last][k])
            }
        }

        #[inline(always)]
        fn less(a: &[f32; LANES], b: &[f32; LANES]) -> u8 {
            unsafe {
                let (a, b) = (_mm256_loadu_ps(a.as_ptr()), _mm256_loadu_ps(b.as_ptr()));
                _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LT_OQ>(a, b)) as u8
            }
        }
        #[inline(always)]
        fn front(lanes: &[u32; LANES], set: u8) -> [u32; LANES] {
            unsafe {
                let from = _mm256_loadu_si256(FRONT[set as usize].as_ptr().cast());
                let lanes = _mm256_loadu_si256(lanes.as_ptr().cast());
                transmute(_mm256_permutevar8x32_epi32(lanes, from))
            }
        }
    }
}

/// Whether functions compiled for AVX-512 too may be used: twice the registers, so that constants stay in
/// them. The lanes are those of [`Avx2`].
#[cfg(target_arch = "x86_64")]
pub(super) fn has_avx512() -> bool {
    let more = std::arch::is_x86_feature_detected!("avx512f")
        && std::arch::is_x86_feature_detected!("avx512vl")
        && std::arch::is_x86_feature_detected!("avx512dq")
        && std::arch::is_x86_feature_detected!("avx512bw");
    has_avx2() && more
}

/// Whether [`Avx2`] may be used.
#[cfg(target_arch = "x86_64")]
pub(super) fn has_avx2() -> bool {
    std::arch::is_x86_feature_detected!("avx2") && std::arch::is_x86_feature_detected!("popcnt")
}

#[cfg(all(test, target_arch = "x86_64"))]
mod tests {
    use super::*;

    /// All that lanes do to some numbers.
    #[inline(always)]
    fn outcome<L: Lanes>() -> Vec<u64> {
        let table: Vec<[f64; 3]> = (0..9)
            .map(|l| std::array::from_fn(|k| (f64::from(l) - 3.1) / f64::from(k as u32 + 3)))
            .chain([[f64::INFINITY, f64::NAN, -0.0]])
            .collect();
        let (numbers, halves) = (table.as_flattened(), table.as_flattened().as_chunks().0);
        let mut out = Vec::new();
        for first in 0..6 {
            let places = [first + 4, first, first + 3, first + 1];
            // SAFETY: all places are within the tables, of ten and more.
            let ([a, b, c], [d, e], f) = unsafe {
                (
                    L::columns(&table, &places),
                    L::columns(halves, &places),
                    L::pick(numbers, &places),
                )
            };
            let all = [
                L::add(a, e),
                L::sub(b, c),
                L::mul(c, d),
                L::div(a, b),
                L::sqrt(L::mul(e, e)),
                L::max(b, c),
                L::max(d, c),
                L::where_less(a, L::splat(0.5), b),
                L::wide([0.0, 1.5, -2.0, 1e300]),
                f,
                L::wide(L::totals([a, d, e, f])),
            ];
            // NaNs may differ in their bits
            let bits = |x: f64| if x.is_nan() { u64::MAX } else { x.to_bits() };
            out.extend(all.into_iter().flat_map(|wide| L::lanes(wide).map(bits)));
        }
        let a: [f32; LANES] = [0.0, 1.0, f32::NAN, -0.0, f32::INFINITY, 2.0, -3.0, 7.0];
        let b: [f32; LANES] = [1.0, 1.0, 0.0, 0.0, f32::INFINITY, 2.5, -4.0, f32::INFINITY];
        out.push(L::less(&a, &b).into());
        let lanes = std::array::from_fn(|l| 10 + l as u32);
        for set in 0..=255u8 {
            let front = L::front(&lanes, set);
            out.extend(front[..set.count_ones() as usize].iter().map(|&lane| u64::from(lane)));
        }
        out
    }

    #[target_feature(enable = "avx2,popcnt")]
    fn wide_outcome() -> Vec<u64> {
        outcome::<Avx2>()
    }

    #[test]
    fn wide_registers_do_what_the_plain_code_does() {
        if has_avx2() {
            // SAFETY: the processor has been asked.
            assert_eq!(unsafe { wide_outcome() }, outcome::<Plain>());
        }
    }

    #[test]
    fn plain_lanes_are_compared_and_moved() {
        let a = std::array::from_fn(|l| l as f32);
        assert_eq!(Plain::less(&a, &[3.5; LANES]), 0b0000_1111);
        assert_eq!(Plain::front(&[9, 8, 7, 6, 5, 4, 3, 2], 0b1010_0001)[..3], [9, 4, 2]);
        assert_eq!(
            Plain::where_less([0.0, 1.0, 2.0, f64::NAN], [1.0; 4], [7.0; 4]),
            [7.0, 0.0, 0.0, 0.0]
        );
    }
}
