//! Any bytes as a mesh file (npz): a valid mesh or an error.
#![no_main]

use atomesh_fuzz::check_mesh;
use atomesh_io::mesh::npz::read_npz;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| check_mesh(read_npz(bytes)));
