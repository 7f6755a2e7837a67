//! Sample values in the type in which a file holds them.

use crate::parallel::prelude::*;

use super::values::Values;
use std::ops::Range as IndexRange;

/// Sample values, kept in the type of the file so that a large image is held once; clones share their memory.
///
/// 64-bit integers are held as `F64`.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Samples {
    /// Unsigned bytes.
    U8(Values<u8>),
    /// Signed bytes.
    I8(Values<i8>),
    /// Unsigned 16-bit integers.
    U16(Values<u16>),
    /// Signed 16-bit integers.
    I16(Values<i16>),
    /// Unsigned 32-bit integers.
    U32(Values<u32>),
    /// Signed 32-bit integers.
    I32(Values<i32>),
    /// Single precision.
    F32(Values<f32>),
    /// Double precision.
    F64(Values<f64>),
}

/// The least and greatest finite sample, and how many are not finite.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// The least finite sample; NaN if there is none.
    pub min: f64,
    /// The greatest finite sample; NaN if there is none.
    pub max: f64,
    /// How many samples are NaN.
    pub nan_count: usize,
    /// How many samples are infinite.
    pub infinite_count: usize,
}

/// The range of no samples.
const EMPTY: Range = Range { min: f64::NAN, max: f64::NAN, nan_count: 0, infinite_count: 0 };

impl Range {
    /// The range with one more sample.
    #[inline]
    fn with(mut self, sample: f64) -> Self {
        if sample.is_finite() {
            self.min = self.min.min(sample); // f64::min prefers a number to NaN
            self.max = self.max.max(sample);
        } else if sample.is_nan() {
            self.nan_count += 1;
        } else {
            self.infinite_count += 1;
        }
        self
    }

    /// The range of the samples of both.
    fn union(self, other: Self) -> Self {
        Self {
            min: self.min.min(other.min),
            max: self.max.max(other.max),
            nan_count: self.nan_count + other.nan_count,
            infinite_count: self.infinite_count + other.infinite_count,
        }
    }
}

/// The range of the samples, part by part on all threads.
fn range_of<T: Sync>(samples: &[T], part: impl Fn(&[T]) -> Range + Sync + Send) -> Range {
    samples.par_chunks(1 << 16).map(part).reduce(|| EMPTY, Range::union)
}

/// Samples looked at side by side.
const LANES: usize = 16;

/// The range of samples that are all finite, else `None`: without a branch, so that it is vectorised.
fn finite_range(samples: &[f32]) -> Option<Range> {
    let (mut min, mut max) = ([f32::INFINITY; LANES], [f32::NEG_INFINITY; LANES]);
    let mut odd = [0.0f32; LANES];
    let mut look = |block: &[f32; LANES]| {
        for i in 0..LANES {
            let s = block[i];
            min[i] = if s < min[i] { s } else { min[i] };
            max[i] = if s > max[i] { s } else { max[i] };
            odd[i] += s * 0.0; // NaN from the first NaN or infinity on
        }
    };
    let (blocks, rest) = samples.as_chunks();
    blocks.iter().for_each(&mut look);
    let &first = samples.first()?;
    let mut last = [first; LANES];
    last[..rest.len()].copy_from_slice(rest);
    look(&last);
    let range = Range {
        min: min.into_iter().fold(f32::INFINITY, f32::min).into(),
        max: max.into_iter().fold(f32::NEG_INFINITY, f32::max).into(),
        ..EMPTY
    };
    odd.iter().all(|&o| o == 0.0).then_some(range)
}

/// Runs the same expression on whichever vector the samples hold.
macro_rules! each {
    ($samples:expr, $v:ident => $body:expr) => {
        match $samples {
            Samples::U8($v) => $body,
            Samples::I8($v) => $body,
            Samples::U16($v) => $body,
            Samples::I16($v) => $body,
            Samples::U32($v) => $body,
            Samples::I32($v) => $body,
            Samples::F32($v) => $body,
            Samples::F64($v) => $body,
        }
    };
}

impl Samples {
    /// How many samples there are.
    pub fn len(&self) -> usize {
        each!(self, v => v.len())
    }

    /// Whether there are no samples.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The name of the sample type, as NumPy spells it: `uint8`, `float32` ...
    pub fn type_name(&self) -> &'static str {
        match self {
            Samples::U8(_) => "uint8",
            Samples::I8(_) => "int8",
            Samples::U16(_) => "uint16",
            Samples::I16(_) => "int16",
            Samples::U32(_) => "uint32",
            Samples::I32(_) => "int32",
            Samples::F32(_) => "float32",
            Samples::F64(_) => "float64",
        }
    }

    /// The bytes that one sample takes.
    pub fn sample_size(&self) -> usize {
        match self {
            Samples::U8(_) | Samples::I8(_) => 1,
            Samples::U16(_) | Samples::I16(_) => 2,
            Samples::U32(_) | Samples::I32(_) | Samples::F32(_) => 4,
            Samples::F64(_) => 8,
        }
    }

    /// The sample at `index`.
    ///
    /// # Panics
    /// If there is no such sample.
    #[allow(clippy::useless_conversion)] // of f64, one of the types
    pub fn get(&self, index: usize) -> f64 {
        each!(self, v => v[index].into())
    }

    /// A copy in single precision.
    #[allow(clippy::useless_conversion)] // of f64, one of the types
    pub fn to_f32(&self) -> Vec<f32> {
        match self {
            Samples::F32(v) => v.to_vec(),
            _ => each!(self, v => v.par_iter().map(|&s| f64::from(s) as f32).collect()),
        }
    }

    /// The same in single precision, without a copy if they already are.
    pub fn into_f32(self) -> Vec<f32> {
        match self {
            Samples::F32(v) => v.into_vec(),
            other => other.to_f32(),
        }
    }

    /// Writes `map` of the samples from index `start` on to `out`, until it is full.
    ///
    /// # Panics
    /// If there are not as many samples.
    #[allow(clippy::useless_conversion)] // of f64, one of the types
    pub fn map_into(&self, start: usize, out: &mut [f32], map: impl Fn(f64) -> f32) {
        let end = start + out.len();
        each!(self, v => for (o, &s) in out.iter_mut().zip(&v[start..end]) {
            *o = map(f64::from(s));
        });
    }

    /// The least and greatest sample, and the count of those that are not finite.
    pub fn range(&self) -> Range {
        macro_rules! whole {
            ($v:expr, $number:ident) => {
                range_of($v, |part| {
                    let ends = ($number::MAX, $number::MIN);
                    let (min, max) = part.iter().fold(ends, |(a, b), &s| (a.min(s), b.max(s)));
                    Range { min: min.into(), max: max.into(), ..EMPTY }
                })
            };
        }
        match self {
            Samples::U8(v) => whole!(v, u8),
            Samples::I8(v) => whole!(v, i8),
            Samples::U16(v) => whole!(v, u16),
            Samples::I16(v) => whole!(v, i16),
            Samples::U32(v) => whole!(v, u32),
            Samples::I32(v) => whole!(v, i32),
            Samples::F32(v) => range_of(v, |part| {
                finite_range(part).unwrap_or_else(|| {
                    part.iter().fold(EMPTY, |range, &s| range.with(f64::from(s)))
                })
            }),
            Samples::F64(v) => range_of(v, |part| part.iter().fold(EMPTY, |r, &s| r.with(s))),
        }
    }

    /// Replaces every NaN by `value` and returns how many there were.
    pub fn fill_nan(&mut self, value: f64) -> usize {
        let mut count = 0;
        match self {
            Samples::F32(v) => v.iter_mut().filter(|s| s.is_nan()).for_each(|s| {
                *s = value as f32;
                count += 1;
            }),
            Samples::F64(v) => v.iter_mut().filter(|s| s.is_nan()).for_each(|s| {
                *s = value;
                count += 1;
            }),
            _ => {}
        }
        count
    }

    /// `count` samples, each the one whose index `from` gives, or 0; in the same type.
    pub(super) fn picked(
        &self,
        count: usize,
        from: impl Fn(usize) -> Option<usize> + Sync,
    ) -> Self {
        macro_rules! picked {
            ($($kind:ident),*) => {
                match self {
                    $(Samples::$kind(v) => {
                        let of = |index| from(index).map_or(Default::default(), |own| v[own]);
                        Samples::$kind((0..count).into_par_iter().map(of).collect())
                    })*
                }
            };
        }
        picked!(U8, I8, U16, I16, U32, I32, F32, F64)
    }

    /// The samples of the index ranges one after another, `count` in all, in the same type.
    pub(super) fn gather(
        &self,
        count: usize,
        ranges: impl Iterator<Item = IndexRange<usize>>,
    ) -> Self {
        macro_rules! gathered {
            ($($kind:ident),*) => {
                match self {
                    $(Samples::$kind(v) => {
                        let mut out = Vec::with_capacity(count);
                        ranges.for_each(|r| out.extend_from_slice(&v[r]));
                        Samples::$kind(out.into())
                    })*
                }
            };
        }
        gathered!(U8, I8, U16, I16, U32, I32, F32, F64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_range_of_singles_is_that_of_one_after_another() {
        let plain: Vec<f32> = (0..200).map(|i| ((i * 37) % 101) as f32 - 50.5).collect();
        for count in [1, 15, 16, 17, 200] {
            for odd in [None, Some(f32::NAN), Some(f32::INFINITY), Some(f32::NEG_INFINITY)] {
                for place in [0, count / 2, count - 1] {
                    let mut samples = plain[..count].to_vec();
                    samples[place] = odd.unwrap_or(samples[place]);
                    let slow = samples.iter().fold(EMPTY, |r, &s| r.with(f64::from(s)));
                    assert_eq!(finite_range(&samples).is_some(), odd.is_none());
                    let range = Samples::F32(samples.into()).range();
                    assert_eq!(format!("{range:?}"), format!("{slow:?}"), "{count} {place}");
                }
            }
        }
    }

    #[test]
    fn whole_numbers_have_their_ends_as_range() {
        let range = Samples::I8(vec![3, -128, 127, 0].into()).range();
        assert_eq!((range.min, range.max), (-128.0, 127.0));
        let none = Samples::U16(Vec::new().into()).range();
        assert!(none.min.is_nan() && none.max.is_nan());
    }
}
