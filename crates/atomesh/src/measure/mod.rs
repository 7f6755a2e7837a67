//! How good a mesh is: the shape of its cells, and how well its facets follow the image.
//!
//! Shape needs the mesh alone. Alignment compares it with *features*, the valleys of a potential
//! b(x), found with sub-sample accuracy. Both are reports, plain numbers for people and for JSON;
//! neither changes anything. All of it is the same code in 2-D and 3-D.

mod alignment;
mod faces;
mod features;
mod nearest;
mod shape;
mod statistics;

#[cfg(test)]
mod tests;

pub use alignment::{AlignmentOptions, AlignmentReport, alignment};
pub use features::{Features, features};
pub use shape::{CellShape, ShapeReport, cell_shape, shape, shapes};
pub use statistics::Histogram;

use crate::watch::Cancelled;

/// Why a mesh cannot be measured.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MeasureError {
    /// There is nothing to measure.
    #[error("a mesh without cells has no shape; it holds {points} points")]
    NoCells {
        /// How many points the mesh holds.
        points: usize,
    },
    /// The nominal distance cannot set the scale of features.
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
    /// The work was ended by its watch.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}
