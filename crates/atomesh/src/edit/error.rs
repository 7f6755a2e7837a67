//! Why edits are refused.

use super::AtomId;
use crate::mesh::ConnectError;
use crate::optimize::OptimizeError;

/// Why an edit was not made; nothing has changed then.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum EditError {
    /// There is no such atom, or no longer.
    #[error("there is no atom {atom}; it may have been removed")]
    NoAtom {
        /// The name used.
        atom: AtomId,
    },
    /// A place outside the box, or not finite.
    #[error("the place {point:?} is outside the box from {min:?} to {max:?}")]
    Outside {
        /// The place.
        point: Vec<f64>,
        /// The box's low corner.
        min: Vec<f64>,
        /// The box's high corner.
        max: Vec<f64>,
    },
    /// The atom is pinned.
    #[error("atom {atom} is pinned; unpin it first")]
    Pinned {
        /// The atom.
        atom: AtomId,
    },
    /// An atom would leave the corner, edge or side of the box that it keeps.
    #[error("atom {atom} would move along {}; the box holds it there", ["x", "y", "z"][*axis])]
    Held {
        /// The atom.
        atom: AtomId,
        /// 0 for x, 1 for y, 2 for z.
        axis: usize,
    },
    /// A corner of the box would be without an atom.
    #[error("atom {atom} is a corner of the box; the mesh needs it")]
    Corner {
        /// The atom.
        atom: AtomId,
    },
    /// Another atom is there.
    #[error("atom {atom} is at this place already")]
    Occupied {
        /// The other atom.
        atom: AtomId,
    },
    /// The reach of an optimization is no length.
    #[error("the reach is {value}; expected a length above 0")]
    Reach {
        /// The length asked for.
        value: f64,
    },
    /// The atoms could not be optimized.
    #[error(transparent)]
    Optimize(#[from] OptimizeError),
    /// The atoms could not be connected.
    #[error(transparent)]
    Connect(ConnectError),
}
