//! VTP, VTK's XML format for poly data.
//!
//! Each facet is a line or a polygon with the cell arrays `feature`, the number of its group, and `potential`,
//! the group's value; the field data have the groups' numbers and names.

use std::io::{Seek, Write};

use atomesh::watch::Watch;

use super::Surface;
use crate::mesh::MeshWriteError;
use crate::mesh::column::{Column, Endian};
use crate::mesh::vtu::appended::Head;

pub(super) fn write<const D: usize>(
    out: &mut (impl Write + Seek),
    surface: &Surface<D>,
    watch: &mut dyn Watch,
) -> Result<(), MeshWriteError> {
    let little = Endian::Little;
    let corners: Vec<u32> = surface.facets().flat_map(|(facet, _)| *facet).collect();
    let ids: Vec<i32> = surface.groups.iter().map(|group| group.id as i32).collect();
    let names: String = surface.groups.iter().map(|group| format!("{}\n", group.name)).collect();
    let of_facets: Vec<i32> = surface.facets().map(|(_, group)| group.id as i32).collect();
    let values: Option<Vec<f32>> = surface.facets().map(|(_, group)| group.value).collect();
    let values = values.unwrap_or_default();
    let (points, count) = (surface.points.len(), surface.facet_count());
    let (lines, polygons) = if D == 2 { (count, 0) } else { (0, count) };

    let mut head = Head::new("PolyData");
    head.text("<FieldData>\n");
    head.field_data("Int32", "feature_ids", Column::slice(&ids, little));
    head.field_data("UInt8", "feature_names", Column::slice(names.as_bytes(), little));
    head.text("</FieldData>\n");
    head.text(&format!(
        "<Piece NumberOfPoints=\"{points}\" NumberOfVerts=\"0\" NumberOfLines=\"{lines}\" \
         NumberOfStrips=\"0\" NumberOfPolys=\"{polygons}\">\n"
    ));
    head.text("<CellData>\n");
    head.array("Int32", "feature", "", Column::slice(&of_facets, little));
    if values.len() == count && count > 0 {
        head.array("Float32", "potential", "", Column::slice(&values, little));
    }
    head.text("</CellData>\n<Points>\n");
    let coordinates = Column::slice(surface.points.as_flattened(), little);
    head.array("Float64", "Points", "NumberOfComponents=\"3\"", coordinates);
    head.text("</Points>\n");
    let tag = if D == 2 { "Lines" } else { "Polys" };
    head.text(&format!("<{tag}>\n"));
    head.array("Int32", "connectivity", "", Column::slice(&corners, little));
    let ends = Column::numbers(count, little, |i| ((i + 1) * D) as i32);
    head.array("Int32", "offsets", "", ends);
    head.text(&format!("</{tag}>\n</Piece>\n"));
    head.write(out, watch)
}
