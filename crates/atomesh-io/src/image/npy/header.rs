//! The header of an NPY file: its length, and a dictionary.

use std::io::Read;

use super::super::error::ReadReason;
use super::super::sample_type::{ByteOrder, SampleType};
use super::super::text::shortened;
use super::super::{spelling, stream};
use super::FORMAT;
use super::literal::{Words, wrong};

/// The longest header that is read; NumPy's own limit is 10,000.
const LONGEST_HEADER: usize = 1 << 16;

/// What the dictionary says.
#[derive(Debug)]
pub(in super::super) struct Header {
    /// The array's shape from its last axis to its first, x first.
    pub shape: Vec<usize>,
    pub sample_type: SampleType,
    pub byte_order: ByteOrder,
    pub fortran_order: bool,
}

impl Header {
    /// Reads a header, and the number of bytes before the first sample.
    pub fn read(source: &mut dyn Read) -> Result<(Self, u64), ReadReason> {
        let (text, start) = header_text(source)?;
        Ok((Self::parse(&text)?, start))
    }

    /// Reads `{'descr': '<f4', 'fortran_order': False, 'shape': (3, 4), }`, its entries in any
    /// order.
    fn parse(text: &[u8]) -> Result<Self, ReadReason> {
        let text = std::str::from_utf8(text)
            .map_err(|_| wrong("text", "not UTF-8", "a Python dictionary"))?;
        let mut words = Words { rest: text };
        let (mut descr, mut fortran_order, mut shape) = (None, None, None);
        words.expect("{")?;
        while !words.skip("}") {
            let key = words.quoted("key")?;
            words.expect(":")?;
            match key {
                "descr" => descr = Some(words.quoted("descr")?),
                "fortran_order" => fortran_order = Some(words.truth()?),
                "shape" => shape = Some(words.tuple()?),
                _ => return Err(wrong("key", key, "descr, fortran_order or shape")),
            }
            if !words.skip(",") {
                words.expect("}")?;
                break;
            }
        }
        let missing = |field| wrong(field, "missing", "an entry of that name");
        let (sample_type, byte_order) = sample_type(descr.ok_or_else(|| missing("descr"))?)?;
        let mut shape: Vec<usize> = shape.ok_or_else(|| missing("shape"))?;
        shape.reverse();
        let fortran_order = fortran_order.ok_or_else(|| missing("fortran_order"))?;
        Ok(Self { shape, sample_type, byte_order, fortran_order })
    }
}

/// The dictionary's text, and the number of bytes before the first sample.
fn header_text(source: &mut dyn Read) -> Result<(Vec<u8>, u64), ReadReason> {
    let cut = || wrong("length", "past the end of the file", "a whole header");
    let mut take = |count: usize| {
        let mut bytes = vec![0; count];
        let filled = stream::fill(source, &mut bytes)?;
        if filled < count { Err(cut()) } else { Ok(bytes) }
    };
    let version = take(8)?[6];
    let (length, prefix) = match version {
        1 => (take(2)?.iter().rev().fold(0, |n, &b| n << 8 | usize::from(b)), 10),
        2 | 3 => (take(4)?.iter().rev().fold(0, |n, &b| n << 8 | usize::from(b)), 12),
        _ => return Err(wrong("version", &version.to_string(), "1, 2 or 3")),
    };
    if length > LONGEST_HEADER {
        return Err(wrong("length", &length.to_string(), "at most 65536"));
    }
    Ok((take(length)?, (prefix + length) as u64))
}

/// The sample type that `descr` names, such as `<f4`.
fn sample_type(descr: &str) -> Result<(SampleType, ByteOrder), ReadReason> {
    let (order, kind) = match descr.split_at_checked(1) {
        Some((">", kind)) => (ByteOrder::Big, kind),
        Some(("<" | "|" | "=", kind)) => (ByteOrder::Little, kind),
        _ => (ByteOrder::Little, descr),
    };
    let found = spelling::named(kind, |own| own.npy).ok_or_else(|| ReadReason::Unsupported {
        format: FORMAT,
        found: format!("items of type {:?}", shortened(descr)),
        expected: "bool, integers and floats of up to 64 bits",
    });
    Ok((found?, order))
}
