//! Abaqus input files, a text format that Abaqus, CalculiX and others read.
//!
//! Cells are CPS3 or C3D4 elements, numbered from 1 as in the mesh. Each region is a set of elements. Each
//! group of facets is a surface of element faces, and a set of nodes of the same name; the elements are those
//! behind the facets, as their normals show. Groups of points are sets of nodes. Names lose their dots. Comments carry the numbers of groups and
//! regions, the frame and the provenance; fields are left out. Sections, if asked for ([`Sections`]), name a material for each
//! region; those whose constants are known stand before them, the others are for the user's own file to define.

mod read;
mod sections;
mod write;

pub use read::read_inp;
pub use sections::{Elastic, SectionKind, Sections};
pub use write::write_inp;

/// The set of all elements.
const CELLS: &str = "cells";

/// The number of an element's face by the corner, from 0, that is not on it.
fn face_number(dimension: usize, opposite: usize) -> usize {
    if dimension == 2 { [2, 3, 1][opposite] } else { [3, 4, 2, 1][opposite] }
}
