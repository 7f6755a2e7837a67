//! VTU, VTK's XML format for unstructured grids.

pub(crate) mod appended;
mod array;
mod cells;
mod read;
mod write;
mod xml;

pub use cells::write_cells_vtu;
pub use read::read_vtu;
pub use write::write_vtu;

/// VTK's number for a triangle (`dimension` 2) or a tetrahedron (3).
pub(super) fn cell_type(dimension: usize) -> u8 {
    if dimension == 2 { 5 } else { 10 }
}
