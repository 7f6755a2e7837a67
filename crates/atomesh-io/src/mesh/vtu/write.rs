//! Writing VTU: an XML head that names every array and its place, then all arrays, raw, as zlib blocks.
//!
//! Blocks have a fixed size and are compressed side by side, so the bytes do not depend on the number
//! of threads. Points are Float64 with z = 0 in flat meshes; indices are Int32, or Int64 where they do
//! not fit; fields are Float32.

use std::io::{self, Seek, SeekFrom, Write};
use std::ops::Range;

use atomesh::watch::{Phase, Watch, check};
use flate2::Compression;
use flate2::write::ZlibEncoder;
use rayon::prelude::*;

use super::super::column::{Column, Endian, fits_i32};
use super::super::data::{Field, MeshData};
use super::super::{MeshWriteError, metadata};

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

/// Writes a mesh as a VTU file (VTK's XML unstructured grid), which ParaView and meshio read.
///
/// # Errors
/// If `out` cannot be written to or does not seek, or the watch ends the work.
pub fn write_vtu<const D: usize>(
    out: &mut (impl Write + Seek),
    data: &MeshData<D>,
    watch: &mut dyn Watch,
) -> Result<(), MeshWriteError> {
    let text = metadata::encode(data);
    let mut head = Head::default();
    head.text("<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" ");
    head.text("byte_order=\"LittleEndian\" header_type=\"UInt64\" ");
    head.text("compressor=\"vtkZLibDataCompressor\">\n<UnstructuredGrid>\n<FieldData>\n");
    let tuples = format!("NumberOfTuples=\"{}\"", text.len());
    head.array("UInt8", metadata::NAME, &tuples, Column::slice(text.as_bytes(), Endian::Little));
    head.text("</FieldData>\n");
    piece(&mut head, data);
    head.text("</UnstructuredGrid>\n<AppendedData encoding=\"raw\">\n_");

    let start = out.stream_position()?;
    out.write_all(&head.xml)?;
    let body = out.stream_position()?;
    let mut offsets = Vec::new();
    for (i, (_, column)) in head.arrays.iter().enumerate() {
        offsets.push(out.stream_position()? - body);
        write_array(out, column, &mut |share| {
            let done = (i as f64 + share) / head.arrays.len() as f64;
            Ok(check(watch, Phase::Write, done, None)?)
        })?;
    }
    // readers cut the data at the last line break before the closing tag
    out.write_all(b"\n</AppendedData>\n</VTKFile>\n")?;
    let end = out.stream_position()?;
    for ((place, _), offset) in head.arrays.iter().zip(offsets) {
        out.seek(SeekFrom::Start(start + *place as u64))?;
        out.write_all(format!("{offset}\"").as_bytes())?;
    }
    out.seek(SeekFrom::Start(end))?;
    Ok(())
}

/// The XML before the data, and the arrays it names, each with the place of its offset.
#[derive(Default)]
struct Head<'a> {
    xml: Vec<u8>,
    arrays: Vec<(usize, Column<'a>)>,
}

impl<'a> Head<'a> {
    fn text(&mut self, text: &str) {
        self.xml.extend_from_slice(text.as_bytes());
    }

    /// Names an array; `extra` are further attributes.
    fn array(&mut self, kind: &str, name: &str, extra: &str, column: Column<'a>) {
        self.text(&format!("<DataArray type=\"{kind}\" Name=\"{name}\" {extra} "));
        self.text("format=\"appended\" offset=\"");
        self.arrays.push((self.xml.len(), column));
        self.text(&format!("{:OFFSET_WIDTH$}/>\n", "0\""));
    }

    fn fields(&mut self, tag: &str, fields: &[Field<'a>]) {
        self.text(&format!("<{tag}>\n"));
        for field in fields {
            self.array("Float32", field.name(), "", Column::slice(field.values(), Endian::Little));
        }
        self.text(&format!("</{tag}>\n"));
    }
}

/// Names the arrays of the mesh and its fields.
fn piece<'a, const D: usize>(head: &mut Head<'a>, data: &MeshData<'a, D>) {
    let mesh = data.mesh();
    let (points, cells, corners) = (mesh.points().len(), mesh.cell_count(), mesh.corners());
    head.text(&format!("<Piece NumberOfPoints=\"{points}\" NumberOfCells=\"{cells}\">\n"));
    head.fields("PointData", data.point_fields());
    head.fields("CellData", data.cell_fields());
    head.text("<Points>\n");
    let vectors = "NumberOfComponents=\"3\"";
    head.array("Float64", "Points", vectors, Column::points(mesh, Endian::Little));
    head.text("</Points>\n<Cells>\n");
    let each = D + 1;
    if fits_i32(corners.len().max(points)) {
        let ends = Column::numbers(cells, Endian::Little, move |i| ((i + 1) * each) as i32);
        head.array("Int32", "connectivity", "", Column::slice(corners, Endian::Little));
        head.array("Int32", "offsets", "", ends);
    } else {
        let wide = Column::numbers(corners.len(), Endian::Little, |i| u64::from(corners[i]));
        let ends = Column::numbers(cells, Endian::Little, move |i| ((i + 1) * each) as u64);
        head.array("Int64", "connectivity", "", wide);
        head.array("Int64", "offsets", "", ends);
    }
    let kind = super::cell_type(D);
    head.array("UInt8", "types", "", Column::numbers(cells, Endian::Little, move |_| kind));
    head.text("</Cells>\n</Piece>\n");
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
