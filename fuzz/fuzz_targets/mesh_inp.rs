//! Any bytes as a mesh file (inp): a valid mesh or an error.
#![no_main]

use atomesh_io::mesh::inp::read_inp;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    // a mesh checks itself; fields must fit its points
    let (fields, count) = match read_inp(bytes) {
        Ok(atomesh_io::mesh::AnyMesh::Flat(m)) => (m.point_fields, m.mesh.points().len()),
        Ok(atomesh_io::mesh::AnyMesh::Volume(m)) => (m.point_fields, m.mesh.points().len()),
        Err(_) => return,
    };
    assert!(fields.iter().all(|f| f.values.len() == count));
});
