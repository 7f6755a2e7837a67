//! Colour to luminance.

/// An integer that can carry a colour channel.
pub(super) trait Channel: Copy {
    /// As a wide integer.
    fn widen(self) -> u64;
    /// From a weighted mean of values of this type.
    fn narrow(mean: u64) -> Self;
}

macro_rules! channels {
    ($($number:ty),*) => {
        $(impl Channel for $number {
            fn widen(self) -> u64 {
                self.into()
            }
            fn narrow(mean: u64) -> Self {
                mean as $number // a mean is no greater than the greatest value in it
            }
        })*
    };
}

channels!(u8, u16, u32);

/// One value a sample of `channels` interleaved ones: grey as it is, grey of grey and opacity, luminance of
/// colours with or without opacity.
pub(super) fn grey<T: Channel>(interleaved: Vec<T>, channels: usize) -> Vec<T> {
    match channels {
        2 => first_of::<2, T>(interleaved),
        3 => luminance::<3, T>(interleaved),
        4 => luminance::<4, T>(interleaved),
        _ => interleaved,
    }
}

/// Rec. 601 luminance of interleaved samples, red, green and blue first of `N`, in place.
///
/// The weights 0.299, 0.587, 0.114 are rounded to 2⁻¹⁶ so that they add up to exactly 1: white stays
/// white, and the result is rounded to the nearest integer.
fn luminance<const N: usize, T: Channel>(interleaved: Vec<T>) -> Vec<T> {
    in_place::<N, T>(interleaved, |sample| {
        let [r, g, b] = [0, 1, 2].map(|c| sample[c].widen());
        T::narrow((19_595 * r + 38_470 * g + 7_471 * b + 32_768) >> 16)
    })
}

/// The first of every `N` interleaved samples, in place.
pub(super) fn first_of<const N: usize, T: Copy>(interleaved: Vec<T>) -> Vec<T> {
    in_place::<N, T>(interleaved, |sample| sample[0])
}

/// One value for every `N` interleaved ones, in the same vector.
pub(super) fn in_place<const N: usize, T: Copy>(
    mut interleaved: Vec<T>,
    value: impl Fn(&[T]) -> T,
) -> Vec<T> {
    let count = interleaved.len() / N;
    for k in 0..count {
        interleaved[k] = value(&interleaved[k * N..][..N]);
    }
    interleaved.truncate(count);
    interleaved.shrink_to_fit();
    interleaved
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn luminance_keeps_greys_and_weighs_colours() {
        for grey in 0..=255u8 {
            assert_eq!(luminance::<3, u8>(vec![grey; 3]), [grey]);
        }
        assert_eq!(luminance::<3, u8>(vec![255, 0, 0, 0, 255, 0, 0, 0, 255]), [76, 150, 29]);
        assert_eq!(luminance::<4, u16>(vec![65535, 65535, 65535, 0]), [65535]);
        assert_eq!(luminance::<3, u32>(vec![u32::MAX; 3]), [u32::MAX]);
        assert_eq!(first_of::<2, u8>(vec![1, 9, 2, 9]), [1, 2]);
    }
}
