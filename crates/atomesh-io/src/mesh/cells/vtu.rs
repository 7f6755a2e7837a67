//! Polygons and polyhedra as VTU: cells of VTK's types 7 and 42, the latter with their faces.

use std::io::{Seek, Write};

use atomesh::mesh::PolyMesh;
use atomesh::watch::Watch;

use super::super::cell_fields::CellFields;
use super::super::column::{Column, Endian};
use super::super::error::MeshWriteError;
use super::super::field::Values;
use super::super::metadata;
use super::super::standing::{placed, turned};
use super::super::vtu::appended::Head;
use super::{CellData, WELL};

/// VTK's numbers for a polygon and a polyhedron.
const POLYGON: u8 = 7;
const POLYHEDRON: u8 = 42;

/// The array of each cell's place in the mesh.
pub(super) const CELL: &str = "cell";

/// The arrays of faces on features: their two cells, by their places in the mesh, and the feature's number.
pub(super) const FEATURE_CELLS: &str = "feature_cells";
pub(super) const FEATURE: &str = "feature";

/// Writes polygons or polyhedra as a VTU file, which ParaView and meshio read, with the cell arrays `volume` (in 2-D
/// the area) and `site` (`center` where cells have no sites). Faces on features are in the field data:
/// `feature_cells`, the two cells of each, and `feature`, the number of its feature. Where there are wells, the cell array
/// `well` has their numbers, from 1 on, and 0 elsewhere.
///
/// Polyhedra stand in the order of their number of points, since meshio 5 sorts them so, but their data another way, and
/// refuses files in which that differs. The array `cell` has each one's place in the mesh, the number by which other
/// files and `feature_cells` call it. Polygons stand in the mesh's order.
///
/// # Errors
/// If `out` cannot be written to or does not seek, or the watch ends the work.
pub fn write_cells_vtu<const D: usize>(
    out: &mut (impl Write + Seek),
    data: &CellData<D>,
    watch: &mut dyn Watch,
) -> Result<(), MeshWriteError> {
    write_cells_vtu_with(out, data, &CellFields::new(data.mesh.cell_count()), watch)
}

/// Writes polygons or polyhedra with fields, as cell data.
///
/// # Errors
/// As [`write_cells_vtu`].
pub fn write_cells_vtu_with<const D: usize>(
    out: &mut (impl Write + Seek),
    data: &CellData<D>,
    fields: &CellFields<D>,
    watch: &mut dyn Watch,
) -> Result<(), MeshWriteError> {
    let (text, mesh, little) = (data.metadata(), data.mesh, Endian::Little);
    let order = file_order(mesh);
    let topology = Topology::of(mesh, &order);
    let features = FeatureArrays::of(data);
    let wells = data.well_of_cells();
    let standing = data.provenance.standing.as_ref();
    let mut head = Head::new("UnstructuredGrid");
    head.text("<FieldData>\n");
    head.field_data("UInt8", metadata::NAME, Column::slice(text.as_bytes(), Endian::Little));
    features.name_in(&mut head);
    let (count, cells) = (mesh.points().len(), mesh.cell_count());
    let vectors = "NumberOfComponents=\"3\"";
    head.text("</FieldData>\n");
    head.text(&format!("<Piece NumberOfPoints=\"{count}\" NumberOfCells=\"{cells}\">\n"));
    name_cell_data(&mut head, data, (&order, &wells), fields);
    head.text("<Points>\n");
    head.array("Float64", "Points", vectors, Column::points(mesh.points(), standing, little));
    head.text("</Points>\n<Cells>\n");
    head.array("Int64", "connectivity", "", Column::slice(&topology.corners, Endian::Little));
    head.array("Int64", "offsets", "", Column::slice(&topology.ends, Endian::Little));
    let kind = if D == 2 { POLYGON } else { POLYHEDRON };
    head.array("UInt8", "types", "", Column::numbers(cells, Endian::Little, move |_| kind));
    if D == 3 {
        head.array("Int64", "faces", "", Column::slice(&topology.faces, Endian::Little));
        head.array("Int64", "faceoffsets", "", Column::slice(&topology.face_ends, Endian::Little));
    }
    head.text("</Cells>\n</Piece>\n");
    head.write(out, watch)
}

/// The cells in the order in which they stand in the file.
fn file_order<const D: usize>(mesh: &PolyMesh<D>) -> Vec<u32> {
    let mut order: Vec<u32> = (0..mesh.cell_count() as u32).collect();
    if D == 3 {
        order.sort_by_cached_key(|&cell| corners_of(mesh, cell as usize).len());
    }
    order
}

/// The points of a cell, ascending.
fn corners_of<const D: usize>(mesh: &PolyMesh<D>, cell: usize) -> Vec<u32> {
    let faces = mesh.faces_of(cell);
    let mut corners: Vec<u32> = faces.flat_map(|(face, _)| mesh.face(face)).copied().collect();
    corners.sort_unstable();
    corners.dedup();
    corners
}

/// Names what is known of the cells, in the file's order; of `wells` there is one number a cell, or none at all.
fn name_cell_data<'a, const D: usize>(
    head: &mut Head<'a>,
    data: &CellData<'a, D>,
    (order, wells): (&'a [u32], &'a [u32]),
    fields: &CellFields<'a, D>,
) {
    let mesh = data.mesh;
    let (little, cells) = (Endian::Little, order.len());
    let place = move |at: usize| order[at] as usize;
    let standing = data.provenance.standing.as_ref();
    let site = |sites: &'a [[f64; D]]| {
        let component = move |i: usize| placed(&sites[place(i / 3)], standing)[i % 3];
        Column::numbers(3 * cells, little, component)
    };
    let vector = |vectors: &'a [[f64; D]]| {
        let component = move |i: usize| turned(&vectors[place(i / 3)], standing)[i % 3];
        Column::numbers(3 * cells, little, component)
    };
    let three = "NumberOfComponents=\"3\"";
    head.text("<CellData>\n");
    let measures = mesh.measures();
    head.array(
        "Float64",
        "volume",
        "",
        Column::numbers(cells, little, move |i| measures[place(i)]),
    );
    let center_name = if mesh.sites().is_some() { "site" } else { "center" };
    head.array("Float64", center_name, three, site(mesh.centers()));
    if D == 3 {
        head.array("UInt32", CELL, "", Column::slice(order, little));
    }
    for field in fields.numbers() {
        let name = field.name();
        match field.values() {
            Values::Single(values) => {
                let column = Column::numbers(cells, little, move |i| values[place(i)]);
                head.array("Float32", name, "", column);
            }
            Values::Double(values) => {
                let column = Column::numbers(cells, little, move |i| values[place(i)]);
                head.array("Float64", name, "", column);
            }
        }
    }
    for field in fields.vectors() {
        head.array("Float64", field.name(), three, vector(field.vectors()));
    }
    if !wells.is_empty() {
        let column = Column::numbers(cells, little, move |i| wells[place(i)]);
        head.array("UInt32", WELL, "", column);
    }
    head.text("</CellData>\n");
}

/// The faces on features.
#[derive(Default)]
struct FeatureArrays {
    cells: Vec<u32>,
    features: Vec<u32>,
}

impl FeatureArrays {
    fn of<const D: usize>(data: &CellData<D>) -> Self {
        let mut arrays = Self::default();
        for (face, &neighbour) in data.mesh.neighbours().iter().enumerate() {
            match data.features.of_faces.get(face) {
                Some(&feature) if feature > 0 => {
                    arrays.cells.extend([data.mesh.owners()[face], neighbour]);
                    arrays.features.push(feature);
                }
                _ => {}
            }
        }
        arrays
    }

    /// Names the arrays if they are not empty.
    fn name_in<'a>(&'a self, head: &mut Head<'a>) {
        if self.features.is_empty() {
            return;
        }
        let count = self.features.len();
        let pairs = format!("NumberOfComponents=\"2\" NumberOfTuples=\"{count}\"");
        head.array("UInt32", FEATURE_CELLS, &pairs, Column::slice(&self.cells, Endian::Little));
        head.field_data("UInt32", FEATURE, Column::slice(&self.features, Endian::Little));
    }
}

/// VTK's arrays. A polyhedron's faces are told as: how many; for each, how many points, and which.
#[derive(Default)]
struct Topology {
    corners: Vec<i64>,
    ends: Vec<i64>,
    faces: Vec<i64>,
    face_ends: Vec<i64>,
}

impl Topology {
    fn of<const D: usize>(mesh: &PolyMesh<D>, order: &[u32]) -> Self {
        let mut topology = Self::default();
        for cell in order.iter().map(|&cell| cell as usize) {
            if D == 2 {
                topology.corners.extend(mesh.polygon(cell).into_iter().map(i64::from));
            } else {
                topology.add_polyhedron(mesh, cell);
            }
            topology.ends.push(topology.corners.len() as i64);
        }
        topology
    }

    /// The faces run counter-clockwise as seen from outside the cell.
    fn add_polyhedron<const D: usize>(&mut self, mesh: &PolyMesh<D>, cell: usize) {
        self.faces.push(mesh.faces_of(cell).count() as i64);
        for (face, sign) in mesh.faces_of(cell) {
            let corners = mesh.face(face);
            self.faces.push(corners.len() as i64);
            let first = self.faces.len();
            self.faces.extend(corners.iter().map(|&c| i64::from(c)));
            if sign < 0.0 {
                self.faces[first..].reverse();
            }
        }
        self.face_ends.push(self.faces.len() as i64);
        self.corners.extend(corners_of(mesh, cell).into_iter().map(i64::from));
    }
}
