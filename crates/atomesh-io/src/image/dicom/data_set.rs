//! The elements of a DICOM file that an image needs, and where its pixel data are.

use std::io::{Read, Seek};

use super::super::affine::wrong;
use super::super::error::ReadReason;
use super::super::sample_type::ByteOrder;
use super::FORMAT;
use super::reader::{Head, Reader, UNDEFINED};
use super::tag;

/// The longest value that is held; the wanted ones are short, but for these.
const LONGEST_VALUE: u32 = 1 << 12;

/// The same of look-up tables and offsets of frames.
const LONGEST_LIST: u32 = 1 << 18;

/// The most bytes of values, and items of sequences, that are held of a file.
const MOST_BYTES: u64 = 1 << 26;
const MOST_ITEMS: usize = 1 << 20;

/// How deep sequences may be nested.
const DEEPEST: usize = 32;

/// The kept elements of a file, or of an item.
#[derive(Debug, Default)]
pub(super) struct DataSet {
    elements: Vec<(u32, Value)>,
    byte_order: ByteOrder,
}

#[derive(Debug)]
enum Value {
    Bytes(Vec<u8>),
    Items(Vec<DataSet>),
}

/// What a file holds.
pub(super) struct Content {
    pub set: DataSet,
    pub pixels: Option<PixelData>,
    /// The byte order of the pixel data.
    pub byte_order: ByteOrder,
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
        self.elements.iter().find_map(|(found, value)| match value {
            Value::Bytes(bytes) if *found == tag && !bytes.is_empty() => Some(bytes.as_slice()),
            _ => None,
        })
    }

    /// Whether an element is there, empty or not.
    pub fn has(&self, tag: u32) -> bool {
        self.elements.iter().any(|(found, _)| *found == tag)
    }

    /// The items of a sequence; none if it is not there.
    pub fn items(&self, tag: u32) -> &[Self] {
        let found = self.elements.iter().find_map(|(found, value)| match value {
            Value::Items(items) if *found == tag => Some(items.as_slice()),
            _ => None,
        });
        found.unwrap_or_default()
    }

    /// The value of a text.
    pub fn text(&self, tag: u32) -> Option<String> {
        let text = String::from_utf8_lossy(self.get(tag)?);
        Some(text.trim_matches(|c: char| c.is_whitespace() || c == '\0').to_owned())
    }

    /// The decimal numbers of a text, however many they are.
    pub fn list(&self, tag: u32, name: &'static str) -> Result<Option<Vec<f64>>, ReadReason> {
        let Some(text) = self.text(tag) else { return Ok(None) };
        let numbers: Option<Vec<f64>> = text.split('\\').map(|w| w.trim().parse().ok()).collect();
        let numbers = numbers.filter(|all| all.iter().all(|x| x.is_finite()));
        let found = || text.chars().take(80).collect::<String>();
        numbers.map(Some).ok_or_else(|| wrong(FORMAT, name, found(), "finite numbers"))
    }

    /// The decimal numbers of a text.
    pub fn decimals<const N: usize>(
        &self,
        tag: u32,
        name: &'static str,
    ) -> Result<Option<[f64; N]>, ReadReason> {
        let expected = match N {
            1 => "a number",
            2 => "two numbers",
            3 => "three numbers",
            _ => "six numbers",
        };
        let Some(text) = self.text(tag).filter(|text| !text.is_empty()) else { return Ok(None) };
        let numbers = self.list(tag, name).ok().flatten();
        let array = numbers.and_then(|all| all.try_into().ok());
        array.map(Some).ok_or_else(|| wrong(FORMAT, name, text, expected))
    }

    /// The value of an unsigned 16-bit integer.
    pub fn short(&self, tag: u32) -> Option<u16> {
        self.shorts(tag)?.next()
    }

    /// The values of unsigned 16-bit integers.
    pub fn shorts(&self, tag: u32) -> Option<impl Iterator<Item = u16>> {
        let words = self.get(tag)?.as_chunks::<2>().0;
        Some(words.iter().map(|bytes| match self.byte_order {
            ByteOrder::Little => u16::from_le_bytes(*bytes),
            ByteOrder::Big => u16::from_be_bytes(*bytes),
        }))
    }
}

/// What may still be held of a file.
struct Room {
    bytes: u64,
    items: usize,
}

impl Room {
    fn value(&mut self, head: &Head) -> Result<(), ReadReason> {
        let longest = match head.tag {
            tag::TABLE_DATA | tag::FRAME_OFFSETS | tag::EXTENDED_OFFSETS => LONGEST_LIST,
            _ => LONGEST_VALUE,
        };
        if head.length > longest {
            let found = format!("{} bytes", head.length);
            let expected =
                if longest == LONGEST_LIST { "at most 262144 here" } else { "at most 4096 here" };
            return Err(wrong(FORMAT, "length of an element", found, expected));
        }
        let left = self.bytes.checked_sub(head.length.into());
        let too_many = || wrong(FORMAT, "elements", "more than 64 MiB", "those of an image");
        self.bytes = left.ok_or_else(too_many)?;
        Ok(())
    }

    fn item(&mut self) -> Result<(), ReadReason> {
        let too_many = || wrong(FORMAT, "sequences", "more than 1048576 items", "those of frames");
        self.items = self.items.checked_sub(1).ok_or_else(too_many)?;
        Ok(())
    }
}

/// Reads a file up to its pixel data, or to its end if it has none.
pub(super) fn read<R: Read + Seek>(reader: &mut Reader<R>) -> Result<Content, ReadReason> {
    reader.start()?;
    let mut room = Room { bytes: MOST_BYTES, items: MOST_ITEMS };
    let mut set = DataSet::default();
    let mut pixels = None;
    let mut is_meta = true;
    while !reader.is_at_end()? {
        if is_meta && !reader.peeks_meta()? {
            is_meta = false;
            reader.use_syntax(set.text(tag::TRANSFER_SYNTAX).as_deref())?;
            set.byte_order = reader.byte_order;
            continue;
        }
        let head = reader.head()?;
        if head.tag == tag::PIXELS {
            let length = Some(head.length).filter(|&length| length != UNDEFINED);
            pixels = Some(PixelData { start: reader.at, length });
            break;
        }
        take(reader, &mut set, &head, &mut room, 0)?;
    }
    Ok(Content { set, pixels, byte_order: reader.byte_order })
}

/// Keeps an element if it is wanted, and goes past it.
fn take<R: Read + Seek>(
    reader: &mut Reader<R>,
    set: &mut DataSet,
    head: &Head,
    room: &mut Room,
    depth: usize,
) -> Result<(), ReadReason> {
    let is_sequence = tag::SEQUENCES.contains(&head.tag);
    if is_sequence && (head.length > 0) {
        let mut items = Vec::new();
        each_item(reader, head, depth, &mut |reader, end| {
            room.item()?;
            let byte_order = reader.byte_order;
            let mut item = DataSet { elements: Vec::new(), byte_order };
            each_element(reader, end, &mut |reader, head| {
                take(reader, &mut item, head, room, depth + 1)
            })?;
            items.push(item);
            Ok(())
        })?;
        set.elements.push((head.tag, Value::Items(items)));
        return Ok(());
    }
    let is_float = [tag::FLOAT_PIXELS, tag::DOUBLE_PIXELS].contains(&head.tag);
    if is_float {
        set.elements.push((head.tag, Value::Bytes(vec![1])));
    } else if head.length != UNDEFINED && tag::WANTED.contains(&head.tag) && &head.kind != b"SQ" {
        room.value(head)?;
        let value = reader.value(head.length)?;
        set.elements.push((head.tag, Value::Bytes(value)));
        return Ok(());
    }
    skip(reader, head, depth)
}

/// Goes past an element; one without a length is a sequence of items.
fn skip<R: Read + Seek>(
    reader: &mut Reader<R>,
    head: &Head,
    depth: usize,
) -> Result<(), ReadReason> {
    if head.length != UNDEFINED {
        return reader.skip(head.length);
    }
    each_item(reader, head, depth, &mut |reader, end| match end {
        Some(end) => reader.skip((end - reader.at) as u32),
        None => each_element(reader, None, &mut |reader, head| skip(reader, head, depth + 1)),
    })
}

/// What is done with an item whose end is known, or marked.
type ForItem<'a, R> = &'a mut dyn FnMut(&mut Reader<R>, Option<u64>) -> Result<(), ReadReason>;

/// What is done with an element whose head was read; it goes past the value.
type ForElement<'a, R> = &'a mut dyn FnMut(&mut Reader<R>, &Head) -> Result<(), ReadReason>;

/// Goes through the items of a sequence.
fn each_item<R: Read + Seek>(
    reader: &mut Reader<R>,
    head: &Head,
    depth: usize,
    for_item: ForItem<'_, R>,
) -> Result<(), ReadReason> {
    if depth == DEEPEST {
        return Err(wrong(FORMAT, "sequences", "nested deeper", "at most 32 levels"));
    }
    // what is unknown to the writer stays implicit inside, least byte first
    let before = (reader.is_explicit, reader.byte_order);
    if &head.kind == b"UN" {
        (reader.is_explicit, reader.byte_order) = (false, ByteOrder::Little);
    }
    let end =
        Some(head.length).filter(|&n| n != UNDEFINED).map(|length| reader.at + u64::from(length));
    while end.is_none_or(|end| reader.at < end) {
        let (tag, length) = (reader.tag()?, reader.u32()?);
        match tag {
            tag::SEQUENCE_END => break,
            tag::ITEM => {
                let stop =
                    Some(length).filter(|&n| n != UNDEFINED).map(|n| reader.at + u64::from(n));
                for_item(reader, stop)?;
            }
            _ => {
                let value = format!("({:04x},{:04x})", tag >> 16, tag & 0xffff);
                return Err(wrong(FORMAT, "sequence", value, "items and an end"));
            }
        }
    }
    inside(reader, end)?;
    (reader.is_explicit, reader.byte_order) = before;
    Ok(())
}

/// Goes through the elements of an item.
fn each_element<R: Read + Seek>(
    reader: &mut Reader<R>,
    end: Option<u64>,
    for_element: ForElement<'_, R>,
) -> Result<(), ReadReason> {
    while end.is_none_or(|end| reader.at < end) {
        let head = reader.head()?;
        if head.tag == tag::ITEM_END {
            break;
        }
        for_element(reader, &head)?;
    }
    inside(reader, end)
}

/// Checks that what is inside did not go on after the end.
fn inside<R>(reader: &Reader<R>, end: Option<u64>) -> Result<(), ReadReason> {
    match end.filter(|&end| reader.at > end) {
        Some(_) => Err(wrong(FORMAT, "sequence", "longer than it says", "items within its length")),
        None => Ok(()),
    }
}
