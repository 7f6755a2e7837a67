//! NumPy's array file, versions 1 to 3 (NEP 1): a magic, a Python dictionary as text, the samples.
//!
//! An array (z, y, x) in C order has x fastest, as our samples have; one in Fortran order is turned
//! while it is read.

use std::io::{Read, Write};

use atomesh::image::Image;
use atomesh::watch::Watch;

use super::stream::{self, Layout};
use super::{AnyImage, ByteOrder, ImageFormat, ReadReason, SampleType, WriteReason};

const FORMAT: ImageFormat = ImageFormat::Npy;

/// The longest header that is read; NumPy's own limit is 10,000.
const LONGEST_HEADER: usize = 1 << 16;

/// Samples for each byte of the file from which on a shape is called absurd and not cut short.
const ABSURD: u64 = 1 << 10;

/// Reads an array of two or three axes.
pub(super) fn read<R: Read>(mut source: R, file_bytes: u64) -> Result<AnyImage, ReadReason> {
    let (text, start) = header_text(&mut source)?;
    let header = Header::parse(&text)?;
    let size = header.sample_type.size() as u64;
    let count = super::plausible_count(&header.shape, file_bytes, ABSURD)?;
    let found = file_bytes.saturating_sub(start) / size;
    if count as u64 > found {
        return Err(ReadReason::Truncated { expected: count as u64, found });
    }
    let turned = match *header.shape {
        _ if !header.fortran_order => None,
        [nx, ny] => Some([nx, ny, 1]),
        [nx, ny, nz] => Some([nx, ny, nz]),
        _ => None,
    };
    let layout = Layout {
        sample_type: header.sample_type,
        byte_order: header.byte_order,
        count,
        reserve: count,
        scale: None,
        turned,
    };
    AnyImage::frameless(&header.shape, stream::read_samples(&mut source, &layout)?)
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

/// The error for an entry of the header.
fn wrong(field: &'static str, value: &str, expected: &'static str) -> ReadReason {
    ReadReason::Header { format: FORMAT, field, value: shortened(value), expected }
}

/// At most 80 characters of a value, for a message.
fn shortened(value: &str) -> String {
    match value.char_indices().nth(80) {
        Some((end, _)) => format!("{} ...", &value[..end]),
        None => value.into(),
    }
}

/// What the dictionary says.
struct Header {
    /// Samples along x, y (and z): the array's shape from its last axis to its first.
    shape: Vec<usize>,
    sample_type: SampleType,
    byte_order: ByteOrder,
    fortran_order: bool,
}

impl Header {
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
        if !(2..=3).contains(&shape.len()) {
            return Err(ReadReason::Unsupported {
                format: FORMAT,
                found: format!("an array of {} axes, {shape:?}", shape.len()),
                expected: "an array (y, x) or (z, y, x)",
            });
        }
        shape.reverse();
        let fortran_order = fortran_order.ok_or_else(|| missing("fortran_order"))?;
        Ok(Self { shape, sample_type, byte_order, fortran_order })
    }
}

/// The sample type that `descr` names, such as `<f4`.
fn sample_type(descr: &str) -> Result<(SampleType, ByteOrder), ReadReason> {
    let (order, kind) = match descr.split_at_checked(1) {
        Some((">", kind)) => (ByteOrder::Big, kind),
        Some(("<" | "|" | "=", kind)) => (ByteOrder::Little, kind),
        _ => (ByteOrder::Little, descr),
    };
    let sample_type = match kind {
        "b1" | "?" => SampleType::Bool,
        "u1" => SampleType::U8,
        "i1" => SampleType::I8,
        "u2" => SampleType::U16,
        "i2" => SampleType::I16,
        "u4" => SampleType::U32,
        "i4" => SampleType::I32,
        "u8" => SampleType::U64,
        "i8" => SampleType::I64,
        "f2" => SampleType::F16,
        "f4" => SampleType::F32,
        "f8" => SampleType::F64,
        _ => {
            return Err(ReadReason::Unsupported {
                format: FORMAT,
                found: format!("items of type {:?}", shortened(descr)),
                expected: "bool, integers and floats of up to 64 bits",
            });
        }
    };
    Ok((sample_type, order))
}

/// Takes the words of a Python literal one by one.
struct Words<'a> {
    rest: &'a str,
}

impl<'a> Words<'a> {
    /// Takes `word` if it is the next one.
    fn skip(&mut self, word: &str) -> bool {
        self.rest = self.rest.trim_start();
        match self.rest.strip_prefix(word) {
            Some(rest) => {
                self.rest = rest;
                true
            }
            None => false,
        }
    }

    /// Takes `word`, which must be the next one.
    fn expect(&mut self, word: &'static str) -> Result<(), ReadReason> {
        if self.skip(word) { Ok(()) } else { Err(wrong("text", self.rest, word)) }
    }

    /// Takes a string in single or double quotes; the strings of headers have no escapes.
    fn quoted(&mut self, field: &'static str) -> Result<&'a str, ReadReason> {
        for quote in ["'", "\""] {
            if self.skip(quote) {
                let (inside, rest) = self
                    .rest
                    .split_once(quote)
                    .ok_or_else(|| wrong(field, self.rest, "a closing quote"))?;
                self.rest = rest;
                return Ok(inside);
            }
        }
        if field == "descr" && self.skip("[") {
            return Err(ReadReason::Unsupported {
                format: FORMAT,
                found: "items of several fields".into(),
                expected: "bool, integers and floats of up to 64 bits",
            });
        }
        Err(wrong(field, self.rest, "a string"))
    }

    /// Takes `True` or `False`.
    fn truth(&mut self) -> Result<bool, ReadReason> {
        let truth = self.skip("True");
        if truth || self.skip("False") {
            Ok(truth)
        } else {
            Err(wrong("fortran_order", self.rest, "True or False"))
        }
    }

    /// Takes a tuple of whole numbers.
    fn tuple(&mut self) -> Result<Vec<usize>, ReadReason> {
        let mut numbers = Vec::new();
        self.expect("(")?;
        while !self.skip(")") {
            self.rest = self.rest.trim_start();
            let end = self.rest.find(|c: char| !c.is_ascii_digit()).unwrap_or(self.rest.len());
            let (digits, rest) = self.rest.split_at(end);
            let number =
                digits.parse().map_err(|_| wrong("shape", self.rest, "whole numbers below 2^64"));
            numbers.push(number?);
            self.rest = rest.strip_prefix('L').unwrap_or(rest); // Python 2 wrote 3L
            if !self.skip(",") {
                self.expect(")")?;
                break;
            }
        }
        Ok(numbers)
    }
}

/// Writes an array (y, x) or (z, y, x), version 1.0, as NumPy would.
pub(super) fn write<const D: usize>(
    out: &mut dyn Write,
    image: &Image<D>,
    watch: &mut dyn Watch,
) -> Result<(), WriteReason> {
    let samples = image.samples();
    let descr = match samples.type_name() {
        "uint8" => "|u1",
        "int8" => "|i1",
        "uint16" => "<u2",
        "int16" => "<i2",
        "uint32" => "<u4",
        "int32" => "<i4",
        "float32" => "<f4",
        _ => "<f8",
    };
    let shape: Vec<_> = image.frame().shape().iter().rev().map(usize::to_string).collect();
    let mut text = format!(
        "{{'descr': '{descr}', 'fortran_order': False, 'shape': ({}), }}",
        shape.join(", ")
    );
    // padded so that the samples begin at a multiple of 64 bytes
    while (10 + text.len() + 1) % 64 != 0 {
        text.push(' ');
    }
    text.push('\n');
    out.write_all(b"\x93NUMPY\x01\x00")?;
    out.write_all(&(text.len() as u16).to_le_bytes())?; // at most 192, as three numbers are short
    out.write_all(text.as_bytes())?;
    stream::write_samples(out, samples, FORMAT, watch)
}

#[cfg(test)]
mod tests {
    use super::super::{ReadOptions, decode_image};
    use super::*;
    use atomesh::image::{Frame, Samples};
    use atomesh::watch::Silent;

    fn file(dictionary: &str, samples: &[u8]) -> Vec<u8> {
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        bytes.extend((dictionary.len() as u16).to_le_bytes());
        bytes.extend(dictionary.as_bytes());
        bytes.extend(samples);
        bytes
    }

    fn decode(bytes: &[u8]) -> Result<AnyImage, ReadReason> {
        decode_image(bytes, FORMAT, &ReadOptions::default(), &mut Silent)
    }

    fn message(dictionary: &str) -> String {
        decode(&file(dictionary, &[0; 16])).unwrap_err().to_string()
    }

    #[test]
    fn arrays_are_read_in_either_order() {
        let c = file(
            "{'descr': '|u1', 'fortran_order': False, 'shape': (2, 3), }",
            &[0, 1, 2, 10, 11, 12],
        );
        let f = file(
            "{'shape': (2, 3), 'fortran_order': True, 'descr': '|u1'}",
            &[0, 10, 1, 11, 2, 12],
        );
        for bytes in [c, f] {
            let image = decode(&bytes).unwrap();
            assert_eq!(image.shape(), [3, 2]);
            assert_eq!(*image.samples(), Samples::U8(vec![0, 1, 2, 10, 11, 12]));
        }
    }

    #[test]
    fn every_type_is_read() {
        let cases: [(&str, &[u8], Samples); 14] = [
            ("|b1", &[2, 0], Samples::U8(vec![1, 0])),
            ("?", &[1, 0], Samples::U8(vec![1, 0])),
            ("|u1", &[200, 0], Samples::U8(vec![200, 0])),
            ("|i1", &[200, 0], Samples::I8(vec![-56, 0])),
            ("<u2", &[1, 2, 0, 0], Samples::U16(vec![513, 0])),
            (">i2", &[255, 254, 0, 0], Samples::I16(vec![-2, 0])),
            (">u4", &[1, 0, 0, 2, 0, 0, 0, 0], Samples::U32(vec![16777218, 0])),
            ("<i4", &[254, 255, 255, 255, 0, 0, 0, 0], Samples::I32(vec![-2, 0])),
            (
                ">u8",
                &[0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0],
                Samples::F64(vec![4294967296.0, 0.0]),
            ),
            ("<i8", &[255; 16], Samples::F64(vec![-1.0, -1.0])),
            ("<f2", &[0, 0x3c, 0, 0xc0], Samples::F32(vec![1.0, -2.0])),
            (">f4", &[0x3f, 0x80, 0, 0, 0, 0, 0, 0], Samples::F32(vec![1.0, 0.0])),
            ("<f4", &[0, 0, 0x80, 0x3f, 0, 0, 0, 0], Samples::F32(vec![1.0, 0.0])),
            (
                ">f8",
                &[0xbf, 0xe0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0],
                Samples::F64(vec![-0.5, 0.0]),
            ),
        ];
        for (descr, bytes, expected) in cases {
            let text = format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': (1, 2)}}");
            assert_eq!(*decode(&file(&text, bytes)).unwrap().samples(), expected, "{descr}");
        }
    }

    #[test]
    fn absurd_shapes_are_refused() {
        for shape in [
            "(9223372036854775808, 1)",
            "(9223372036854775808, 2)",
            "(4294967296, 4294967296, 4294967296)",
            "(1000000, 1000000)",
        ] {
            let text = format!("{{'descr': '<f8', 'fortran_order': True, 'shape': {shape}}}");
            assert!(message(&text).contains("more than a file of"), "{}", message(&text));
        }
        let text = "{'descr': '<f8', 'fortran_order': False, 'shape': (18446744073709551616, 1)}";
        assert!(message(text).contains("whole numbers below 2^64"), "{}", message(text));
        let text = "{'descr': '<f8', 'fortran_order': False, 'shape': (0, 5)}";
        assert!(message(text).contains("[5, 0] has no samples"), "{}", message(text));
    }

    #[test]
    fn a_cut_file_says_how_many_samples_are_there() {
        let text = "{'descr': '<f8', 'fortran_order': False, 'shape': (3, 4)}";
        assert!(message(text).contains("2 of 12 samples"), "{}", message(text));
        let whole = file(text, &[0; 96]);
        for length in 1..whole.len() {
            assert!(decode(&whole[..length]).is_err(), "{length}");
        }
        assert!(decode(&whole).is_ok());
    }

    #[test]
    fn what_is_not_supported_is_named() {
        let with = |descr: &str, shape: &str| {
            message(&format!("{{'descr': {descr}, 'fortran_order': False, 'shape': {shape}}}"))
        };
        assert!(with("'<c16'", "(1, 1)").contains("\"<c16\""));
        assert!(with("'|O'", "(1, 1)").contains("\"|O\""));
        assert!(with("[('a', '<f4')]", "(1, 1)").contains("several fields"));
        assert!(with("'<f4'", "(4,)").contains("1 axes"));
        assert!(with("'<f4'", "()").contains("0 axes"));
        assert!(with("'<f4'", "(1, 1, 1, 4)").contains("4 axes"));
        assert!(with("'<f4'", "(-1, 1)").contains("whole numbers"));
        assert!(message("{'descr': '<f4', 'shape': (1, 1)}").contains("fortran_order is missing"));
        assert!(message("{'descr': '<f4").contains("closing quote"));
        assert!(message("").contains("expected {"));
        let mut newer = file("", &[]);
        newer[6] = 9;
        assert!(decode(&newer).unwrap_err().to_string().contains("version is 9"));
    }

    #[test]
    fn the_header_is_what_numpy_writes() {
        let image = Image::new(Frame::new([3, 2]).unwrap(), Samples::F32(vec![0.5; 6])).unwrap();
        let mut bytes = Vec::new();
        write(&mut bytes, &image, &mut Silent).unwrap();
        let mut expected = b"\x93NUMPY\x01\x00\x76\x00\
            {'descr': '<f4', 'fortran_order': False, 'shape': (2, 3), }"
            .to_vec();
        expected.resize(127, b' ');
        expected.push(b'\n');
        assert_eq!(bytes[..128], expected);
        assert_eq!(bytes.len(), 128 + 24);
    }
}
