//! Which part of the box is meshed, and to which region each cell belongs.
//!
//! - [`Outline`]: the smooth outline of a mask. Atoms are drawn to it, grown on it, and put onto it.
//! - [`trim_to_outline`] drops the cells outside of the outline; the boundary of what is left is a manifold.
//! - [`smooth_outline`] moves points on and beside the outline to better places, [`fit_facets`] makes up for what facets
//!   cut off.
//! - [`interfaces`] lie between cells of two labels, a [`closed_surface`] bounds those of one; [`join_islands`] removes
//!   small groups of cells. A [`ThinLayer`] of a label is too thin for the edges asked for.
//! - [`components`] are the parts into which facets cut a mesh.
//! - Labels given to the cells of one mesh are carried to another ([`CellFinder`]), with atoms that moved ([`AtomMoves`]).
//!
//! Outlines come before the lattice, which grows on them; labels need only a mesh.

mod adjust;
mod carry;
mod components;
mod islands;
mod labels;
mod layers;
mod manifold;
mod outline;
mod regularity;
mod trim;

pub use adjust::{fit_facets, smooth_outline};
pub use carry::{AtomMoves, CellFinder};
pub use components::components;
pub(crate) use islands::fill_labels;
pub use islands::join_islands;
pub use labels::{Interface, closed_surface, interfaces, label_samples};
pub use layers::ThinLayer;
pub(crate) use layers::{LabelImage, thin_layers};
pub use outline::{Outline, samples_inside};
pub(crate) use trim::free_axes;
pub use trim::{Trimmed, outline_facets, trim_to_outline};

use crate::fields::DistanceError;
use crate::fields::FieldError;
use crate::mesh::MeshError;
use crate::watch::Cancelled;

/// Why a region could not be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RegionError {
    /// No sample of a mask is inside.
    #[error("none of the {count} samples of the mask is inside; expected some that are not 0")]
    EmptyMask {
        /// How many there are.
        count: usize,
    },
    /// The inside of a mask is smaller than a cell.
    #[error(
        "no cell of nominal distance {distance} fits into the mask; expected a mask that is thicker, or \
         a smaller distance"
    )]
    SmallMask {
        /// The least nominal distance.
        distance: f64,
    },
    /// A sample is not finite.
    #[error("sample {index} is {value}; expected a finite number")]
    NotFinite {
        /// The sample's index, x fastest.
        index: usize,
        /// Its value.
        value: f32,
    },
    /// A label is no integer.
    #[error("sample {index} is {value}; a label is an integer of 32 bits")]
    Label {
        /// The sample's index, x fastest.
        index: usize,
        /// Its value.
        value: f64,
    },
    /// The distance from the mask cannot be computed on its grid.
    #[error(transparent)]
    Distance(#[from] DistanceError),
    /// The mask makes no field.
    #[error(transparent)]
    Potential(#[from] FieldError),
    /// The result was no mesh.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// The caller ended the work.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}
