//! Which part of the box is meshed, and to which region each cell belongs.
//!
//! - [`Outline`]: the smooth outline of a mask. Atoms are drawn to it, grown on it, and put onto it.
//! - [`trim`]: drops the cells outside of the outline, so that what is left has a manifold boundary on it.
//! - [`smooth`]: moves points at and near the outline to better places on it, and fits facets to it.
//! - [`interfaces`] between cells of different labels, and [`islands`] of few cells among others.
//! - [`components`]: the parts into which facets cut a mesh.
//!
//! A mask stands above the lattice, which grows on it; labels need but a mesh.

mod carve;
mod components;
mod labels;
mod outline;
mod smooth;
mod trim;

pub use components::components;
pub use labels::{interfaces, islands, label_samples};
pub use outline::Outline;
pub use smooth::{fit, smooth};
pub(crate) use trim::free_axes;
pub use trim::{Trimmed, outline_facets, trim};

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
    /// What is inside of a mask is smaller than a cell.
    #[error(
        "no cell of nominal distance {distance} fits into the mask; expected a mask that is thicker, or \
         a smaller distance"
    )]
    SmallMask {
        /// The least nominal distance.
        distance: f64,
    },
    /// A sample is infinite or NaN.
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
    /// The mask has an odd place in lattice space.
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
