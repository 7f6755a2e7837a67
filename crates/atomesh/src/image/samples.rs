//! Sample values in the type in which a file holds them.

use rayon::prelude::*;
use std::ops::Range as IndexRange;

/// Sample values, kept in the type of the file so that a large image is held once.
///
/// 64-bit integers are held as `F64`.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Samples {
    /// Unsigned bytes.
    U8(Vec<u8>),
    /// Signed bytes.
    I8(Vec<i8>),
    /// Unsigned 16-bit integers.
    U16(Vec<u16>),
    /// Signed 16-bit integers.
    I16(Vec<i16>),
    /// Unsigned 32-bit integers.
    U32(Vec<u32>),
    /// Signed 32-bit integers.
    I32(Vec<i32>),
    /// Single precision.
    F32(Vec<f32>),
    /// Double precision.
    F64(Vec<f64>),
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

/// The range of some samples.
fn range_of(samples: impl Iterator<Item = f64>) -> Range {
    let mut range = Range { min: f64::NAN, max: f64::NAN, nan_count: 0, infinite_count: 0 };
    for s in samples {
        if s.is_finite() {
            range.min = range.min.min(s); // f64::min ignores the initial NaN
            range.max = range.max.max(s);
        } else if s.is_nan() {
            range.nan_count += 1;
        } else {
            range.infinite_count += 1;
        }
    }
    range
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
    pub fn get(&self, index: usize) -> f64 {
        each!(self, v => v[index].into())
    }

    /// A copy in single precision.
    pub fn to_f32(&self) -> Vec<f32> {
        match self {
            Samples::F32(v) => v.clone(),
            _ => each!(self, v => v.iter().map(|&s| f64::from(s) as f32).collect()),
        }
    }

    /// The same in single precision, without a copy if they already are.
    pub fn into_f32(self) -> Vec<f32> {
        match self {
            Samples::F32(v) => v,
            other => other.to_f32(),
        }
    }

    /// Writes `map` of the samples from index `start` on to `out`, until it is full.
    ///
    /// # Panics
    /// If there are not as many samples.
    pub fn map_into(&self, start: usize, out: &mut [f32], map: impl Fn(f64) -> f32) {
        let end = start + out.len();
        each!(self, v => for (o, &s) in out.iter_mut().zip(&v[start..end]) {
            *o = map(f64::from(s));
        });
    }

    /// The least and greatest sample, and the count of those that are not finite.
    pub fn range(&self) -> Range {
        each!(self, v => v
        .par_chunks(1 << 16)
        .map(|part| range_of(part.iter().map(|&s| f64::from(s))))
        .reduce(|| range_of([].into_iter()), |a, b| Range {
            min: a.min.min(b.min), // f64::min prefers a number to NaN
            max: a.max.max(b.max),
            nan_count: a.nan_count + b.nan_count,
            infinite_count: a.infinite_count + b.infinite_count,
        }))
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
                        Samples::$kind(out)
                    })*
                }
            };
        }
        gathered!(U8, I8, U16, I16, U32, I32, F32, F64)
    }
}
