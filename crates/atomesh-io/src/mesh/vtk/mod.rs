//! VTK's legacy format for unstructured grids: written as version 3.0, read up to 5.1.

mod read;
pub(crate) mod words;
mod write;

pub use read::read_vtk;
pub use write::write_vtk;
