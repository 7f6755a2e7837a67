//! How good a mesh is: the shape of its cells, how well its facets follow the image, how well its cells carry it.
//!
//! Shape needs the mesh alone. Alignment compares it with *features*, the valleys of a potential
//! b(x), found with sub-sample accuracy; conformity compares the facets of each feature with the feature that they were
//! made to keep to. Fidelity rebuilds the image from the mesh. All give reports, plain numbers for people and for JSON,
//! and change nothing. All of it is the same code in 2-D and 3-D.

mod alignment;
mod angles;
mod cell_shape;
mod conformity;
mod faces;
mod features;
mod fidelity;
mod nearest;
mod precision;
mod shape;
mod statistics;

#[cfg(test)]
mod tests;

pub use alignment::{AlignmentOptions, AlignmentReport, alignment, alignment_of_faces};
pub use angles::{SpreadReport, WantedSize, spread};
pub use cell_shape::{CellShape, cell_shape};
pub use conformity::{
    Conforming, Conformity, ConformityReport, CrestDistance, FeatureConformity, NotMetPlace,
    conformity,
};
pub use features::{SampledPotential, features};
pub use fidelity::{FidelityReport, HomogeneityReport, fidelity, homogeneity};
pub use precision::{PrecisionOptions, PrecisionReport, precision};
pub use shape::{ShapeReport, shape, shapes};
pub use statistics::Histogram;

use crate::sample::SampleError;
use crate::watch::Cancelled;

/// Why a mesh cannot be measured.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MeasureError {
    /// A mesh without cells.
    #[error("a mesh without cells has no shape; it holds {points} points")]
    NoCells {
        /// How many points the mesh holds.
        points: usize,
    },
    /// No cell lies where labels are.
    #[error("none of {cells} cells has labels")]
    NoLabels {
        /// How many cells there are.
        cells: usize,
    },
    /// A nominal distance that is not a length.
    #[error("nominal distance {value} samples; expected a finite number above 0")]
    Size {
        /// The distance given, in samples.
        value: f64,
    },
    /// The number of samples differs from the shape's.
    #[error("a potential of {found} samples for a shape {shape:?}")]
    SampleCount {
        /// Samples along x, y (and z).
        shape: Vec<usize>,
        /// The number of samples given.
        found: usize,
    },
    /// The image cannot be sampled in the mesh's cells.
    #[error(transparent)]
    Sample(SampleError),
    /// The work was ended by its watch.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

impl From<SampleError> for MeasureError {
    fn from(error: SampleError) -> Self {
        match error {
            SampleError::Cancelled(cancelled) => Self::Cancelled(cancelled),
            _ => Self::Sample(error),
        }
    }
}
