//! The shape of polygons and polyhedra in numbers.

use super::{PolyMesh, connections};
use crate::geometry::{Bounds, distance_squared};

/// Counts, sizes and shapes of cells. Lengths are in the unit of the mesh's coordinates.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct PolyReport {
    /// Cells.
    pub cells: usize,
    /// Points.
    pub points: usize,
    /// Faces, those on the sides of the box too.
    pub faces: usize,
    /// Faces between two cells.
    pub connections: usize,
    /// Mean number of faces of a cell.
    pub faces_per_cell_mean: f64,
    /// Greatest number of faces of a cell.
    pub faces_per_cell_max: usize,
    /// The sum of the cells' measures.
    pub total_measure: f64,
    /// |total − box| / box.
    pub volume_error: f64,
    /// Least measure of a cell.
    pub measure_min: f64,
    /// Greatest measure over the least; cells at the sides of the box are cut by it.
    pub measure_ratio: f64,
    /// Length of the shortest edge of a face.
    pub edge_min: f64,
    /// Area of the smallest face (2-D: its length).
    pub face_min: f64,
    /// Least cosine of the angle between a face's normal and the line from centre to centre: 1 for Voronoi cells
    /// in lattice space.
    pub orthogonality_min: f64,
}

impl PolyReport {
    /// Measures a mesh that fills `bounds`.
    pub fn new<const D: usize>(mesh: &PolyMesh<D>, bounds: &Bounds<D>) -> Self {
        let counts = (0..mesh.cell_count()).map(|cell| mesh.faces_of(cell).count());
        let links = connections(mesh);
        let least = |values: &mut dyn Iterator<Item = f64>| values.fold(f64::INFINITY, f64::min);
        let points = mesh.points();
        let mut edges = (0..mesh.face_count()).flat_map(|face| {
            let corners = mesh.face(face);
            (0..corners.len()).map(move |at| {
                let [a, b] = [corners[at], corners[(at + 1) % corners.len()]];
                distance_squared(&points[a as usize], &points[b as usize])
            })
        });
        let (total_measure, expected) = (mesh.measure(), bounds.measure());
        let measure_min = least(&mut mesh.measures().iter().copied());
        let measure_max = mesh.measures().iter().copied().fold(0.0, f64::max);
        let inner: usize = 2 * mesh.inner_face_count();
        let sides = mesh.face_count() - mesh.inner_face_count();
        Self {
            cells: mesh.cell_count(),
            points: mesh.points().len(),
            faces: mesh.face_count(),
            connections: mesh.inner_face_count(),
            faces_per_cell_mean: (inner + sides) as f64 / mesh.cell_count() as f64,
            faces_per_cell_max: counts.max().unwrap_or(0),
            total_measure,
            volume_error: (total_measure - expected).abs() / expected,
            measure_min,
            measure_ratio: measure_max / measure_min,
            edge_min: least(&mut edges).sqrt(),
            face_min: least(&mut links.iter().map(|c| c.area)),
            orthogonality_min: least(&mut links.iter().map(|c| c.orthogonality)),
        }
    }
}
