//! Writing NPZ: arrays are stored, not compressed, as `numpy.savez` does; time stamps are fixed.

use std::io::{Seek, Write};

use atomesh::watch::{Phase, Watch, check};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipWriter};

use super::super::column::{Column, Endian};
use super::super::data::MeshData;
use super::super::error::MeshWriteError;
use super::super::field::{Field, Values};
use super::super::metadata;
use super::first_error::FirstError;

/// Writes a mesh as NPZ; cells of second order as straight ones.
///
/// # Errors
/// If `out` cannot be written to or does not seek, or the watch ends the work.
pub fn write_npz<const D: usize>(
    out: &mut (impl Write + Seek),
    data: &MeshData<D>,
    watch: &mut dyn Watch,
) -> Result<(), MeshWriteError> {
    let little = Endian::Little;
    let (mesh, text) = (data.mesh(), data.metadata());
    let (points, cells) = (mesh.points(), mesh.cell_count());
    let coordinates = points.as_flattened();
    // of the corners, which come first
    let groups = data.tags().map_or_else(Vec::new, |tags| tags.group_of_points(points.len()));
    let mut arrays = vec![
        Array::new("points", "<f8", &[points.len(), D], Column::slice(coordinates, little)),
        Array::new("cells", "<u4", &[cells, D + 1], Column::slice(mesh.corners(), little)),
    ];
    for field in data.point_fields() {
        // of cells of second order the corners, which come first
        let column = Column::first_values(field.values(), points.len(), little);
        arrays.push(Array::new(field.name(), kind(field), &[points.len()], column));
    }
    for field in data.cell_fields() {
        let (name, column) =
            (format!("cell.{}", field.name()), Column::values(field.values(), little));
        arrays.push(Array::new(&name, kind(field), &[cells], column));
    }
    for field in data.cell_vectors() {
        let column = Column::slice(field.vectors().as_flattened(), little);
        arrays.push(Array::new(&format!("cell.{}", field.name()), "<f8", &[cells, D], column));
    }
    if !groups.is_empty() {
        let column = Column::slice(&groups, little);
        arrays.push(Array::new(metadata::POINT_GROUP, "<u4", &[groups.len()], column));
    }
    let bytes = Column::slice(text.as_bytes(), little);
    arrays.push(Array::new("metadata", &format!("|S{}", text.len()), &[], bytes));

    let mut out = FirstError::new(out);
    let written = write_arrays(&arrays, &mut out, watch);
    out.result()?;
    written
}

fn write_arrays(
    arrays: &[Array],
    out: impl Write + Seek,
    watch: &mut dyn Watch,
) -> Result<(), MeshWriteError> {
    let mut zip = ZipWriter::new(out);
    let count = arrays.len() as f64;
    for (i, array) in arrays.iter().enumerate() {
        check(watch, Phase::Write, i as f64 / count, None)?;
        array.write(&mut zip)?;
    }
    zip.finish().map_err(std::io::Error::from)?;
    Ok(())
}

/// NumPy's name of the type of a field's numbers.
fn kind(field: &Field) -> &'static str {
    match field.values() {
        Values::Single(_) => "<f4",
        Values::Double(_) => "<f8",
    }
}

/// One array of the archive.
struct Array<'a> {
    file: String,
    header: Vec<u8>,
    column: Column<'a>,
}

impl<'a> Array<'a> {
    fn new(name: &str, kind: &str, shape: &[usize], column: Column<'a>) -> Self {
        Self { file: format!("{name}.npy"), header: npy_header(kind, shape), column }
    }

    fn write<W: Write + Seek>(&self, zip: &mut ZipWriter<W>) -> std::io::Result<()> {
        let size =
            self.header.len() as u64 + self.column.count() as u64 * self.column.item_size() as u64;
        let options = SimpleFileOptions::default()
            .compression_method(CompressionMethod::Stored)
            .last_modified_time(DateTime::default()) // 1980, the first that zip can say
            .unix_permissions(0o644)
            .large_file(size > u64::from(u32::MAX) / 2);
        zip.start_file(self.file.as_str(), options)?;
        zip.write_all(&self.header)?;
        self.column.write(zip)
    }
}

/// The header of NPY version 1.0, padded so that the data begin at a multiple of 64 bytes.
fn npy_header(kind: &str, shape: &[usize]) -> Vec<u8> {
    let shape = match shape {
        [one] => format!("({one},)"),
        many => {
            let sides: Vec<_> = many.iter().map(usize::to_string).collect();
            format!("({})", sides.join(", "))
        }
    };
    let text = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}");
    let length = (10 + text.len() + 1).next_multiple_of(64) - 10; // far below 65536: names are short
    let mut header = b"\x93NUMPY\x01\x00".to_vec();
    header.extend_from_slice(&(length as u16).to_le_bytes());
    header.extend_from_slice(format!("{text:<width$}\n", width = length - 1).as_bytes());
    header
}
