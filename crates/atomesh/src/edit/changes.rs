//! What an edit changed.

use super::AtomId;
use crate::geometry::Point;

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

/// Cells that are no more and cells that are new, as in [`Changes`].
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct CellChanges {
    pub removed: Vec<u32>,
    pub added: Vec<u32>,
}

impl CellChanges {
    /// The difference of two sets of cells, which have `corner_count` corners each.
    pub fn between(mut before: Vec<u32>, mut after: Vec<u32>, corner_count: usize) -> Self {
        let (before, after) =
            (in_order(&mut before, corner_count), in_order(&mut after, corner_count));
        Self { removed: without(&before, &after), added: without(&after, &before) }
    }
}

/// The cells of one sorted list that are not in another, one after the other.
fn without(cells: &[&[u32]], others: &[&[u32]]) -> Vec<u32> {
    let mut rest = Vec::new();
    let mut others = others.iter().peekable();
    for cell in cells {
        while others.next_if(|other| *other < cell).is_some() {}
        if others.peek() != Some(&cell) {
            rest.extend_from_slice(cell);
        }
    }
    rest
}

/// Cells in the order of [`Changes`].
pub(super) fn in_order(corners: &mut [u32], corner_count: usize) -> Vec<&[u32]> {
    for cell in corners.chunks_exact_mut(corner_count) {
        if sort_by_swaps(cell) {
            cell.swap(corner_count - 2, corner_count - 1);
        }
    }
    let mut cells: Vec<&[u32]> = corners.chunks_exact(corner_count).collect();
    cells.sort_unstable();
    cells
}

/// Sorts a few numbers by swaps of neighbours; whether their number was odd.
pub(super) fn sort_by_swaps(numbers: &mut [u32]) -> bool {
    let mut odd = false;
    for end in (1..numbers.len()).rev() {
        for k in 0..end {
            if numbers[k] > numbers[k + 1] {
                numbers.swap(k, k + 1);
                odd = !odd;
            }
        }
    }
    odd
}
