//! VTK's XML files with appended data: a head that names every array and its place, then all arrays, raw, as
//! zlib blocks.
//!
//! Blocks have a fixed size and are compressed in parallel, so that the bytes do not depend on the number of
//! threads.

use std::io::{self, Seek, SeekFrom, Write};
use std::ops::Range;

use atomesh::watch::{Phase, Watch, check};
use flate2::Compression;
use flate2::write::ZlibEncoder;
use rayon::prelude::*;

use super::super::cell_fields::VectorField;
use super::super::column::{Column, Endian};
use super::super::error::MeshWriteError;
use super::super::field::{Field, Values};
use super::super::standing::Standing;

/// Bytes of a block before compression. Large enough for zlib to do well (its window has 32 KiB),
/// small enough for many threads.
const BLOCK: usize = 1 << 18;

/// Blocks between two looks at the watch.
const BLOCKS_PER_STEP: usize = 64;

/// zlib's level. For 300,000 tetrahedra level 1 takes 0.04 s and leaves 6.5 MB of 13, level 2 0.1 s
/// and 4.1 MB, level 3 0.14 s and 4.0 MB: the file is written in less time than a disk takes to keep up.
const LEVEL: u32 = 1;

/// Digits and blanks kept for an offset in the head, which is known only after the array is written.
const OFFSET_WIDTH: usize = 21;

/// The XML before the data, and the arrays it names, each with the place of its offset.
pub(crate) struct Head<'a> {
    kind: &'static str,
    xml: Vec<u8>,
    arrays: Vec<(usize, Column<'a>)>,
}

impl<'a> Head<'a> {
    /// The beginning of a file of VTK's `kind`.
    pub fn new(kind: &'static str) -> Self {
        Self::with_attributes(kind, "")
    }

    /// The same, with attributes of the tag that is named as the kind is.
    pub fn with_attributes(kind: &'static str, attributes: &str) -> Self {
        let mut head = Self { kind, xml: Vec::new(), arrays: Vec::new() };
        head.text(&format!("<?xml version=\"1.0\"?>\n<VTKFile type=\"{kind}\" version=\"1.0\" "));
        head.text("byte_order=\"LittleEndian\" header_type=\"UInt64\" ");
        let gap = if attributes.is_empty() { "" } else { " " };
        head.text("compressor=\"vtkZLibDataCompressor\">\n");
        head.text(&format!("<{kind}{gap}{attributes}>\n"));
        head
    }

    pub fn text(&mut self, text: &str) {
        self.xml.extend_from_slice(text.as_bytes());
    }

    /// Names an array; `extra` are further attributes.
    pub fn array(&mut self, kind: &str, name: &str, extra: &str, column: Column<'a>) {
        self.text(&format!("<DataArray type=\"{kind}\" Name=\"{name}\" {extra} "));
        self.text("format=\"appended\" offset=\"");
        self.arrays.push((self.xml.len(), column));
        self.text(&format!("{:OFFSET_WIDTH$}/>\n", "0\""));
    }

    /// Names fields within a tag, then an array of UInt32.
    pub fn fields(&mut self, tag: &str, fields: &[Field<'a>], numbers: Option<(&str, Column<'a>)>) {
        self.text(&format!("<{tag}>\n"));
        fields.iter().for_each(|field| self.field(field));
        if let Some((name, column)) = numbers {
            self.array("UInt32", name, "", column);
        }
        self.text(&format!("</{tag}>\n"));
    }

    fn field(&mut self, field: &Field<'a>) {
        let kind = match field.values() {
            Values::Single(_) => "Float32",
            Values::Double(_) => "Float64",
        };
        self.array(kind, field.name(), "", Column::values(field.values(), Endian::Little));
    }

    /// Names an array of field data, which has as many tuples as it has numbers.
    pub fn field_data(&mut self, kind: &str, name: &str, column: Column<'a>) {
        let tuples = format!("NumberOfTuples=\"{}\"", column.count());
        self.array(kind, name, &tuples, column);
    }

    /// Names fields of cells, then vectors, in the plane of flat meshes, then an array of Int32.
    pub fn cell_data<const D: usize>(
        &mut self,
        fields: &[Field<'a>],
        vectors: &[VectorField<'a, D>],
        standing: Option<&'a Standing>,
        numbers: Option<(&str, Column<'a>)>,
    ) {
        self.text("<CellData>\n");
        self.cell_fields(fields, vectors, standing);
        if let Some((name, column)) = numbers {
            self.array("Int32", name, "", column);
        }
        self.text("</CellData>\n");
    }

    /// Names fields of cells and vectors, without a tag around them.
    pub fn cell_fields<const D: usize>(
        &mut self,
        fields: &[Field<'a>],
        vectors: &[VectorField<'a, D>],
        standing: Option<&'a Standing>,
    ) {
        fields.iter().for_each(|field| self.field(field));
        for field in vectors {
            let column = Column::vectors(field.vectors(), standing, Endian::Little);
            self.array("Float64", field.name(), "NumberOfComponents=\"3\"", column);
        }
    }

    /// Writes the head, all arrays, and the end of the file.
    pub fn write(
        mut self,
        out: &mut (impl Write + Seek),
        watch: &mut dyn Watch,
    ) -> Result<(), MeshWriteError> {
        self.text(&format!("</{}>\n<AppendedData encoding=\"raw\">\n_", self.kind));
        let start = out.stream_position()?;
        out.write_all(&self.xml)?;
        let body = out.stream_position()?;
        let rewritten = Rewritten::of(self.arrays.iter().map(|(_, column)| column));
        let mut offsets = Vec::new();
        for (i, (_, column)) in self.arrays.iter().enumerate() {
            offsets.push(out.stream_position()? - body);
            let is_taken = |end: u64| rewritten.meets(i + 1, end - body);
            write_array(out, column, &is_taken, &mut |share| {
                let done = (i as f64 + share) / self.arrays.len() as f64;
                Ok(check(watch, Phase::Write, done, None)?)
            })?;
        }
        // readers cut the data at the last line break before the closing tag
        out.write_all(b"\n</AppendedData>\n</VTKFile>\n")?;
        let end = out.stream_position()?;
        for ((place, _), offset) in self.arrays.iter().zip(offsets) {
            out.seek(SeekFrom::Start(start + *place as u64))?;
            out.write_all(format!("{offset}\"").as_bytes())?;
        }
        out.seek(SeekFrom::Start(end))?;
        Ok(())
    }
}

/// Writes one array: the number of blocks, the bytes of a block, of the last one if it is shorter, the
/// compressed bytes of each, and the blocks. The lengths are known last, and so written last: only a few
/// blocks are held at a time. The array ends where `is_taken` does not hold, if it is not empty. `step` is told the
/// share that is done.
fn write_array(
    out: &mut (impl Write + Seek),
    column: &Column,
    is_taken: &dyn Fn(u64) -> bool,
    step: &mut dyn FnMut(f64) -> Result<(), MeshWriteError>,
) -> Result<(), MeshWriteError> {
    let ranges: Vec<_> = column.blocks(BLOCK).collect();
    let size = |range: &Range<usize>| (range.len() * column.item_size()) as u64;
    let whole = ranges.first().map_or(0, size);
    let last = ranges.last().map_or(0, size);
    let mut header = vec![ranges.len() as u64, whole, if last == whole { 0 } else { last }];
    header.resize(header.len() + ranges.len(), 0);
    let start = out.stream_position()?;
    Column::slice(&header, Endian::Little).write(out)?;
    header.truncate(3);
    step(0.0)?;
    for some in ranges.chunks(BLOCKS_PER_STEP) {
        let blocks: io::Result<Vec<Vec<u8>>> = some
            .par_iter()
            .map_init(Vec::new, |raw, range| {
                raw.clear();
                column.fill(range.clone(), raw);
                compress(raw)
            })
            .collect();
        for mut block in blocks? {
            if header.len() + 1 == ranges.len() + 3 {
                pad(&mut block, out.stream_position()?, is_taken);
            }
            out.write_all(&block)?;
            header.push(block.len() as u64);
        }
        step((header.len() - 3) as f64 / ranges.len() as f64)?;
    }
    let end = out.stream_position()?;
    out.seek(SeekFrom::Start(start))?;
    Column::slice(&header, Endian::Little).write(out)?;
    out.seek(SeekFrom::Start(end))?;
    Ok(())
}

/// The bytes as one zlib stream.
fn compress(raw: &[u8]) -> io::Result<Vec<u8>> {
    let mut zlib = ZlibEncoder::new(Vec::with_capacity(raw.len() / 2), Compression::new(LEVEL));
    zlib.write_all(raw)?;
    zlib.finish()
}

/// Makes a zlib stream that begins at `start` longer until its end is not taken.
fn pad(stream: &mut Vec<u8>, start: u64, is_taken: &dyn Fn(u64) -> bool) {
    while is_taken(start + stream.len() as u64) {
        let after_head = 2..2;
        stream.splice(after_head, EMPTY_BLOCK);
    }
}

/// A block of deflate that is stored, not the last, and empty.
const EMPTY_BLOCK: [u8; 5] = [0, 0, 0, 0xff, 0xff];

/// The offsets that meshio gives to arrays while it reads.
///
/// It takes raw files apart by offsets, and writes each array's new one, that of a file in base64, over the old one in
/// the head. Where an array's own offset is one that it gave to an array before, it finds the wrong one. So no
/// array begins at such an offset.
struct Rewritten {
    /// The new offset of each array.
    offsets: Vec<u64>,
    /// Whether each array has no numbers.
    is_empty: Vec<bool>,
}

impl Rewritten {
    fn of<'a>(columns: impl Iterator<Item = &'a Column<'a>>) -> Self {
        let (mut at, mut offsets, mut is_empty) = (0, Vec::new(), Vec::new());
        for column in columns {
            offsets.push(at);
            let bytes = (column.count() * column.item_size()) as u64;
            is_empty.push(bytes == 0);
            at += 4 * (WORD + bytes).div_ceil(3);
        }
        Self { offsets, is_empty }
    }

    /// Whether array `next`, if it began at this offset, or an empty one after it, would have the new offset of one
    /// before it.
    fn meets(&self, next: usize, offset: u64) -> bool {
        let mut at = offset;
        for array in next..self.offsets.len() {
            if self.offsets[..array].contains(&at) {
                return true;
            }
            if !self.is_empty[array] {
                return false;
            }
            at += 3 * WORD; // the head of an array without blocks
        }
        false
    }
}

/// Bytes of a number in the head of an array.
const WORD: u64 = 8;

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::{Cursor, Read};

    use atomesh::watch::Silent;
    use flate2::read::ZlibDecoder;

    /// The offsets that the head of a file of these arrays names.
    fn offsets(arrays: &[Vec<u8>]) -> Vec<u64> {
        let mut head = Head::new("UnstructuredGrid");
        for array in arrays {
            head.array("UInt8", "a", "", Column::slice(array, Endian::Little));
        }
        let mut file = Cursor::new(Vec::new());
        head.write(&mut file, &mut Silent).unwrap();
        let bytes = file.into_inner();
        let text = String::from_utf8_lossy(&bytes).into_owned();
        let words = text.split("offset=\"").skip(1);
        words.map(|rest| rest.split('"').next().unwrap().parse().unwrap()).collect()
    }

    /// Bytes that zlib makes no shorter.
    fn noise(count: usize) -> Vec<u8> {
        let mut state = 1u32;
        let mut next = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 24) as u8
        };
        (0..count).map(|_| next()).collect()
    }

    #[test]
    fn no_array_begins_where_meshio_has_put_one_before_it() {
        let mut padded = 0;
        for empty in [0, 1, 2] {
            // the first array is rewritten to take more room than it has, so that the third meets the second's place
            for count in 0..200 {
                let mut arrays = vec![vec![7; 300], noise(count)];
                arrays.extend(vec![Vec::new(); empty]);
                arrays.extend([noise(50), noise(9), vec![3; 4000]]);
                let found = offsets(&arrays);
                let columns: Vec<_> =
                    arrays.iter().map(|a| Column::slice(a, Endian::Little)).collect();
                let rewritten = Rewritten::of(columns.iter());
                for (at, offset) in found.iter().enumerate() {
                    assert!(!rewritten.offsets[..at].contains(offset), "array {at} at {offset}");
                }
                padded += usize::from(is_padded(&found, &arrays));
            }
        }
        assert!(padded > 0, "none of these files met the case");
    }

    /// Whether an array takes more room than its head and its block.
    fn is_padded(offsets: &[u64], arrays: &[Vec<u8>]) -> bool {
        let size = |a: &Vec<u8>| match a.len() {
            0 => 24,
            _ => 32 + compress(a).unwrap().len() as u64,
        };
        offsets.windows(2).zip(arrays).any(|(pair, array)| pair[1] - pair[0] != size(array))
    }

    #[test]
    fn a_longer_stream_says_the_same() {
        let raw = noise(1000);
        let mut stream = compress(&raw).unwrap();
        let length = stream.len() as u64;
        pad(&mut stream, 100, &|end| end < 100 + length + 12);
        assert_eq!(stream.len() as u64, length + 15);
        let mut back = Vec::new();
        ZlibDecoder::new(&stream[..]).read_to_end(&mut back).unwrap();
        assert_eq!(back, raw);
    }
}
