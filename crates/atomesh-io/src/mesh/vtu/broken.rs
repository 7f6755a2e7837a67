//! VTU of a field that jumps from cell to cell: every cell has points of its own.

use std::path::Path;

use atomesh::mesh::{Mesh, Tags};
use atomesh::watch::Watch;

use super::super::column::{Column, Endian, fits_i32};
use super::super::data::MeshData;
use super::super::error::MeshWriteError;
use super::super::metadata;
use super::super::standing::placed;
use super::appended::Head;
use crate::atomic_file::AtomicFile;

/// The edges in whose middles the nodes of quadratic cells lie, in VTK's order: of a triangle the first three.
const EDGES: [[usize; 2]; 6] = [[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]];

/// Writes a pressure that is a polynomial in each cell, and jumps between cells, as a VTU file: cells with D + 1
/// points each where `order` is 0 or 1, quadratic ones (VTK's types 22 and 24) with points in the middles of their
/// edges too where it is 2 or more. `pressure` is asked for the value in a cell at its point of a number,
/// in VTK's order: corners as the mesh has them, then the middles of the edges 01, 12, 20, and in 3-D 03, 13, 23.
///
/// Cell fields and vectors, regions, frame and provenance are those of `data`; its fields at points, its quadratic
/// cells and its groups of facets are left out, as they are of points that cells share. The file appears whole or
/// not at all. Values are asked for block by block, from any thread: no copy of the points is held.
///
/// # Errors
/// If the file cannot be written, or the watch ends the work.
pub fn write_broken_vtu<const D: usize>(
    path: &Path,
    data: &MeshData<D>,
    order: usize,
    pressure: &(dyn Fn(usize, usize, &[f64; D]) -> f64 + Sync),
    watch: &mut dyn Watch,
) -> Result<(), MeshWriteError> {
    let (text, mesh, little) = (data.metadata(), data.mesh(), Endian::Little);
    let each = if order < 2 { D + 1 } else { (D + 1) * (D + 2) / 2 };
    let (cells, points) = (mesh.cell_count(), mesh.cell_count() * each);
    let value = move |i: usize| {
        let (cell, node) = (i / each, i % each);
        pressure(cell, node, &node_place(mesh, cell, node))
    };
    let mut head = Head::new("UnstructuredGrid");
    head.text("<FieldData>\n");
    head.field_data("UInt8", metadata::NAME, Column::slice(text.as_bytes(), little));
    head.text("</FieldData>\n");
    head.text(&format!("<Piece NumberOfPoints=\"{points}\" NumberOfCells=\"{cells}\">\n"));
    head.text("<PointData>\n");
    head.array("Float64", "pressure", "", Column::numbers(points, little, value));
    head.text("</PointData>\n");
    let regions = data.tags().and_then(Tags::regions);
    let region = regions.map(|r| ("region", Column::slice(&r.of_cells, little)));
    let standing = data.standing();
    head.cell_data(data.cell_fields(), data.cell_vectors(), standing, region);
    head.text("<Points>\n");
    let places = Column::numbers(3 * points, little, move |i| {
        let (point, axis) = (i / 3, i % 3);
        placed(&node_place(mesh, point / each, point % each), standing)[axis]
    });
    head.array("Float64", "Points", "NumberOfComponents=\"3\"", places);
    head.text("</Points>\n<Cells>\n");
    if fits_i32(points) {
        let ends = Column::numbers(cells, little, move |i| ((i + 1) * each) as i32);
        head.array("Int32", "connectivity", "", Column::numbers(points, little, |i| i as i32));
        head.array("Int32", "offsets", "", ends);
    } else {
        let ends = Column::numbers(cells, little, move |i| ((i + 1) * each) as u64);
        head.array("Int64", "connectivity", "", Column::numbers(points, little, |i| i as u64));
        head.array("Int64", "offsets", "", ends);
    }
    let kind = super::cell_type(each);
    head.array("UInt8", "types", "", Column::numbers(cells, little, move |_| kind));
    head.text("</Cells>\n</Piece>\n");
    let mut file = AtomicFile::create(path)?;
    head.write(&mut file, watch)?;
    Ok(file.commit()?)
}

/// Where a cell's point of a number is: at a corner, or in the middle of an edge.
fn node_place<const D: usize>(mesh: &Mesh<D>, cell: usize, node: usize) -> [f64; D] {
    let corners = &mesh.corners()[cell * (D + 1)..(cell + 1) * (D + 1)];
    let at = |corner: usize| &mesh.points()[corners[corner] as usize];
    match node.checked_sub(D + 1) {
        None => *at(node),
        Some(edge) => {
            let [a, b] = EDGES[edge].map(at);
            std::array::from_fn(|k| 0.5 * (a[k] + b[k]))
        }
    }
}
