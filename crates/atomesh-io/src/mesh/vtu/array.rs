//! The numbers of a DataArray, however they are encoded.
//!
//! Binary data begin with a header in the file's header type: their length, or, compressed, the number and
//! lengths of their blocks. Base64 may hold header and data as one text or as two. Memory is allocated only
//! once the bytes that ask for it were found.

use std::borrow::Cow;

use rayon::prelude::*;

use super::super::column::{Endian, Number};
use super::super::read_error::{MeshReadError, excerpt, malformed};
use super::compressor::Compressor;

/// How the binary arrays of a file are laid out.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Layout {
    pub endian: Endian,
    /// Whether the words of headers have 8 bytes, not 4.
    pub wide_header: bool,
    /// What blocks are compressed by, if they are.
    pub compressor: Option<Compressor>,
}

/// Where the text or the bytes of an array begin.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Place {
    /// Decimal numbers up to the next tag.
    Text(usize),
    /// base64 up to the next tag or other encoded array.
    Base64(usize),
    /// Bytes.
    Raw(usize),
}

/// An array before its numbers are read.
#[derive(Clone, Debug)]
pub(crate) struct Array<'a> {
    pub file: &'a [u8],
    pub layout: Layout,
    pub place: Place,
    /// VTK's name of the type: Float64, Int32 ...
    pub kind: &'a str,
    pub name: &'a str,
    pub components: usize,
    /// How many tuples of components the tag says there are; only field data say it.
    pub tuples: Option<usize>,
}

/// Runs an expression with `T` bound to the Rust type that VTK names.
macro_rules! with_type {
    ($array:expr, $T:ident => $body:expr) => {
        match $array.kind {
            "Int8" => {
                type $T = i8;
                $body
            }
            "UInt8" => {
                type $T = u8;
                $body
            }
            "Int16" => {
                type $T = i16;
                $body
            }
            "UInt16" => {
                type $T = u16;
                $body
            }
            "Int32" => {
                type $T = i32;
                $body
            }
            "UInt32" => {
                type $T = u32;
                $body
            }
            "Int64" => {
                type $T = i64;
                $body
            }
            "UInt64" => {
                type $T = u64;
                $body
            }
            "Float32" => {
                type $T = f32;
                $body
            }
            "Float64" => {
                type $T = f64;
                $body
            }
            _ => Err(MeshReadError::Unsupported {
                what: "array type",
                found: $array.kind.into(),
                expected: "Int8 ... UInt64, Float32 or Float64",
            }),
        }
    };
}

impl Array<'_> {
    /// Exactly `count` numbers as reals.
    pub fn reals(&self, count: usize) -> Result<Vec<f64>, MeshReadError> {
        if let Place::Text(at) = self.place {
            return self.parse(at, count);
        }
        with_type!(self, T => self.numbers::<T, _>(count, |v| Some(v.real())))
    }

    /// Exactly `count` numbers as indices.
    pub fn indices(&self, count: usize) -> Result<Vec<u32>, MeshReadError> {
        if let Place::Text(at) = self.place {
            return self.parse(at, count);
        }
        with_type!(self, T => self.numbers::<T, _>(count, T::index))
    }

    /// All numbers as bytes, as strings are kept.
    pub fn string(&self) -> Result<Vec<u8>, MeshReadError> {
        match self.place {
            Place::Text(at) => Ok(words(self.text(at)).filter_map(|w| w.parse().ok()).collect()),
            _ => self.bytes(None).map(Cow::into_owned),
        }
    }

    /// Whether the numbers are integers that 32 bits with a sign hold.
    pub fn is_integer(&self) -> bool {
        matches!(self.kind, "Int8" | "UInt8" | "Int16" | "UInt16" | "Int32" | "Int64")
    }

    fn start(&self) -> usize {
        match self.place {
            Place::Text(at) | Place::Base64(at) | Place::Raw(at) => at,
        }
    }

    fn wrong(&self, expected: impl Into<String>, found: impl Into<String>) -> MeshReadError {
        malformed(self.start(), format!("{} in array {:?}", expected.into(), self.name), found)
    }

    pub fn text(&self, at: usize) -> &str {
        let rest = self.file.get(at..).unwrap_or_default();
        let end = rest.iter().position(|&b| b == b'<').unwrap_or(rest.len());
        // numbers are ASCII: what comes after anything else is missed as missing numbers
        match std::str::from_utf8(&rest[..end]) {
            Ok(text) => text,
            Err(e) => std::str::from_utf8(&rest[..e.valid_up_to()]).unwrap_or_default(),
        }
    }

    fn parse<T: std::str::FromStr>(
        &self,
        at: usize,
        count: usize,
    ) -> Result<Vec<T>, MeshReadError> {
        let mut values = Vec::new();
        for word in words(self.text(at)) {
            if values.len() == count {
                return Err(self.wrong(format!("{count} numbers"), "more"));
            }
            values.push(word.parse().map_err(|_| self.wrong("a number in range", word))?);
        }
        match values.len() {
            found if found == count => Ok(values),
            found => Err(self.wrong(format!("{count} numbers"), found.to_string())),
        }
    }

    fn numbers<T: Number + std::fmt::Display, U>(
        &self,
        count: usize,
        convert: impl Fn(T) -> Option<U>,
    ) -> Result<Vec<U>, MeshReadError> {
        let size = count.checked_mul(T::SIZE).ok_or_else(|| self.too_long(count))?;
        let bytes = self.bytes(Some(size))?;
        let number = |b: &[u8]| {
            let value = T::take(b, self.layout.endian);
            convert(value).ok_or_else(|| self.wrong("an index below 2^32", value.to_string()))
        };
        bytes.chunks_exact(T::SIZE).map(number).collect()
    }

    /// The bytes of a binary array without its header; `size` of them, if that is known.
    pub fn bytes(&self, size: Option<usize>) -> Result<Cow<'_, [u8]>, MeshReadError> {
        match self.layout.compressor {
            Some(compressor) => self.decompress(compressor, size).map(Cow::Owned),
            None => self.uncompressed(size),
        }
    }

    fn check_size(&self, found: usize, size: Option<usize>) -> Result<(), MeshReadError> {
        match size {
            Some(size) if size != found => {
                Err(self.wrong(format!("{size} bytes of {}", self.kind), found.to_string()))
            }
            _ => Ok(()),
        }
    }

    fn uncompressed(&self, size: Option<usize>) -> Result<Cow<'_, [u8]>, MeshReadError> {
        let word = self.word_size();
        let length = self.words(1)?[0];
        self.check_size(length, size)?;
        let stream = self.stream(length.checked_add(word).ok_or_else(|| self.too_long(length))?)?;
        Ok(match stream {
            Cow::Borrowed(stream) => Cow::Borrowed(&stream[word..]),
            Cow::Owned(mut stream) => {
                stream.drain(..word);
                Cow::Owned(stream)
            }
        })
    }

    fn decompress(
        &self,
        compressor: Compressor,
        size: Option<usize>,
    ) -> Result<Vec<u8>, MeshReadError> {
        let word = self.word_size();
        let count = self.words(1)?[0];
        if count == 0 {
            self.check_size(0, size)?;
            return Ok(vec![]);
        }
        let header = count.checked_add(3).ok_or_else(|| self.too_long(count))?;
        let words = self.words(header)?;
        let (block, last, packed) = (words[1], words[2], &words[3..]);
        let last = if last > 0 { last } else { block };
        let whole = block.checked_mul(count - 1).and_then(|n| n.checked_add(last));
        self.check_size(whole.ok_or_else(|| self.too_long(block))?, size)?;
        let total = packed.iter().try_fold(header * word, |sum, &p| sum.checked_add(p));
        let stream = self.stream(total.ok_or_else(|| self.too_long(count))?)?;
        let mut at = header * word;
        let mut blocks = Vec::with_capacity(count);
        for (i, &length) in packed.iter().enumerate() {
            let size = if i + 1 == count { last } else { block };
            blocks.push((&stream[at..at + length], size));
            at += length;
        }
        let blocks: Result<Vec<Vec<u8>>, MeshReadError> =
            blocks.par_iter().map(|(packed, size)| self.block(compressor, packed, *size)).collect();
        Ok(blocks?.concat())
    }

    /// A block of exactly `size` bytes.
    fn block(
        &self,
        compressor: Compressor,
        packed: &[u8],
        size: usize,
    ) -> Result<Vec<u8>, MeshReadError> {
        match compressor.unpack(packed, size) {
            Ok(out) if out.len() == size => Ok(out),
            Ok(out) => {
                Err(self
                    .wrong(format!("a block of {size} bytes"), format!("{} or more", out.len())))
            }
            Err(e) => Err(self.wrong(format!("a block of {compressor}"), e)),
        }
    }

    fn word_size(&self) -> usize {
        if self.layout.wide_header { 8 } else { 4 }
    }

    /// The first `count` words of the header.
    fn words(&self, count: usize) -> Result<Vec<usize>, MeshReadError> {
        let word = self.word_size();
        let stream = self.stream(count.checked_mul(word).ok_or_else(|| self.too_long(count))?)?;
        let value = |b: &[u8]| match self.layout.wide_header {
            true => u64::take(b, self.layout.endian),
            false => u32::take(b, self.layout.endian).into(),
        };
        stream
            .chunks_exact(word)
            .map(|b| usize::try_from(value(b)).map_err(|_| self.too_long(usize::MAX)))
            .collect()
    }

    fn too_long(&self, length: usize) -> MeshReadError {
        self.wrong("a length that fits the file", length.to_string())
    }

    /// The first `length` bytes of the array, header included.
    fn stream(&self, length: usize) -> Result<Cow<'_, [u8]>, MeshReadError> {
        let rest = self.file.get(self.start()..).unwrap_or_default();
        let stream: Cow<[u8]> = match self.place {
            _ if length > rest.len() => return Err(self.too_long(length)),
            Place::Raw(_) => Cow::Borrowed(&rest[..length]),
            _ => Cow::Owned(decode_base64(rest, length)),
        };
        if stream.len() < length {
            let found = format!("{} and then {}", stream.len(), excerpt(rest, 0));
            return Err(self.wrong(format!("{length} bytes in base64"), found));
        }
        Ok(stream)
    }
}

fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split_ascii_whitespace()
}

/// The first `length` bytes of a base64 text, fewer if it ends before. White space is passed over;
/// padding ends a group of four letters, not the text, since headers are often encoded by themselves.
fn decode_base64(text: &[u8], length: usize) -> Vec<u8> {
    let mut out = Vec::with_capacity(length + 3);
    let (mut bits, mut letters, mut padding) = (0u32, 0, 0);
    for &letter in text {
        let value = match letter {
            b'A'..=b'Z' => letter - b'A',
            b'a'..=b'z' => letter - b'a' + 26,
            b'0'..=b'9' => letter - b'0' + 52,
            b'+' => 62,
            b'/' => 63,
            b'=' => {
                padding += 1;
                0
            }
            b if b.is_ascii_whitespace() => continue,
            _ => break,
        };
        bits = bits << 6 | u32::from(value);
        letters += 1;
        if letters == 4 {
            let bytes = bits.to_be_bytes();
            out.extend_from_slice(&bytes[1..4 - padding.min(2)]);
            (bits, letters, padding) = (0, 0, 0);
            if out.len() >= length {
                break;
            }
        }
    }
    out.truncate(length);
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_goes_on_after_padding_and_stops_at_the_tag() {
        // "ab" and "cde" encoded one by one, with a line break inside
        assert_eq!(decode_base64(b"YWI=\nY2Rl</Data>", 9), b"abcde");
        assert_eq!(decode_base64(b"YQ==YQ==", 2), b"aa");
        assert_eq!(decode_base64(b"Y2Rl", 2), b"cd");
        assert_eq!(decode_base64(b"Y2R", 3), b"");
    }
}
