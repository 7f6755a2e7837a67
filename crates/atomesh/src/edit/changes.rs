//! What an edit changed.

use super::AtomId;
use crate::geometry::Point;
use crate::mesh::CellChanges;

/// What an edit changed: cells that are no more, cells that are new, and atoms that moved.
///
/// A cell is the list of its D + 1 corners in a fixed order: ascending by [`AtomId`], but for the last two, which
/// are swapped where the cell's orientation, which is positive, needs it. Cells come in lexicographic order. A cell
/// that keeps its corners while these move is neither removed nor added. So the cells before an edit, without the
/// removed ones and with the added ones, are the cells after it.
#[derive(Clone, Debug, PartialEq)]
pub struct Changes<const D: usize> {
    removed: Vec<AtomId>,
    added: Vec<AtomId>,
    moves: Vec<AtomMove<D>>,
}

/// An atom's move.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AtomMove<const D: usize> {
    /// The atom.
    pub atom: AtomId,
    /// Where it was.
    pub from: Point<D>,
    /// Where it is.
    pub to: Point<D>,
}

impl<const D: usize> Changes<D> {
    pub(super) fn new(cells: CellChanges, moves: Vec<AtomMove<D>>) -> Self {
        let named = |atoms: Vec<u32>| atoms.into_iter().map(AtomId).collect();
        Self { removed: named(cells.removed), added: named(cells.added), moves }
    }

    /// The corners of the cells that are no more.
    pub fn cells_removed(&self) -> impl ExactSizeIterator<Item = &[AtomId]> {
        self.removed.chunks_exact(D + 1)
    }

    /// The corners of the cells that are new.
    pub fn cells_added(&self) -> impl ExactSizeIterator<Item = &[AtomId]> {
        self.added.chunks_exact(D + 1)
    }

    /// The atoms that moved, ascending; one that came or went is not among them.
    pub fn moves(&self) -> &[AtomMove<D>] {
        &self.moves
    }

    /// Whether nothing changed.
    pub fn is_empty(&self) -> bool {
        self.removed.is_empty() && self.added.is_empty() && self.moves.is_empty()
    }
}
