//! The bytes of a DICOM file as heads of elements and values.
//!
//! Definition: PS3.5 (data structures and encoding) and PS3.10 (file format). Explicit and implicit value
//! representations are read, in either byte order, and deflated data sets. No length that a file states is believed before
//! the file's size allows it, and no value is held that is not asked for.

use std::io::{BufRead, BufReader, ErrorKind, Read, Seek, SeekFrom};

use super::super::affine::wrong;
use super::super::error::ReadReason;
use super::super::memory::Memory;
use super::super::sample_type::ByteOrder;
use super::super::stream::GZIP_RATIO;
use super::FORMAT;
use super::source::{Bytes, Inflated};
use super::tag;

/// The length that stands for "until a delimiter comes".
pub(super) const UNDEFINED: u32 = u32::MAX;

/// The most bytes that are inflated before the pixel data come.
const MOST_INFLATED: u64 = 1 << 28;

/// The transfer syntax whose data set is deflated.
const DEFLATED: &str = "1.2.840.10008.1.2.1.99";

/// Whether a file begins as DICOM files do: with 128 bytes of anything and a magic word, or, if these were left out,
/// with an element that comes first.
pub(super) fn is_dicom(source: &mut dyn Read) -> bool {
    let mut head = Vec::new();
    let is_read = source.take(132).read_to_end(&mut head).is_ok();
    is_read && (head.len() == 132 && head.ends_with(b"DICM") || begins_bare(&head))
}

/// Whether bytes begin with an element of the groups 2 or 8, as files do whose preamble was left out.
pub(super) fn begins_bare(head: &[u8]) -> bool {
    match *head {
        [2 | 8, 0, _, 0, a, b, ..] if is_kind([a, b]) => true,
        [8, 0, _, 0, length, 0, 0, 0, ..] => length < 64,
        _ => false,
    }
}

/// Whether two bytes are the value representation of an element that may come first.
fn is_kind(bytes: [u8; 2]) -> bool {
    [b"UL", b"OB", b"CS", b"UI", b"DA", b"TM", b"LO", b"SH", b"DT"].contains(&&bytes)
}

/// Takes the elements of a file one by one.
pub(super) struct Reader<R> {
    source: BufReader<Bytes<R>>,
    pub at: u64,
    /// The size of the file; of an inflated one the most that it can be.
    pub file_bytes: u64,
    pub byte_order: ByteOrder,
    pub is_explicit: bool,
    /// Whether the preamble and the magic word are missing.
    pub is_bare: bool,
    /// How far the head may go on.
    farthest: u64,
}

/// What stands before the value of an element.
pub(super) struct Head {
    pub tag: u32,
    /// The value representation, two blanks where it is implicit.
    pub kind: [u8; 2],
    pub length: u32,
}

impl<R> Reader<R> {
    /// Where what is deflated begins.
    pub fn deflated_from(&self) -> Option<u64> {
        match self.source.get_ref() {
            Bytes::Inflated(inflated) => Some(inflated.start),
            _ => None,
        }
    }
}

impl<R: Read + Seek> Reader<R> {
    /// A file from its beginning.
    pub fn new(source: R, file_bytes: u64) -> Self {
        let source = BufReader::with_capacity(1 << 13, Bytes::Plain(source));
        Self {
            source,
            at: 0,
            file_bytes,
            byte_order: ByteOrder::Little,
            is_explicit: true,
            is_bare: false,
            farthest: u64::MAX,
        }
    }

    /// Goes past the preamble and the magic word, if they are there.
    pub fn start(&mut self) -> Result<(), ReadReason> {
        let head = self.source.fill_buf().map_err(cut)?;
        if head.get(128..132) == Some(b"DICM") {
            self.take::<132>()?;
            return Ok(());
        }
        let found: Vec<u8> = head.iter().take(8).copied().collect();
        if begins_bare(&found) {
            self.is_bare = true;
            return Ok(());
        }
        if self.file_bytes < 132 {
            return Err(cut(ErrorKind::UnexpectedEof.into()));
        }
        Err(ReadReason::Magic { format: FORMAT, found, like: None })
    }

    /// Whether there are no more bytes.
    pub fn is_at_end(&mut self) -> Result<bool, ReadReason> {
        Ok(self.at >= self.file_bytes
            || self.deflated_from().is_some() && self.source.fill_buf().map_err(cut)?.is_empty())
    }

    /// Whether the next element is of group 2, which is always explicit, least byte first.
    pub fn peeks_meta(&mut self) -> Result<bool, ReadReason> {
        let mut group = [0; 2];
        self.source.read_exact(&mut group).map_err(cut)?;
        self.source.seek_relative(-2).map_err(cut)?;
        Ok(group == [2, 0])
    }

    /// Goes on in the encoding of a transfer syntax; without one, in what the next element looks like. How pixel data are
    /// packed is looked at later.
    pub fn use_syntax(&mut self, syntax: Option<&str>) -> Result<(), ReadReason> {
        match syntax {
            None | Some("") => {
                let mut head = [0; 6];
                self.source.read_exact(&mut head).map_err(cut)?;
                self.source.seek_relative(-6).map_err(cut)?;
                self.is_explicit = head[4..].iter().all(u8::is_ascii_uppercase);
            }
            Some("1.2.840.10008.1.2") => self.is_explicit = false,
            Some("1.2.840.10008.1.2.2") => self.byte_order = ByteOrder::Big,
            Some(DEFLATED) => self.inflate_from(self.at)?,
            _ => {} // all others are explicit, least byte first
        }
        Ok(())
    }

    /// Goes on with what is deflated from a place of the file on.
    pub fn inflate_from(&mut self, start: u64) -> Result<(), ReadReason> {
        let source = std::mem::replace(self.source.get_mut(), Bytes::Gone);
        let Bytes::Plain(source) = source else { return Ok(()) };
        let source = Bytes::Inflated(Inflated::new(source, start).map_err(cut)?);
        self.source = BufReader::with_capacity(1 << 13, source);
        let packed = self.file_bytes.saturating_sub(start);
        self.at = start;
        self.file_bytes = start.saturating_add(packed.saturating_mul(GZIP_RATIO));
        self.farthest = start + MOST_INFLATED;
        Ok(())
    }

    fn take<const N: usize>(&mut self) -> Result<[u8; N], ReadReason> {
        let mut bytes = [0; N];
        self.source.read_exact(&mut bytes).map_err(cut)?;
        self.at += N as u64;
        Ok(bytes)
    }

    fn u16(&mut self) -> Result<u16, ReadReason> {
        let bytes = self.take()?;
        Ok(match self.byte_order {
            ByteOrder::Little => u16::from_le_bytes(bytes),
            ByteOrder::Big => u16::from_be_bytes(bytes),
        })
    }

    pub fn u32(&mut self) -> Result<u32, ReadReason> {
        let bytes = self.take()?;
        Ok(match self.byte_order {
            ByteOrder::Little => u32::from_le_bytes(bytes),
            ByteOrder::Big => u32::from_be_bytes(bytes),
        })
    }

    pub fn tag(&mut self) -> Result<u32, ReadReason> {
        Ok(u32::from(self.u16()?) << 16 | u32::from(self.u16()?))
    }

    pub fn head(&mut self) -> Result<Head, ReadReason> {
        let tag = self.tag()?;
        // items and delimiters have no representation
        if !self.is_explicit || tag >> 16 == 0xfffe {
            return Ok(Head { tag, kind: *b"  ", length: self.u32()? });
        }
        let kind = self.take::<2>()?;
        let length = match &kind {
            b"OB" | b"OD" | b"OF" | b"OL" | b"OV" | b"OW" | b"SQ" | b"SV" | b"UC" | b"UN"
            | b"UR" | b"UT" | b"UV" => {
                self.u16()?; // reserved
                self.u32()?
            }
            [b'A'..=b'Z', b'A'..=b'Z'] => self.u16()?.into(),
            _ => {
                let value = format!("\"{}\"", kind.escape_ascii());
                return Err(wrong(FORMAT, "value representation", value, "two letters"));
            }
        };
        Ok(Head { tag, kind, length })
    }

    /// The value of an element that is kept.
    pub fn value(&mut self, length: u32) -> Result<Vec<u8>, ReadReason> {
        self.check_room(length.into())?;
        let mut value = vec![0; length as usize];
        self.source.read_exact(&mut value).map_err(cut)?;
        self.at += u64::from(length);
        Ok(value)
    }

    pub fn skip(&mut self, length: u32) -> Result<(), ReadReason> {
        self.check_room(length.into())?;
        self.source.seek_relative(length.into()).map_err(cut)?;
        self.at += u64::from(length);
        Ok(())
    }

    fn check_room(&self, length: u64) -> Result<(), ReadReason> {
        if self.file_bytes.saturating_sub(self.at) < length {
            return Err(cut(ErrorKind::UnexpectedEof.into()));
        }
        if self.at.saturating_add(length) > self.farthest {
            let found = "deflated elements of more than 256 MiB before the pixel data";
            let expected = "less: inflate the file first, as by dcmconv +te";
            return Err(ReadReason::Unsupported { format: FORMAT, found: found.into(), expected });
        }
        Ok(())
    }

    /// `length` bytes of pixel data from a place of the file.
    pub fn pixel_bytes(
        &mut self,
        start: u64,
        length: u64,
        memory: Memory,
    ) -> Result<Vec<u8>, ReadReason> {
        if self.file_bytes.saturating_sub(start) < length {
            return Err(cut(ErrorKind::UnexpectedEof.into()));
        }
        let mut bytes = Vec::new();
        memory.reserve(&mut bytes, usize::try_from(length).unwrap_or(usize::MAX))?;
        self.go_to(start)?;
        (&mut self.source).take(length).read_to_end(&mut bytes).map_err(cut)?;
        if (bytes.len() as u64) < length {
            return Err(cut(ErrorKind::UnexpectedEof.into()));
        }
        self.at = start + length;
        Ok(bytes)
    }

    fn go_to(&mut self, start: u64) -> Result<(), ReadReason> {
        self.source.seek(SeekFrom::Start(start)).map_err(cut)?;
        self.at = start;
        Ok(())
    }

    /// Where the fragments of pixel data are that begin at a place of the file, each with its length. The first is the
    /// table of offsets.
    pub fn fragments(&mut self, start: u64) -> Result<Vec<(u64, u32)>, ReadReason> {
        self.go_to(start)?;
        (self.byte_order, self.farthest) = (ByteOrder::Little, u64::MAX);
        let mut fragments = Vec::new();
        while self.at < self.file_bytes {
            let (tag, length) = (self.tag()?, self.u32()?);
            match tag {
                tag::SEQUENCE_END => return Ok(fragments),
                tag::ITEM => {
                    fragments.push((self.at, length));
                    self.skip(length)?;
                }
                _ => {
                    return Err(wrong(FORMAT, "pixel data", "no fragment", "fragments and an end"));
                }
            }
        }
        Err(cut(ErrorKind::UnexpectedEof.into()))
    }
}

fn cut(error: std::io::Error) -> ReadReason {
    match error.kind() {
        ErrorKind::UnexpectedEof => wrong(FORMAT, "file", "cut short", "whole elements"),
        // of what is deflated
        ErrorKind::InvalidInput | ErrorKind::InvalidData => ReadReason::decoder(FORMAT, error),
        _ => ReadReason::Io(error),
    }
}
