//! Cells and vertices in flat arrays; the places of freed cells are reused.
//!
//! A facet is named by its cell and the corner opposite to it: `4 · cell + corner`. A cell keeps, for
//! each corner, the facet of the neighbour that is this facet seen from the other side.

use crate::geometry::Point;

/// The vertex at infinity. In an infinite cell it is the last corner.
pub(super) const INFINITE: u32 = 0;

/// For each corner, the corners of the opposite facet, such that facet and corner, in this order,
/// are positive.
pub(super) const FACETS: [[usize; 3]; 4] = [[1, 3, 2], [0, 2, 3], [0, 3, 1], [0, 1, 2]];

/// What is known of a cell while a point is inserted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Mark {
    /// Not met.
    Unseen,
    /// To be tested.
    Pending,
    /// In conflict with the point.
    Conflict,
    /// Tested, and not in conflict.
    Kept,
    /// Not a cell: its place is free.
    Free,
}

/// A point, its rank in the prepared order, and a label for temporary use.
#[derive(Clone, Copy, Debug)]
#[repr(align(32))]
pub(super) struct Vertex {
    pub at: Point<3>,
    pub rank: u32,
    /// Where the vertex stood in the latest list that it was in; see [`super::fill`].
    pub label: u32,
}

/// The corners of a cell and, opposite to each, the facet of the neighbour.
#[derive(Clone, Copy, Debug)]
#[repr(align(32))]
pub(super) struct Tetrahedron {
    pub corners: [u32; 4],
    pub neighbours: [u32; 4],
}

impl Tetrahedron {
    #[inline]
    pub fn is_infinite(&self) -> bool {
        self.corners[3] == INFINITE
    }
}

/// All cells, finite and infinite.
#[derive(Debug, Default)]
pub(super) struct Tetrahedra {
    pub cells: Vec<Tetrahedron>,
    pub marks: Vec<Mark>,
    free: Vec<u32>,
}

impl Tetrahedra {
    pub fn with_capacity(cells: usize) -> Self {
        Self { cells: Vec::with_capacity(cells), marks: Vec::with_capacity(cells), free: vec![] }
    }

    /// A place for a cell, to be overwritten.
    #[inline]
    pub fn allocate(&mut self) -> u32 {
        if let Some(place) = self.free.pop() {
            return place;
        }
        self.cells.push(Tetrahedron { corners: [0; 4], neighbours: [0; 4] });
        self.marks.push(Mark::Unseen);
        (self.cells.len() - 1) as u32
    }

    #[inline]
    pub fn release(&mut self, place: u32) {
        self.marks[place as usize] = Mark::Free;
        self.free.push(place);
    }
}
