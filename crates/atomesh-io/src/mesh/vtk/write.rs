//! Writing VTK's legacy format, version 3.0, binary.

use std::io::Write;

use atomesh::watch::{Phase, Watch, check};

use super::super::cell_fields::VectorField;
use super::super::column::{Column, Endian};
use super::super::data::MeshData;
use super::super::error::MeshWriteError;
use super::super::field::{Field, Values};
use super::super::standing::Standing;
use super::super::{metadata, vtu};

/// Writes a mesh as a legacy VTK file: big-endian binary, points as double, fields in their own precision;
/// frame and provenance are JSON in the field data.
///
/// # Errors
/// If the cells' list is longer than the format's 32-bit numbers can say, `out` cannot be written to,
/// or the watch ends the work.
pub fn write_vtk<const D: usize>(
    out: &mut impl Write,
    data: &MeshData<D>,
    watch: &mut dyn Watch,
) -> Result<(), MeshWriteError> {
    let mesh = data.mesh();
    let (points, cells) = (data.nodes().len(), mesh.cell_count());
    let (nodes, count) = (data.cell_nodes(), data.nodes_per_cell());
    let list = nodes.len() + cells;
    let limit = i32::MAX as usize;
    if let Some(&count) = [points, list].iter().find(|&&n| n > limit) {
        return Err(MeshWriteError::TooMany { format: "VTK legacy", count, limit });
    }
    let big = Endian::Big;
    let text = data.metadata();
    let name = metadata::NAME;
    writeln!(out, "# vtk DataFile Version 3.0\natomesh\nBINARY\nDATASET UNSTRUCTURED_GRID")?;
    writeln!(out, "FIELD FieldData 1\n{name} 1 {} unsigned_char\n{text}", text.len())?;
    check(watch, Phase::Write, 0.0, None)?;
    writeln!(out, "POINTS {points} double")?;
    Column::points(data.nodes(), data.standing(), big).write(out)?;
    check(watch, Phase::Write, 0.3, None)?;
    writeln!(out, "\nCELLS {cells} {list}")?;
    let each = Column::new(cells, 4 * (count + 1), move |range, bytes| {
        for cell in nodes[range.start * count..range.end * count].chunks_exact(count) {
            let numbers = std::iter::once(count as u32).chain(cell.iter().copied());
            bytes.extend(numbers.flat_map(u32::to_be_bytes));
        }
    });
    each.write(out)?;
    check(watch, Phase::Write, 0.7, None)?;
    writeln!(out, "\nCELL_TYPES {cells}")?;
    let kind = i32::from(vtu::cell_type(count));
    Column::numbers(cells, big, move |_| kind).write(out)?;
    writeln!(out, "\nPOINT_DATA {points}")?;
    fields::<D>(out, data.point_fields(), (&[], None), &data.group_of_points())?;
    check(watch, Phase::Write, 0.9, None)?;
    writeln!(out, "CELL_DATA {cells}")?;
    fields(out, data.cell_fields(), (data.cell_vectors(), data.standing()), &[])?;
    Ok(())
}

/// Numbers, then vectors of three components, in the plane of flat meshes, and the groups of points, if there are any.
fn fields<const D: usize>(
    out: &mut impl Write,
    fields: &[Field],
    (vectors, standing): (&[VectorField<D>], Option<&Standing>),
    groups: &[u32],
) -> Result<(), MeshWriteError> {
    let count = fields.len() + vectors.len() + usize::from(!groups.is_empty());
    if count == 0 {
        return Ok(());
    }
    writeln!(out, "FIELD FieldData {count}")?;
    for field in fields {
        let kind = match field.values() {
            Values::Single(_) => "float",
            Values::Double(_) => "double",
        };
        writeln!(out, "{} 1 {} {kind}", field.name(), field.values().len())?;
        Column::values(field.values(), Endian::Big).write(out)?;
        writeln!(out)?;
    }
    for field in vectors {
        writeln!(out, "{} 3 {} double", field.name(), field.vectors().len())?;
        Column::vectors(field.vectors(), standing, Endian::Big).write(out)?;
        writeln!(out)?;
    }
    if !groups.is_empty() {
        writeln!(out, "{} 1 {} unsigned_int", metadata::POINT_GROUP, groups.len())?;
        Column::slice(groups, Endian::Big).write(out)?;
        writeln!(out)?;
    }
    Ok(())
}
