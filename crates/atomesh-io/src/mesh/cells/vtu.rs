//! Polygons and polyhedra as VTU: cells of VTK's types 7 and 42, the latter with their faces.

use std::io::{Seek, Write};

use atomesh::mesh::PolyMesh;
use atomesh::watch::Watch;

use super::super::cell_fields::CellFields;
use super::super::column::{Column, Endian};
use super::super::error::MeshWriteError;
use super::super::metadata;
use super::super::vtu::appended::Head;
use super::CellData;

/// VTK's numbers for a polygon and a polyhedron.
const POLYGON: u8 = 7;
const POLYHEDRON: u8 = 42;

/// Writes polygons or polyhedra as a VTU file, which ParaView and meshio read, with the arrays `volume` (in 2-D
/// the area) and `site` (`center` where cells have no sites), one value a cell. Polygons have them as cell data; polyhedra as field data, since
/// meshio 5 sorts polyhedra by their number of points, but cell data another way, and then refuses them.
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

/// Writes polygons or polyhedra with fields, as cell data. ParaView reads them; of polyhedra meshio 5 refuses
/// cell data.
///
/// # Errors
/// As [`write_cells_vtu`].
pub fn write_cells_vtu_with<const D: usize>(
    out: &mut (impl Write + Seek),
    data: &CellData<D>,
    fields: &CellFields<D>,
    watch: &mut dyn Watch,
) -> Result<(), MeshWriteError> {
    let (text, mesh) = (data.metadata(), data.mesh);
    let topology = Topology::of(mesh);
    let centers = padded(mesh.centers());
    let center_name = if mesh.sites().is_some() { "site" } else { "center" };
    let points = padded(mesh.points());
    let mut head = Head::new("UnstructuredGrid");
    head.text("<FieldData>\n");
    head.field_data("UInt8", metadata::NAME, Column::slice(text.as_bytes(), Endian::Little));
    let (count, cells) = (mesh.points().len(), mesh.cell_count());
    let vectors = "NumberOfComponents=\"3\"";
    let (volume, center) =
        (Column::slice(mesh.measures(), Endian::Little), Column::slice(&centers, Endian::Little));
    let piece = format!("<Piece NumberOfPoints=\"{count}\" NumberOfCells=\"{cells}\">\n");
    if D == 2 {
        head.text(&format!("</FieldData>\n{piece}<CellData>\n"));
        head.array("Float64", "volume", "", volume);
        head.array("Float64", center_name, vectors, center);
        head.cell_fields(fields.numbers(), fields.vectors());
        head.text("</CellData>\n<Points>\n");
    } else {
        let tuples = format!("NumberOfTuples=\"{cells}\"");
        head.array("Float64", "volume", &tuples, volume);
        head.array("Float64", center_name, &format!("{vectors} {tuples}"), center);
        head.text(&format!("</FieldData>\n{piece}"));
        if !fields.is_empty() {
            head.cell_data(fields.numbers(), fields.vectors(), None);
        }
        head.text("<Points>\n");
    }
    head.array("Float64", "Points", vectors, Column::slice(&points, Endian::Little));
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

/// Coordinates one after another, three a point.
fn padded<const D: usize>(points: &[[f64; D]]) -> Vec<f64> {
    let padded = |p: &[f64; D]| [0, 1, 2].map(|k| p.get(k).copied().unwrap_or(0.0));
    points.iter().flat_map(padded).collect()
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
    fn of<const D: usize>(mesh: &PolyMesh<D>) -> Self {
        let mut topology = Self::default();
        for cell in 0..mesh.cell_count() {
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
        let start = self.corners.len();
        for (face, sign) in mesh.faces_of(cell) {
            let corners = mesh.face(face);
            self.faces.push(corners.len() as i64);
            let first = self.faces.len();
            self.faces.extend(corners.iter().map(|&c| i64::from(c)));
            if sign < 0.0 {
                self.faces[first..].reverse();
            }
            self.corners.extend(corners.iter().map(|&c| i64::from(c)));
        }
        self.face_ends.push(self.faces.len() as i64);
        self.corners[start..].sort_unstable();
        let mut kept = start;
        for at in start..self.corners.len() {
            if at == start || self.corners[at] != self.corners[kept - 1] {
                self.corners[kept] = self.corners[at];
                kept += 1;
            }
        }
        self.corners.truncate(kept);
    }
}
