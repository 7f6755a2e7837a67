//! What enhancing refuses.

use super::{DenoiseError, LEAST_EDGE_SCALE};
use crate::watch::Cancelled;

/// Why there is no potential.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum EnhanceError {
    /// Samples are NaN or infinite.
    #[error(
        "{count} samples are not finite, the first of them sample {first}, which is {value}; \
         expected finite samples"
    )]
    NotFinite {
        /// How many samples are NaN or infinite.
        count: usize,
        /// The index of the first of them, x fastest.
        first: usize,
        /// The first of them.
        value: f64,
    },
    /// A sample of a given potential is outside −1…1.
    #[error("sample {index} is {value}; a potential lies in -1…1, and bytes are not rescaled")]
    OutOfRange {
        /// The index of the sample, x fastest.
        index: usize,
        /// The sample.
        value: f32,
    },
    /// The standard deviation of the edge operator is not a finite number from 0.3.
    #[error("edge scale {value}; expected a finite number of samples, {LEAST_EDGE_SCALE} or more")]
    EdgeScale {
        /// The scale found.
        value: f64,
    },
    /// The standard deviation of the smoothing is not a finite number from 0.
    #[error("smoothing {value}; expected a finite number of lattice units, 0 or more")]
    Smooth {
        /// The standard deviation found.
        value: f64,
    },
    /// A label is not an integer.
    #[error("sample {index} is {value}; a label is an integer")]
    Label {
        /// The sample's index, x fastest.
        index: usize,
        /// Its value.
        value: f32,
    },
    /// Values that cannot be labels, as each lies all over the image.
    #[error("{count} different samples, each all over the image; expected labels, not grey values")]
    Labels {
        /// How many different samples there are.
        count: usize,
    },
    /// Why the image was not denoised.
    #[error(transparent)]
    Denoise(DenoiseError),
    /// An option of how crests are found is out of its range.
    #[error("{option} of {kind} is {value}; expected {least} to {most}")]
    Option {
        /// What is searched for.
        kind: &'static str,
        /// The option.
        option: &'static str,
        /// Its value.
        value: f64,
        /// The least that it may be.
        least: f64,
        /// The greatest that it may be.
        most: f64,
    },
    /// The watch ended the work.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

impl From<DenoiseError> for EnhanceError {
    fn from(error: DenoiseError) -> Self {
        match error {
            DenoiseError::Cancelled(cancelled) => Self::Cancelled(cancelled),
            other => Self::Denoise(other),
        }
    }
}

/// The greatest width of Gaussians and reaches, in samples: beyond it nothing of an image is left.
pub(super) const LONGEST: f64 = 1000.0;

/// The greatest length that a feature may be asked to have, in samples.
pub(super) const MOST_EXTENT: f64 = 1e6;

/// An option and its range, ends included.
pub(super) struct Within {
    pub option: &'static str,
    pub value: f64,
    pub least: f64,
    pub most: f64,
}

/// Refuses the first of some options that is not within its range; `kind` is what is looked for.
pub(super) fn within(
    kind: &'static str,
    options: impl IntoIterator<Item = Within>,
) -> Result<(), EnhanceError> {
    for Within { option, value, least, most } in options {
        if !(least..=most).contains(&value) {
            return Err(EnhanceError::Option { kind, option, value, least, most });
        }
    }
    Ok(())
}
