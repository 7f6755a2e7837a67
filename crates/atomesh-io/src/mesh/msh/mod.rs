//! MSH, the format of Gmsh: versions 4.1 and 2.2, binary and text.
//!
//! Points are numbered from 1 in the mesh's order and belong to one entity, numbered 1, and so do cells, unless they
//! have regions: then each region is an entity, and its cells stand together in version 4.1. Elements are numbered from
//! 1 in the order in which they stand, facets after cells. Where cells do not stand in the mesh's order, `$CellOrder`, a
//! section that others ignore, has the place of each in it, from 0 on.
//!
//! Regions and groups of facets and points are physical groups with names and numbers, above 0 and no two the same; where there
//! are groups but no regions, all cells are in one named `domain`. Regions keep the numbers that they have, but those
//! below 1; groups of facets keep theirs unless a region has one of them; those of points are numbered after both; the
//! comment tells which number stands for which. Points of groups are elements after the facets. A facet of several groups is turned as the first of them has it.
//!
//! Fields at points are `$NodeData`, fields in cells `$ElementData`, vectors too; a facet has there the value of the
//! cell behind it, a point that of its first cell. (meshio 5 reads them in version 4.1; in 2.2 it fails on values in files of more than one kind of
//! element, its own too.) The frame and the provenance are JSON in `$Comments`, a section that Gmsh ignores.

mod entities;
mod read;
mod values;
mod write;

pub use super::format::{MshEncoding, MshVersion};
pub use read::read_msh;
pub use write::write_msh;

/// Gmsh's number for a point.
const POINT: i32 = 15;

/// Gmsh's number for a line (`dimension` 1), a triangle (2) or a tetrahedron (3), or for one of second order.
pub(super) fn element_type(dimension: usize, is_quadratic: bool) -> i32 {
    match (dimension, is_quadratic) {
        (1, false) => 1,
        (2, false) => 2,
        (_, false) => 4,
        (1, true) => 8,
        (2, true) => 9,
        (_, true) => 11,
    }
}

/// The place in VTK's order, which is ours, of point `k` of a cell of so many points: Gmsh has the last two of
/// a tetrahedron of second order the other way round.
pub(super) fn place(node_count: usize, k: usize) -> usize {
    match (node_count, k) {
        (10, 8) => 9,
        (10, 9) => 8,
        _ => k,
    }
}
