//! The samples of each frame of a file.

use std::io::{Read, Seek};
use std::ops::Range;

use super::super::affine::wrong;
use super::super::error::ReadReason;
use super::super::memory::Memory;
use super::super::sample_type::ByteOrder;
use super::FORMAT;
use super::header::Header;
use super::packing::Packing;
use super::reader::Reader;

/// A file whose header was read, and where the fragments of its frames are once one was asked for.
pub(super) struct Frames<R> {
    reader: Reader<R>,
    fragments: Vec<(u64, u32)>,
    /// The fragments of each frame.
    of_frame: Vec<Range<usize>>,
}

impl<R: Read + Seek> Frames<R> {
    /// The frames of the file whose header was read.
    pub fn new(reader: Reader<R>) -> Self {
        Self { reader, fragments: Vec::new(), of_frame: Vec::new() }
    }

    /// The frames of a file that was opened again.
    pub fn again(mut reader: Reader<R>, header: &Header) -> Result<Self, ReadReason> {
        if let Some(start) = header.deflated_from {
            reader.inflate_from(start)?;
        }
        Ok(Self::new(reader))
    }

    /// Reads the values of a frame as they are stored.
    pub fn values(
        &mut self,
        header: &Header,
        frame: usize,
        memory: Memory,
    ) -> Result<Vec<i64>, ReadReason> {
        match header.packing {
            Packing::Plain => self.plain(header, frame, memory),
            packing => {
                let packed = self.packed(header, frame, memory)?;
                packing.unpack(&packed, &header.pixels, memory)
            }
        }
    }

    fn plain(
        &mut self,
        header: &Header,
        frame: usize,
        memory: Memory,
    ) -> Result<Vec<i64>, ReadReason> {
        let pixels = &header.pixels;
        if header.place.length.is_none() {
            return Err(wrong(FORMAT, "pixel data", "packed otherwise", "as the syntax says"));
        }
        let count = pixels.count() as u64;
        let mut values = Vec::new();
        memory.reserve(&mut values, pixels.count())?;
        if pixels.allocated == 1 {
            // frames follow each other without a gap, the lowest bit first
            let first = count * frame as u64;
            let bytes = (first + count).div_ceil(8) - first / 8;
            let bytes = self.reader.pixel_bytes(header.place.start + first / 8, bytes, memory)?;
            let start = (first % 8) as usize;
            values.extend(
                (start..start + pixels.count()).map(|k| i64::from(bytes[k / 8] >> (k % 8) & 1)),
            );
            return Ok(values);
        }
        let whole = pixels.bytes(count);
        let start = header.place.start + whole * frame as u64;
        let bytes = self.reader.pixel_bytes(start, whole, memory)?;
        let fold = |number: u64, byte: &u8| number << 8 | u64::from(*byte);
        let samples = bytes.chunks_exact(pixels.bytes(1) as usize);
        match header.byte_order {
            ByteOrder::Little => {
                values.extend(samples.map(|s| pixels.value(s.iter().rev().fold(0, fold))));
            }
            ByteOrder::Big => values.extend(samples.map(|s| pixels.value(s.iter().fold(0, fold)))),
        }
        Ok(values)
    }

    /// The packed bytes of a frame.
    fn packed(
        &mut self,
        header: &Header,
        frame: usize,
        memory: Memory,
    ) -> Result<Vec<u8>, ReadReason> {
        if header.place.length.is_some() {
            return Err(wrong(FORMAT, "pixel data", "packed otherwise", "as the syntax says"));
        }
        if self.of_frame.is_empty() {
            self.find(header, memory)?;
        }
        let parts = self.of_frame.get(frame).cloned().unwrap_or_default();
        let mut bytes = Vec::new();
        for &(start, length) in &self.fragments[parts] {
            let part = self.reader.pixel_bytes(start, length.into(), memory)?;
            match bytes.is_empty() {
                true => bytes = part,
                false => bytes.extend(part),
            }
        }
        Ok(bytes)
    }

    /// Finds which fragments belong to which frame: all to a single one, one to each if there are as many, else by the
    /// table of offsets, else by where an image of JPEG begins (PS3.5, A.4).
    fn find(&mut self, header: &Header, memory: Memory) -> Result<(), ReadReason> {
        let all = self.reader.fragments(header.place.start)?;
        let bad = |value: String| {
            wrong(FORMAT, "fragments", value, "fragments of each frame, or a table of offsets")
        };
        let Some((&(table_start, table_length), fragments)) = all.split_first() else {
            return Err(bad("none".into()));
        };
        let frames = header.planes.len();
        let starts: Vec<usize> = if frames == 1 {
            vec![0]
        } else if fragments.len() == frames {
            (0..frames).collect()
        } else if table_length as usize == 4 * frames {
            let table = self.reader.pixel_bytes(table_start, table_length.into(), memory)?;
            // offsets are counted from the first fragment's head
            let origin = fragments.first().map_or(0, |(start, _)| start - 8);
            let begins = |offset: &[u8; 4]| {
                let place = origin + u64::from(u32::from_le_bytes(*offset)) + 8;
                fragments.binary_search_by_key(&place, |(start, _)| *start).ok()
            };
            let found: Option<Vec<_>> = table.as_chunks::<4>().0.iter().map(begins).collect();
            found.ok_or_else(|| bad("not where the table of offsets says".into()))?
        } else {
            let mut starts = Vec::new();
            for (k, &(start, length)) in fragments.iter().enumerate() {
                let head = self.reader.pixel_bytes(start, u64::from(length).min(2), memory)?;
                if [[0xff, 0xd8], [0xff, 0x4f]].iter().any(|magic| head == magic) {
                    starts.push(k);
                }
            }
            starts
        };
        if starts.len() != frames || starts.first() != Some(&0) || !starts.is_sorted() {
            return Err(bad(format!("{} for {frames} frames", fragments.len())));
        }
        let ends = starts.iter().skip(1).copied().chain([fragments.len()]);
        self.of_frame = starts.iter().zip(ends).map(|(&start, end)| start..end).collect();
        self.fragments = fragments.to_vec();
        Ok(())
    }
}
