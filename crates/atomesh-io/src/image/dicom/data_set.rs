//! The elements of a DICOM file that an image needs, and where its pixel data are.
//!
//! Definition: PS3.5 (data structures and encoding) and PS3.10 (file format). Explicit and implicit
//! value representations are read, in either byte order. All other elements are skipped without being held,
//! sequences with their nested items too.

use std::io::{BufReader, ErrorKind, Read, Seek, SeekFrom};

use super::super::affine::wrong;
use super::super::error::ReadReason;
use super::super::sample_type::ByteOrder;
use super::FORMAT;

/// The longest value that is held; the wanted ones are short.
const LONGEST_VALUE: u32 = 1 << 12;

/// How deep sequences may be nested.
const DEEPEST: usize = 32;

/// The length that stands for "until a delimiter comes".
const UNDEFINED: u32 = u32::MAX;

/// Tags as group and element in one number.
pub(super) mod tag {
    pub const TRANSFER_SYNTAX: u32 = 0x0002_0010;
    pub const SERIES: u32 = 0x0020_000e;
    pub const IMAGER_SPACING: u32 = 0x0018_1164;
    pub const INSTANCE: u32 = 0x0020_0013;
    pub const POSITION: u32 = 0x0020_0032;
    pub const ORIENTATION: u32 = 0x0020_0037;
    pub const SAMPLES_PER_PIXEL: u32 = 0x0028_0002;
    pub const PHOTOMETRIC: u32 = 0x0028_0004;
    pub const FRAME_COUNT: u32 = 0x0028_0008;
    pub const ROWS: u32 = 0x0028_0010;
    pub const COLUMNS: u32 = 0x0028_0011;
    pub const PIXEL_SPACING: u32 = 0x0028_0030;
    pub const BITS_ALLOCATED: u32 = 0x0028_0100;
    pub const BITS_STORED: u32 = 0x0028_0101;
    pub const HIGH_BIT: u32 = 0x0028_0102;
    pub const IS_SIGNED: u32 = 0x0028_0103;
    pub const INTERCEPT: u32 = 0x0028_1052;
    pub const SLOPE: u32 = 0x0028_1053;
    pub const MODALITY_TABLE: u32 = 0x0028_3000;
    pub const PIXELS: u32 = 0x7fe0_0010;
    pub const ITEM: u32 = 0xfffe_e000;
    pub const ITEM_END: u32 = 0xfffe_e00d;
    pub const SEQUENCE_END: u32 = 0xfffe_e0dd;

    /// The elements that are kept.
    pub const WANTED: [u32; 19] = [
        TRANSFER_SYNTAX,
        IMAGER_SPACING,
        SERIES,
        INSTANCE,
        POSITION,
        ORIENTATION,
        SAMPLES_PER_PIXEL,
        PHOTOMETRIC,
        FRAME_COUNT,
        ROWS,
        COLUMNS,
        PIXEL_SPACING,
        BITS_ALLOCATED,
        BITS_STORED,
        HIGH_BIT,
        IS_SIGNED,
        INTERCEPT,
        SLOPE,
        MODALITY_TABLE,
    ];
}

/// The kept elements of a file.
pub(super) struct DataSet {
    elements: Vec<(u32, Vec<u8>)>,
    pub byte_order: ByteOrder,
    pub pixels: Option<PixelData>,
}

/// Where pixel data are in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct PixelData {
    /// Their first byte.
    pub start: u64,
    /// Their number of bytes; none if they are packed in fragments.
    pub length: Option<u32>,
}

impl DataSet {
    /// The value of an element, if it is there and not empty.
    pub fn get(&self, tag: u32) -> Option<&[u8]> {
        let found = self.elements.iter().find(|(t, _)| *t == tag);
        found.map(|(_, value)| value.as_slice()).filter(|value| !value.is_empty())
    }

    /// The value of a text.
    pub fn text(&self, tag: u32) -> Option<String> {
        let text = String::from_utf8_lossy(self.get(tag)?);
        Some(text.trim_matches(|c: char| c.is_whitespace() || c == '\0').to_owned())
    }

    /// The decimal numbers of a text.
    pub fn decimals<const N: usize>(
        &self,
        tag: u32,
        name: &'static str,
    ) -> Result<Option<[f64; N]>, ReadReason> {
        let Some(text) = self.text(tag) else { return Ok(None) };
        let numbers: Option<Vec<f64>> = text.split('\\').map(|w| w.trim().parse().ok()).collect();
        let numbers = numbers.filter(|all| all.iter().all(|x| x.is_finite()));
        let array = numbers.and_then(|all| all.try_into().ok());
        let expected = match N {
            1 => "a number",
            2 => "two numbers",
            3 => "three numbers",
            _ => "six numbers",
        };
        array.map(Some).ok_or_else(|| wrong(FORMAT, name, text, expected))
    }

    /// The value of an unsigned 16-bit integer.
    pub fn short(&self, tag: u32) -> Option<u16> {
        let bytes = self.get(tag)?.first_chunk::<2>()?;
        Some(match self.byte_order {
            ByteOrder::Little => u16::from_le_bytes(*bytes),
            ByteOrder::Big => u16::from_be_bytes(*bytes),
        })
    }
}

/// Whether a file begins as DICOM files do, with 128 bytes of anything and a magic word.
pub(super) fn is_dicom(source: &mut dyn Read) -> bool {
    let mut head = [0; 132];
    source.read_exact(&mut head).is_ok() && head.ends_with(b"DICM")
}

/// Takes the elements of a file one by one.
pub(super) struct Reader<R> {
    source: BufReader<R>,
    at: u64,
    pub file_bytes: u64,
    byte_order: ByteOrder,
    is_explicit: bool,
}

/// What stands before the value of an element.
struct Head {
    tag: u32,
    /// The value representation, two blanks where it is implicit.
    kind: [u8; 2],
    length: u32,
}

impl<R: Read + Seek> Reader<R> {
    /// A file from its beginning.
    pub fn new(source: R, file_bytes: u64) -> Self {
        let source = BufReader::with_capacity(1 << 13, source);
        Self { source, at: 0, file_bytes, byte_order: ByteOrder::Little, is_explicit: true }
    }

    /// Reads up to the pixel data, or the end of a file that has none.
    pub fn read(&mut self) -> Result<DataSet, ReadReason> {
        let start = self.take::<132>()?;
        if !start.ends_with(b"DICM") {
            return Err(ReadReason::Magic { format: FORMAT, found: start[..8].into(), like: None });
        }
        let mut set = DataSet { elements: Vec::new(), byte_order: ByteOrder::Little, pixels: None };
        let mut is_meta = true;
        while self.at < self.file_bytes {
            if is_meta && !self.peeks_meta()? {
                is_meta = false;
                self.use_syntax(set.text(tag::TRANSFER_SYNTAX).as_deref().unwrap_or_default())?;
                set.byte_order = self.byte_order;
            }
            let head = self.head()?;
            if head.tag == tag::PIXELS {
                let length = Some(head.length).filter(|&length| length != UNDEFINED);
                set.pixels = Some(PixelData { start: self.at, length });
                break;
            }
            if head.length != UNDEFINED && tag::WANTED.contains(&head.tag) && &head.kind != b"SQ" {
                let value = self.value(head.length)?;
                set.elements.push((head.tag, value));
                continue;
            }
            if head.tag == tag::MODALITY_TABLE {
                set.elements.push((head.tag, vec![1]));
            }
            self.skip_value(&head, 0)?;
        }
        Ok(set)
    }

    /// Whether the next element is of group 2, which is always explicit, least byte first.
    fn peeks_meta(&mut self) -> Result<bool, ReadReason> {
        let mut group = [0; 2];
        self.source.read_exact(&mut group).map_err(Self::cut)?;
        self.source.seek_relative(-2).map_err(ReadReason::Io)?;
        Ok(group == [2, 0])
    }

    /// Goes on in the encoding of a transfer syntax. How pixel data are packed is looked at later.
    fn use_syntax(&mut self, syntax: &str) -> Result<(), ReadReason> {
        match syntax {
            "1.2.840.10008.1.2" => self.is_explicit = false,
            "1.2.840.10008.1.2.2" => self.byte_order = ByteOrder::Big,
            "1.2.840.10008.1.2.1.99" => {
                return Err(ReadReason::Unsupported {
                    format: FORMAT,
                    found: "a deflated data set".into(),
                    expected: "a plain one: unpack it first, as by dcmconv +te",
                });
            }
            _ => {} // all others are explicit, least byte first
        }
        Ok(())
    }

    fn cut(error: std::io::Error) -> ReadReason {
        match error.kind() {
            ErrorKind::UnexpectedEof => wrong(FORMAT, "file", "cut short", "whole elements"),
            _ => ReadReason::Io(error),
        }
    }

    fn take<const N: usize>(&mut self) -> Result<[u8; N], ReadReason> {
        let mut bytes = [0; N];
        self.source.read_exact(&mut bytes).map_err(Self::cut)?;
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

    fn u32(&mut self) -> Result<u32, ReadReason> {
        let bytes = self.take()?;
        Ok(match self.byte_order {
            ByteOrder::Little => u32::from_le_bytes(bytes),
            ByteOrder::Big => u32::from_be_bytes(bytes),
        })
    }

    fn tag(&mut self) -> Result<u32, ReadReason> {
        Ok(u32::from(self.u16()?) << 16 | u32::from(self.u16()?))
    }

    fn head(&mut self) -> Result<Head, ReadReason> {
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
    fn value(&mut self, length: u32) -> Result<Vec<u8>, ReadReason> {
        if length > LONGEST_VALUE {
            let found = format!("{length} bytes");
            return Err(wrong(FORMAT, "length of an element", found, "at most 4096 here"));
        }
        let mut value = vec![0; length as usize];
        self.source.read_exact(&mut value).map_err(Self::cut)?;
        self.at += u64::from(length);
        Ok(value)
    }

    fn skip(&mut self, length: u32) -> Result<(), ReadReason> {
        if self.file_bytes.saturating_sub(self.at) < length.into() {
            return Err(Self::cut(ErrorKind::UnexpectedEof.into()));
        }
        self.source.seek_relative(length.into()).map_err(ReadReason::Io)?;
        self.at += u64::from(length);
        Ok(())
    }

    /// Skips a value; one without a length is a sequence of items.
    fn skip_value(&mut self, head: &Head, depth: usize) -> Result<(), ReadReason> {
        if head.length != UNDEFINED {
            return self.skip(head.length);
        }
        if depth == DEEPEST {
            return Err(wrong(FORMAT, "sequences", "nested deeper", "at most 32 levels"));
        }
        // what is unknown to the writer stays implicit inside
        let is_explicit = self.is_explicit;
        self.is_explicit &= &head.kind != b"UN";
        loop {
            let tag = self.tag()?;
            let length = self.u32()?;
            match tag {
                tag::SEQUENCE_END => break,
                tag::ITEM if length != UNDEFINED => self.skip(length)?,
                tag::ITEM => self.skip_item(depth)?,
                _ => {
                    let value = format!("({:04x},{:04x})", tag >> 16, tag & 0xffff);
                    return Err(wrong(FORMAT, "sequence", value, "items and an end"));
                }
            }
        }
        self.is_explicit = is_explicit;
        Ok(())
    }

    /// Skips the elements of an item up to its end.
    fn skip_item(&mut self, depth: usize) -> Result<(), ReadReason> {
        loop {
            let head = self.head()?;
            if head.tag == tag::ITEM_END {
                return Ok(());
            }
            self.skip_value(&head, depth + 1)?;
        }
    }

    /// `length` bytes of pixel data from a place of the file.
    pub fn pixel_bytes(&mut self, start: u64, length: u64) -> Result<Vec<u8>, ReadReason> {
        if self.file_bytes.saturating_sub(start) < length {
            return Err(Self::cut(ErrorKind::UnexpectedEof.into()));
        }
        let mut bytes = Vec::new();
        let room = usize::try_from(length).unwrap_or(usize::MAX);
        let memory = |_| ReadReason::Memory { bytes: length.into(), limit: None };
        bytes.try_reserve_exact(room).map_err(memory)?;
        self.source.seek(SeekFrom::Start(start)).map_err(ReadReason::Io)?;
        (&mut self.source).take(length).read_to_end(&mut bytes).map_err(ReadReason::Io)?;
        self.at = start + length;
        Ok(bytes)
    }

    /// The packed fragments of pixel data from a place of the file, one after another, without the
    /// table of offsets that comes first.
    pub fn fragments(&mut self, start: u64) -> Result<Vec<u8>, ReadReason> {
        self.source.seek(SeekFrom::Start(start)).map_err(ReadReason::Io)?;
        self.at = start;
        self.byte_order = ByteOrder::Little;
        let mut bytes = Vec::new();
        let mut is_table = true;
        loop {
            let tag = self.tag()?;
            let length = self.u32()?;
            match tag {
                tag::SEQUENCE_END => return Ok(bytes),
                tag::ITEM if std::mem::take(&mut is_table) => self.skip(length)?,
                tag::ITEM => {
                    let at = self.at;
                    bytes.extend(self.pixel_bytes(at, length.into())?);
                }
                _ => {
                    return Err(wrong(FORMAT, "pixel data", "no fragment", "fragments and an end"));
                }
            }
        }
    }
}
