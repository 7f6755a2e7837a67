//! VTU, VTK's XML format for unstructured grids.

pub(crate) mod appended;
pub(crate) mod array;
mod broken;
pub(crate) mod compressor;
pub(crate) mod read;
mod write;
pub(crate) mod xml;

pub use broken::write_broken_vtu;
pub use read::read_vtu;
pub use write::write_vtu;

/// VTK's number for a cell of so many points: a triangle or tetrahedron, or one of second order.
pub(super) fn cell_type(node_count: usize) -> u8 {
    match node_count {
        3 => 5,
        4 => 10,
        6 => 22,
        _ => 24,
    }
}
