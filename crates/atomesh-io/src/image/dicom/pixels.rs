//! What the numbers in pixel data mean: their bits, their shade and what they are rescaled by.

use std::sync::Arc;

use super::super::affine::wrong;
use super::super::error::ReadReason;
use super::FORMAT;
use super::data_set::DataSet;
use super::{tag, unsupported};

/// How the samples of an image lie in its file. Slices of a series agree in this.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Pixels {
    /// Samples along x and y.
    pub shape: [usize; 2],
    /// Bits that a sample takes.
    pub allocated: u16,
    /// Those of them that count.
    pub stored: u16,
    /// The highest of these.
    pub high: u16,
    pub is_signed: bool,
    /// Whether the least value is white.
    pub is_inverted: bool,
}

impl Pixels {
    /// What a header says of its pixel data.
    pub fn of(set: &DataSet, shape: [u16; 2]) -> Result<Self, ReadReason> {
        let colours = set.short(tag::SAMPLES_PER_PIXEL).unwrap_or(1);
        let photometric = set.text(tag::PHOTOMETRIC).unwrap_or("MONOCHROME2".into());
        let is_inverted = match photometric.as_str() {
            "MONOCHROME1" => true,
            "MONOCHROME2" | "" => false,
            _ => return Err(unsupported(format!("{photometric} samples"), "grey ones")),
        };
        if colours != 1 {
            return Err(unsupported(format!("{colours} values a sample"), "one value a sample"));
        }
        if shape.contains(&0) {
            return Err(wrong(FORMAT, "rows and columns", format!("{shape:?}"), "1 or more"));
        }
        let allocated = set.short(tag::BITS_ALLOCATED).unwrap_or(0);
        if ![1, 8, 16, 32].contains(&allocated) {
            return Err(wrong(FORMAT, "bits allocated", allocated.to_string(), "1, 8, 16 or 32"));
        }
        let stored = set.short(tag::BITS_STORED).unwrap_or(allocated);
        let high = set.short(tag::HIGH_BIT).unwrap_or(stored.wrapping_sub(1));
        if !(1..=allocated).contains(&stored) || high >= allocated || high + 1 < stored {
            let value = format!("{stored}, the highest of them {high}");
            return Err(wrong(FORMAT, "bits stored", value, "some of those allocated"));
        }
        let is_signed = set.short(tag::IS_SIGNED) == Some(1);
        let shape = shape.map(usize::from);
        Ok(Self { shape, allocated, stored, high, is_signed, is_inverted })
    }

    /// The samples of a frame.
    pub fn count(&self) -> usize {
        self.shape[0] * self.shape[1]
    }

    /// The bytes of so many samples.
    pub fn bytes(&self, count: u64) -> u64 {
        match self.allocated {
            1 => count.div_ceil(8),
            bits => count.saturating_mul(u64::from(bits) / 8),
        }
    }

    /// Type and shade for a message.
    pub fn text(&self) -> String {
        let Self { allocated, stored, is_signed, is_inverted, .. } = self;
        let sign = if *is_signed { "signed" } else { "unsigned" };
        let white = if *is_inverted { "least" } else { "greatest" };
        format!("{stored} of {allocated} bits, {sign}, the {white} white")
    }

    /// The value of the bits of a sample as it lies in its file.
    pub fn value(&self, number: u64) -> i64 {
        self.decoded(number >> (self.high + 1 - self.stored), u8::MAX)
    }

    /// The value of a number of so many bits, of which the lowest count.
    pub fn decoded(&self, number: u64, bits: u8) -> i64 {
        // bits beyond those that count held drawings in old files
        let unused = 64 - u32::from(self.stored.min(bits.into()));
        match self.is_signed {
            true => ((number << unused) as i64) >> unused,
            false => (number << unused >> unused) as i64,
        }
    }

    /// A value with black and white exchanged.
    pub fn inverted(&self, value: i64) -> i64 {
        if self.is_signed { -1 - value } else { (1 << self.stored) - 1 - value }
    }
}

/// What stored numbers are rescaled by: the modality transformation of PS3.3, C.11.1.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Scale {
    Linear { slope: f64, intercept: f64 },
    Table(Arc<Table>),
}

impl Scale {
    /// Values as they are stored.
    pub const NONE: Self = Self::Linear { slope: 1.0, intercept: 0.0 };

    /// What the elements of a header, or of an item of a functional group, say; none if they say nothing.
    pub fn of(set: &DataSet) -> Result<Option<Self>, ReadReason> {
        let slope = set.decimals(tag::SLOPE, "rescale slope")?.map(|[slope]| slope);
        let intercept = set.decimals(tag::INTERCEPT, "rescale intercept")?.map(|[b]| b);
        if slope.is_none() && intercept.is_none() {
            return Ok(None);
        }
        let slope = slope.unwrap_or(1.0);
        if slope == 0.0 {
            return Err(wrong(FORMAT, "rescale slope", "0", "another number"));
        }
        Ok(Some(Self::Linear { slope, intercept: intercept.unwrap_or(0.0) }))
    }

    /// The value of a stored number, in single precision.
    pub fn value(&self, stored: i64) -> f32 {
        match self {
            Self::Linear { slope, intercept } => (stored as f64 * slope + intercept) as f32,
            Self::Table(table) => table.value(stored),
        }
    }
}

/// A modality look-up table.
#[derive(Debug, PartialEq)]
pub(super) struct Table {
    /// The stored number of the first value.
    first: i64,
    values: Vec<u16>,
}

impl Table {
    /// The table in an item of the modality sequence.
    pub fn of(set: &DataSet, is_signed: bool) -> Result<Self, ReadReason> {
        let bad = |value: &str| {
            wrong(FORMAT, "modality look-up table", value, "a descriptor of three numbers and data")
        };
        let descriptor: Vec<u16> =
            set.shorts(tag::TABLE_DESCRIPTOR).map_or_else(Vec::new, Iterator::collect);
        let &[count, first, bits] = &descriptor[..] else { return Err(bad("without them")) };
        let count = if count == 0 { 1 << 16 } else { usize::from(count) };
        let first = if is_signed { i64::from(first as i16) } else { i64::from(first) };
        let bytes = set.get(tag::TABLE_DATA).ok_or_else(|| bad("empty"))?;
        let values: Vec<u16> = match bits {
            // values of 8 bits may be a byte each
            8 if bytes.len() < 2 * count => bytes.iter().map(|&byte| byte.into()).collect(),
            8..=16 => set.shorts(tag::TABLE_DATA).map_or_else(Vec::new, Iterator::collect),
            _ => return Err(bad(&format!("of {bits} bits"))),
        };
        if values.len() < count {
            return Err(bad(&format!("of {} values for {count}", values.len())));
        }
        Ok(Self { first, values: values[..count].to_vec() })
    }

    fn value(&self, stored: i64) -> f32 {
        let last = self.values.len() - 1;
        let index = usize::try_from(stored.saturating_sub(self.first).max(0)).unwrap_or(last);
        self.values[index.min(last)].into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stored_bits_become_values_of_either_sign_and_shade() {
        let of = |stored, high, is_signed| Pixels {
            shape: [1, 1],
            allocated: 16,
            stored,
            high,
            is_signed,
            is_inverted: false,
        };
        assert_eq!(of(12, 11, false).value(0xf123), 0x123);
        assert_eq!(of(12, 11, true).value(0x0fff), -1);
        assert_eq!(of(12, 11, true).value(0xf800), -2048);
        assert_eq!(of(12, 15, false).value(0x123f), 0x123);
        assert_eq!(of(12, 15, true).value(0xfff3), -1);
        assert_eq!(of(12, 11, false).inverted(0), 4095);
        assert_eq!(of(12, 11, true).inverted(-2048), 2047);
        assert_eq!(of(16, 15, true).inverted(0), -1);
    }

    #[test]
    fn a_table_goes_on_beyond_its_ends() {
        let table = Scale::Table(Arc::new(Table { first: -1, values: vec![7, 8, 400] }));
        let values = [-9, -1, 0, 1, 2, i64::MAX].map(|stored| table.value(stored));
        assert_eq!(values, [7.0, 7.0, 8.0, 400.0, 400.0, 400.0]);
    }
}
