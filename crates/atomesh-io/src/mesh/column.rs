//! Arrays of a mesh file, made piece by piece, so that the mesh is never copied whole.

use std::io::{self, Write};
use std::ops::Range;

use super::field::Values;
use super::standing::{Standing, placed, turned};

/// The order of the bytes in a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Endian {
    Little,
    Big,
}

/// A number with a fixed place in files.
pub(crate) trait Number: Copy + Send + Sync {
    /// The bytes it takes.
    const SIZE: usize;
    /// Appends the number's bytes.
    fn put(self, endian: Endian, out: &mut Vec<u8>);
    /// Takes the number from exactly `SIZE` bytes.
    fn take(bytes: &[u8], endian: Endian) -> Self;
    /// The nearest real number.
    fn real(self) -> f64;
    /// The same number as an index, if it is one.
    fn index(self) -> Option<u32>;
}

macro_rules! number {
    ($($t:ty),*) => {$(
        impl Number for $t {
            const SIZE: usize = size_of::<$t>();

            fn put(self, endian: Endian, out: &mut Vec<u8>) {
                match endian {
                    Endian::Little => out.extend_from_slice(&self.to_le_bytes()),
                    Endian::Big => out.extend_from_slice(&self.to_be_bytes()),
                }
            }

            fn take(bytes: &[u8], endian: Endian) -> Self {
                let mut array = [0; size_of::<$t>()];
                array.copy_from_slice(bytes);
                match endian {
                    Endian::Little => Self::from_le_bytes(array),
                    Endian::Big => Self::from_be_bytes(array),
                }
            }

            fn real(self) -> f64 {
                self as f64
            }

            fn index(self) -> Option<u32> {
                let index = self as u32; // saturates or wraps, and then differs
                (index as Self == self).then_some(index)
            }
        }
    )*};
}
number!(i8, u8, i16, u16, i32, u32, i64, u64, f32, f64);

/// An array of items of one size, of which any range can be made by itself.
pub(crate) struct Column<'a> {
    count: usize,
    item_size: usize,
    fill: Box<Fill<'a>>,
}

/// Appends the bytes of a range of items.
type Fill<'a> = dyn Fn(Range<usize>, &mut Vec<u8>) + Sync + 'a;

impl<'a> Column<'a> {
    /// `count` items of `item_size` bytes; `fill` appends those of a range.
    pub fn new(
        count: usize,
        item_size: usize,
        fill: impl Fn(Range<usize>, &mut Vec<u8>) + Sync + 'a,
    ) -> Self {
        Self { count, item_size, fill: Box::new(fill) }
    }

    /// The numbers `value(0)`, `value(1)` ... `value(count − 1)`.
    pub fn numbers<T: Number>(
        count: usize,
        endian: Endian,
        value: impl Fn(usize) -> T + Sync + 'a,
    ) -> Self {
        Self::new(count, T::SIZE, move |range, out| {
            for i in range {
                value(i).put(endian, out);
            }
        })
    }

    /// The numbers of a slice.
    pub fn slice<T: Number>(values: &'a [T], endian: Endian) -> Self {
        Self::numbers(values.len(), endian, |i| values[i])
    }

    /// The numbers of a field.
    pub fn values(values: Values<'a>, endian: Endian) -> Self {
        match values {
            Values::Single(values) => Self::slice(values, endian),
            Values::Double(values) => Self::slice(values, endian),
        }
    }

    /// The first numbers of a field.
    pub fn first_values(values: Values<'a>, count: usize, endian: Endian) -> Self {
        match values {
            Values::Single(values) => Self::slice(&values[..count], endian),
            Values::Double(values) => Self::slice(&values[..count], endian),
        }
    }

    /// Points as x, y, z: of a flat mesh where it stands, or else at z = 0.
    pub fn points<const D: usize>(
        points: &'a [[f64; D]],
        standing: Option<&'a Standing>,
        endian: Endian,
    ) -> Self {
        Self::triples(points, move |p| placed(p, standing), endian)
    }

    /// Vectors likewise.
    pub fn vectors<const D: usize>(
        vectors: &'a [[f64; D]],
        standing: Option<&'a Standing>,
        endian: Endian,
    ) -> Self {
        Self::triples(vectors, move |v| turned(v, standing), endian)
    }

    /// Three numbers of each.
    fn triples<const D: usize>(
        items: &'a [[f64; D]],
        of: impl Fn(&[f64; D]) -> [f64; 3] + Sync + 'a,
        endian: Endian,
    ) -> Self {
        Self::new(items.len(), 24, move |range, out| {
            items[range].iter().flat_map(&of).for_each(|x| x.put(endian, out));
        })
    }

    /// The number of items.
    pub fn count(&self) -> usize {
        self.count
    }

    /// The bytes of one item.
    pub fn item_size(&self) -> usize {
        self.item_size
    }

    /// Appends the items of a range.
    pub fn fill(&self, range: Range<usize>, out: &mut Vec<u8>) {
        (self.fill)(range, out);
    }

    /// The ranges of items that make blocks of at most `block` bytes, but one item at least.
    pub fn blocks(&self, block: usize) -> impl ExactSizeIterator<Item = Range<usize>> + use<> {
        let (count, each) = (self.count, (block / self.item_size).max(1));
        (0..count.div_ceil(each)).map(move |b| b * each..((b + 1) * each).min(count))
    }

    /// Writes all items, a block at a time.
    pub fn write(&self, out: &mut dyn Write) -> io::Result<()> {
        let mut bytes = Vec::new();
        for range in self.blocks(1 << 18) {
            bytes.clear();
            self.fill(range, &mut bytes);
            out.write_all(&bytes)?;
        }
        Ok(())
    }
}

/// Whether indices below `limit` fit in a signed 32-bit integer, which every reader takes.
pub(crate) fn fits_i32(limit: usize) -> bool {
    i32::try_from(limit).is_ok()
}
