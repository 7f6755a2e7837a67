//! Reading meshes for the commands that look at them.

use std::path::Path;

use atomesh::geometry::Bounds;
use atomesh::image::{Frame, Units};
use atomesh::mesh::{Mesh, Tags};
use atomesh::run::{lattice_mesh, sides};
use atomesh_io::mesh::{AnyMesh, MeshReadError, read_mesh};

use crate::failure::Failure;
use crate::memory;

/// Reads a mesh, unless its file alone is larger than the memory there is.
pub fn read(path: &Path) -> Result<AnyMesh, Failure> {
    let bytes = path.metadata().map_or(0, |m| m.len());
    if let Some(available) = memory::available().filter(|&available| bytes > available) {
        let (bytes, available) = (memory::text(bytes), memory::text(available));
        let message = format!("holds {bytes}; expected less than the {available} of memory left");
        return Err(Failure::content(message).about(path));
    }
    read_mesh(path).map_err(|e| match e {
        MeshReadError::Format(_) => {
            let known = atomesh_io::mesh::MeshFormat::endings();
            let message = format!("the ending says no mesh format; expected one of {known}");
            Failure::misuse(message).about(path)
        }
        MeshReadError::Io(e) => Failure::content(format!("cannot be read: {e}")).about(path),
        _ => Failure::content(e).about(path),
    })
}

/// The sides of the image's box, or of the mesh's own where the image is not known.
pub fn own_sides<const D: usize>(mesh: &Mesh<D>, frame: Option<&Frame<D>>) -> Tags<D> {
    if let Some(frame) = frame {
        let lattice = lattice_mesh(mesh, frame, Units::Physical);
        return sides(&lattice, &frame.grid(Units::Physical).bounds(), frame.is_mirrored());
    }
    let bounds = Bounds::of(mesh.points());
    bounds.map_or_else(Tags::default, |bounds| sides(mesh, &bounds, false))
}

/// The mesh with cells of positive orientation: those that another program wrote the other way are turned.
pub fn turned_right<const D: usize>(mesh: Mesh<D>) -> Mesh<D> {
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
