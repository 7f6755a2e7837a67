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

    pub fn fields(&mut self, tag: &str, fields: &[Field<'a>]) {
        self.text(&format!("<{tag}>\n"));
        fields.iter().for_each(|field| self.field(field));
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

    /// Names fields of cells, then vectors, z being 0 in flat meshes, then an array of Int32.
    pub fn cell_data<const D: usize>(
        &mut self,
        fields: &[Field<'a>],
        vectors: &[VectorField<'a, D>],
        numbers: Option<(&str, Column<'a>)>,
    ) {
        self.text("<CellData>\n");
        self.cell_fields(fields, vectors);
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
    ) {
        fields.iter().for_each(|field| self.field(field));
        for field in vectors {
            let column = Column::points(field.vectors(), Endian::Little);
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
        let mut offsets = Vec::new();
        for (i, (_, column)) in self.arrays.iter().enumerate() {
            offsets.push(out.stream_position()? - body);
            write_array(out, column, &mut |share| {
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
/// blocks are held at a time. `step` is told the share that is done.
fn write_array(
    out: &mut (impl Write + Seek),
    column: &Column,
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
        let blocks: io::Result<Vec<_>> = some
            .par_iter()
            .map_init(Vec::new, |raw, range| {
                raw.clear();
                column.fill(range.clone(), raw);
                compress(raw)
            })
            .collect();
        for block in blocks? {
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
