//! Reading meshes.

use std::path::Path;

use atomesh::geometry::Bounds;
use atomesh::image::{Frame, Units};
use atomesh::mesh::{Mesh, Tags};
use atomesh::run::Tools;
use atomesh_io::mesh::{AnyMesh, MeshFormat, MeshReadError, Provenance, read_mesh};

use crate::error::JobError;
use crate::memory;

/// Reads a mesh, unless its file alone is larger than the memory available.
///
/// # Errors
/// [`JobError`] if the file cannot be read or is not what its name says.
pub fn read(path: &Path) -> Result<AnyMesh, JobError> {
    memory::check_file(path)?;
    read_mesh(path).map_err(|e| {
        match e {
            MeshReadError::Format(_) => {
                let known = MeshFormat::endings();
                JobError::misuse(format!(
                    "unknown extension of a mesh file; expected one of {known}"
                ))
            }
            MeshReadError::Io(e) => JobError::file(format!("cannot be read: {e}")),
            _ => JobError::content(e),
        }
        .about(path)
    })
}

/// The lattice units in which a mesh was made.
pub(crate) fn units(provenance: Option<&Provenance>) -> Option<Units> {
    let units = provenance?.options.get("lattice")?.get("units")?;
    serde_json::from_value(units.clone()).ok()
}

/// The sides of the image's box, or of the mesh's own where the image is not known.
pub(crate) fn own_sides<const D: usize>(
    mesh: &Mesh<D>,
    frame: Option<&Frame<D>>,
    tools: &Tools<D>,
) -> Tags<D> {
    let sides = tools.sides;
    if let Some(frame) = frame {
        let lattice = (tools.lattice_mesh)(mesh, frame, Units::Physical);
        return sides(&lattice, &frame.grid(Units::Physical).bounds(), frame.is_mirrored());
    }
    let bounds = Bounds::of(mesh.points());
    bounds.map_or_else(Tags::default, |bounds| sides(mesh, &bounds, false))
}

/// The mesh with cells of positive orientation: those that another program wrote the other way are turned.
pub(crate) fn oriented<const D: usize>(mesh: Mesh<D>) -> Mesh<D> {
    let wrong: Vec<bool> = mesh.simplices().map(|simplex| simplex.orientation() < 0.0).collect();
    if !wrong.contains(&true) {
        return mesh;
    }
    let (points, mut corners) = mesh.into_parts();
    for (cell, _) in wrong.iter().enumerate().filter(|(_, wrong)| **wrong) {
        corners.swap(cell * (D + 1) + D - 1, cell * (D + 1) + D);
    }
    Mesh::new(points, corners).expect("the same points and corners")
}
