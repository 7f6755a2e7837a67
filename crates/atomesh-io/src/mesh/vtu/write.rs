//! Writing VTU.
//!
//! Points and vectors are Float64, with z = 0 in flat meshes; indices are Int32, or Int64 where they do not
//! fit; fields are Float32 or Float64, as they were given. Regions are the cell array `region`, Int32, with
//! `region_ids` and `region_names` in the field data. The field data also hold the groups of facets: `facets`,
//! the corners of each; `facet_group`, the number of its group; `facet_group_ids` and `facet_group_names`.
//! Names are text, UInt8, one a line. Groups of points are the point array `point_group`, UInt32, the number of each
//! one's group; their names are in the JSON text.

use std::io::{Seek, Write};

use atomesh::mesh::{Regions, Tags};
use atomesh::watch::Watch;

use super::super::column::{Column, Endian, fits_i32};
use super::super::data::MeshData;
use super::super::error::MeshWriteError;
use super::super::metadata;
use super::appended::Head;

/// Writes a mesh as a VTU file (VTK's XML unstructured grid), which ParaView and meshio read.
///
/// # Errors
/// If `out` cannot be written to or does not seek, or the watch ends the work.
pub fn write_vtu<const D: usize>(
    out: &mut (impl Write + Seek),
    data: &MeshData<D>,
    watch: &mut dyn Watch,
) -> Result<(), MeshWriteError> {
    let text = data.metadata();
    let tags = data.tags().map(TagArrays::new).unwrap_or_default();
    let groups = data.group_of_points();
    let mut head = Head::new("UnstructuredGrid");
    head.text("<FieldData>\n");
    head.field_data("UInt8", metadata::NAME, Column::slice(text.as_bytes(), Endian::Little));
    tags.name_in(&mut head, D);
    head.text("</FieldData>\n");
    piece(&mut head, data, &groups);
    head.write(out, watch)
}

/// The tags of a mesh as arrays of field data.
#[derive(Default)]
struct TagArrays {
    /// The corners of all tagged facets, group after group.
    facets: Vec<u32>,
    /// The number of each one's group.
    group_of: Vec<i32>,
    /// The groups' numbers, and their names one a line.
    groups: (Vec<i32>, String),
    /// The regions' numbers and names likewise.
    regions: (Vec<i32>, String),
}

impl TagArrays {
    fn new<const D: usize>(tags: &Tags<D>) -> Self {
        let mut arrays = Self::default();
        for group in tags.facet_groups() {
            arrays.facets.extend_from_slice(group.facets.as_flattened());
            arrays.group_of.extend(group.facets.iter().map(|_| group.id as i32));
            arrays.groups.0.push(group.id as i32);
            arrays.groups.1 += &format!("{}\n", group.name);
        }
        for id in tags.regions().map(Regions::ids).unwrap_or_default() {
            arrays.regions.0.push(id);
            let name = tags.regions().map_or_else(String::new, |regions| regions.name(id));
            arrays.regions.1 += &format!("{name}\n");
        }
        arrays
    }

    /// Names the arrays that are not empty.
    fn name_in<'a>(&'a self, head: &mut Head<'a>, dimension: usize) {
        let little = Endian::Little;
        if !self.groups.0.is_empty() {
            let count = self.facets.len() / dimension;
            let vectors = format!("NumberOfComponents=\"{dimension}\" NumberOfTuples=\"{count}\"");
            head.array("UInt32", "facets", &vectors, Column::slice(&self.facets, little));
            head.field_data("Int32", "facet_group", Column::slice(&self.group_of, little));
            head.field_data("Int32", "facet_group_ids", Column::slice(&self.groups.0, little));
            let names = Column::slice(self.groups.1.as_bytes(), little);
            head.field_data("UInt8", "facet_group_names", names);
        }
        if !self.regions.0.is_empty() {
            head.field_data("Int32", "region_ids", Column::slice(&self.regions.0, little));
            let names = Column::slice(self.regions.1.as_bytes(), little);
            head.field_data("UInt8", "region_names", names);
        }
    }
}

/// Names the arrays of the mesh and its fields.
fn piece<'a, const D: usize>(head: &mut Head<'a>, data: &MeshData<'a, D>, groups: &'a [u32]) {
    let mesh = data.mesh();
    let (points, cells, corners) = (data.nodes().len(), mesh.cell_count(), data.cell_nodes());
    head.text(&format!("<Piece NumberOfPoints=\"{points}\" NumberOfCells=\"{cells}\">\n"));
    let of_points = (!groups.is_empty())
        .then(|| (metadata::POINT_GROUP, Column::slice(groups, Endian::Little)));
    head.fields("PointData", data.point_fields(), of_points);
    let regions = data.tags().and_then(Tags::regions);
    let region = regions.map(|r| ("region", Column::slice(&r.of_cells, Endian::Little)));
    head.cell_data(data.cell_fields(), data.cell_vectors(), data.standing(), region);
    head.text("<Points>\n");
    let vectors = "NumberOfComponents=\"3\"";
    let places = Column::points(data.nodes(), data.standing(), Endian::Little);
    head.array("Float64", "Points", vectors, places);
    head.text("</Points>\n<Cells>\n");
    let each = data.nodes_per_cell();
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
    let kind = super::cell_type(each);
    head.array("UInt8", "types", "", Column::numbers(cells, Endian::Little, move |_| kind));
    head.text("</Cells>\n</Piece>\n");
}
