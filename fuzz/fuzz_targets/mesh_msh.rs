//! Any bytes as a mesh file (msh): a valid mesh or an error.
#![no_main]

use atomesh_io::mesh::msh::read_msh;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    // a mesh checks itself; fields must fit its points and cells
    let (fields, count) = match read_msh(bytes) {
        Ok(atomesh_io::mesh::AnyMesh::Flat(m)) => {
            assert!(m.cell_fields.iter().all(|f| f.values.len() == m.mesh.cell_count()));
            (m.point_fields, m.mesh.points().len())
        }
        Ok(atomesh_io::mesh::AnyMesh::Volume(m)) => {
            assert!(m.cell_fields.iter().all(|f| f.values.len() == m.mesh.cell_count()));
            (m.point_fields, m.mesh.points().len())
        }
        Err(_) => return,
    };
    assert!(fields.iter().all(|f| f.values.len() == count));
});
