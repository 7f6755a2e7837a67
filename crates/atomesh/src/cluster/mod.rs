//! Cells of a mesh in clusters: parts that hang together and end at features (Hale & Emanuel 2003).
//!
//! Cells are the nodes of a [`CellGraph`]; between neighbours is a weight, small across features ([`SharedFacet`]). A [`ClusterTree`]
//! cuts all of them in two, and again and again the part whose cut is weakest for its size: the normalised cut of Shi &
//! Malik (2000), from the Fiedler vector (`fiedler`) of the part's graph. Each level of the tree has one part more, so that
//! the number of parts can be chosen afterwards. By hand two parts are made one ([`merge_parts`]), or one is cut in two
//! where a border between marked cells is weakest ([`split_part`]).
//!
//! Cost: about O(cells · log parts). One thread but for reading b: the same at any thread count.

mod bisect;
mod edit;
mod fiedler;
mod graph;
mod levels;
mod min_cut;
#[cfg(test)]
mod tests;
mod tree;
mod walled;
mod weights;

use crate::watch::Cancelled;
pub use edit::{merge_parts, split_part};
pub use graph::{CellGraph, Link};
pub use tree::{ClusterTree, Split};
pub use weights::{SharedFacet, WeightOptions, shared_faces, shared_facets};

/// How a tree of parts is grown.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ClusterOptions {
    /// The most parts of the finest level, 1 or more. Default 20.
    pub most_parts: usize,
    /// The least cells of a part, 1 or more. Default 8: fewer are specks between features.
    pub least_cells: usize,
}

impl Default for ClusterOptions {
    fn default() -> Self {
        Self { most_parts: 20, least_cells: 8 }
    }
}

impl ClusterOptions {
    fn check(&self) -> Result<(), ClusterError> {
        match (self.most_parts, self.least_cells) {
            (0, _) => Err(ClusterError::MostParts),
            (_, 0) => Err(ClusterError::LeastCells),
            _ => Ok(()),
        }
    }
}

/// Why cells could not be clustered, or parts not be changed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ClusterError {
    /// A link names a cell that does not exist.
    #[error("a link names cell {cell}; there are {count} cells")]
    Cell {
        /// The cell.
        cell: u32,
        /// How many cells there are.
        count: usize,
    },
    /// A link joins a cell to itself.
    #[error("cell {cell} is linked to itself; expected two cells")]
    Loop {
        /// The cell.
        cell: u32,
    },
    /// A weight is out of range.
    #[error("a weight is {value}; expected 0 to 1")]
    Weight {
        /// The weight.
        value: f64,
    },
    /// The contrast is no scale.
    #[error("the contrast is {value}; expected a number above 0")]
    Contrast {
        /// The contrast.
        value: f64,
    },
    /// A multiplier is out of range.
    #[error("a multiplier is {value}; expected 0 to 1")]
    Multiplier {
        /// The multiplier.
        value: f64,
    },
    /// A tree without parts.
    #[error("at most 0 parts; expected 1 or more")]
    MostParts,
    /// Parts without cells.
    #[error("parts of 0 cells; expected 1 or more")]
    LeastCells,
    /// There is not one part for each cell.
    #[error("{found} numbers of parts for {expected} cells")]
    PartCount {
        /// How many numbers.
        found: usize,
        /// How many cells.
        expected: usize,
    },
    /// No cell is of the part.
    #[error("no cell is of part {part}")]
    Part {
        /// The part.
        part: i32,
    },
    /// The greatest number is in use.
    #[error("no number is left for a new part; the greatest is in use")]
    NoNumber,
    /// A side is without a mark.
    #[error("no cell is marked on one of the sides; expected one or more on each")]
    NoMark,
    /// A marked cell is not of the part.
    #[error("cell {cell} is marked and not of the part")]
    Mark {
        /// The cell.
        cell: u32,
    },
    /// A cell is marked twice.
    #[error("cell {cell} is marked for both sides")]
    TwoMarks {
        /// The cell.
        cell: u32,
    },
    /// The caller ended the work.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}
