//! Polygons and polyhedra as OpenFOAM's polyMesh.

use atomesh::mesh::{feature_name, side_name, well_name};

use super::super::openfoam::{Beyond, CellZone, FaceZone, FoamMesh, FoamMeshError, Patch};
use super::{CellData, NO_CELL};

impl FoamMesh {
    /// Cells with the sides of the box as patches, xmin, xmax, ymin ..., their features as the face zones
    /// `feature-1`, `feature-2` ... and those of wells as the cell zones `well-1` ... Polygons become prisms as high as the square root of their mean area.
    ///
    /// # Errors
    /// [`FoamMeshError`] never, for a mesh that keeps its promises.
    fn of_cells<const D: usize>(data: &CellData<D>) -> Result<Self, FoamMeshError> {
        let mesh = data.mesh;
        let patches: Vec<Patch> = (0..2 * D).map(|side| Patch::new(side_name(side))).collect();
        let mut beyond: Vec<Beyond> = mesh.neighbours().iter().map(|&c| Beyond::Cell(c)).collect();
        for side in 0..2 * D {
            beyond.extend(mesh.side(side).map(|_| Beyond::Patch(side as u32)));
        }
        let mut made = if D == 2 {
            let points: Vec<[f64; 2]> = mesh.points().iter().map(|p| [p[0], p[1]]).collect();
            let loops: Vec<Vec<u32>> =
                (0..mesh.cell_count()).map(|cell| mesh.polygon(cell)).collect();
            let edges: Vec<([u32; 2], u32, Beyond)> = (0..mesh.face_count())
                .map(|face| {
                    let ends = mesh.face(face);
                    ([ends[0], ends[1]], mesh.owners()[face], beyond[face])
                })
                .collect();
            let thickness = (mesh.measure() / mesh.cell_count() as f64).sqrt();
            let loops = loops.iter().map(Vec::as_slice);
            Self::extruded(&points, loops, &edges, patches, thickness)?
        } else {
            let points = mesh.points().iter().map(|p| std::array::from_fn(|k| p[k])).collect();
            let mut made = Self::new(points, mesh.cell_count(), patches);
            for face in 0..mesh.face_count() {
                made.push_face(mesh.face(face), mesh.owners()[face], beyond[face])?;
            }
            made
        };
        for feature in 1..=data.features.areas.len() as u32 {
            let of_faces = data.features.of_faces.iter().enumerate();
            let faces = of_faces.filter(|(_, f)| **f == feature).map(|(at, _)| (at as u32, false));
            made.push_face_zone(FaceZone { name: feature_name(feature), faces: faces.collect() })?;
        }
        for (&cell, number) in data.wells.iter().zip(1..) {
            if cell != NO_CELL {
                made.push_cell_zone(CellZone { name: well_name(number), cells: vec![cell] })?;
            }
        }
        Ok(made.with_note(&format!("{} {}", super::super::metadata::NAME, data.metadata())))
    }
}

/// Cells as a polyMesh: the sides of the box as patches xmin, xmax, ymin ..., features as the face zones
/// `feature-1`, `feature-2` ..., cells of wells as the cell zones `well-1` ... Polygons become prisms as high as the square root of their mean area.
///
/// # Errors
/// [`FoamMeshError`] only if the mesh does not keep what it promises.
pub fn foam_mesh_of<const D: usize>(data: &CellData<D>) -> Result<FoamMesh, FoamMeshError> {
    FoamMesh::of_cells(data)
}
