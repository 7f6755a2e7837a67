//! Cells and vertices in flat arrays; the places of freed cells are reused.
//!
//! A facet is named by its cell and the corner opposite to it: `4 · cell + corner`. A cell keeps, for
//! each corner, the facet of the neighbour that is this facet seen from the other side.

use crate::geometry::Point;

/// The vertex at infinity. In an infinite cell it is the last corner.
pub(super) const INFINITE: u32 = 0;

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
pub(super) struct Vertex<const D: usize> {
    pub at: Point<D>,
    pub rank: u32,
    /// Where the vertex stood in the latest list that it was in; see [`super::fill`].
    pub label: u32,
}

/// The corners of a cell and, opposite to each, the facet of the neighbour.
#[derive(Clone, Copy, Debug)]
#[repr(align(32))]
pub(super) struct Cell<const N: usize> {
    pub corners: [u32; N],
    pub neighbours: [u32; N],
}

impl<const N: usize> Cell<N> {
    #[inline]
    pub fn is_infinite(&self) -> bool {
        self.corners[N - 1] == INFINITE
    }

    /// Of an infinite cell: the finite one behind its facet.
    #[inline]
    pub fn behind(&self) -> u32 {
        self.neighbours[N - 1] >> 2
    }
}

/// All cells, finite and infinite.
#[derive(Debug, Default)]
pub(super) struct Cells<const N: usize> {
    pub list: Vec<Cell<N>>,
    pub marks: Vec<Mark>,
    free: Vec<u32>,
}

impl<const N: usize> Cells<N> {
    pub fn with_capacity(cells: usize) -> Self {
        Self { list: Vec::with_capacity(cells), marks: Vec::with_capacity(cells), free: vec![] }
    }

    /// A place for a cell, to be overwritten.
    #[inline]
    pub fn allocate(&mut self) -> u32 {
        if let Some(place) = self.free.pop() {
            return place;
        }
        self.list.push(Cell { corners: [0; N], neighbours: [0; N] });
        self.marks.push(Mark::Unseen);
        (self.list.len() - 1) as u32
    }

    #[inline]
    pub fn release(&mut self, place: u32) {
        self.marks[place as usize] = Mark::Free;
        self.free.push(place);
    }
}
