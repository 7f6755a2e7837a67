//! What the targets share.

use atomesh_io::mesh::{AnyMesh, LoadedMesh};

/// Checks what was read of a mesh file, if it was read: a mesh checks itself; fields must fit its points and
/// cells.
pub fn check_mesh<E>(read: Result<AnyMesh, E>) {
    match read {
        Ok(AnyMesh::Flat(loaded)) => check_fields(&loaded),
        Ok(AnyMesh::Volume(loaded)) => check_fields(&loaded),
        Err(_) => {}
    }
}

fn check_fields<const D: usize>(loaded: &LoadedMesh<D>) {
    let (points, cells) = (loaded.mesh.points().len(), loaded.mesh.cell_count());
    assert!(loaded.point_fields.iter().all(|f| f.values.len() == points));
    assert!(loaded.cell_fields.iter().all(|f| f.values.len() == cells));
}
