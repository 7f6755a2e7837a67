//! The commands, one file each.

pub mod check;
pub mod completions;
pub mod enhance;
pub mod export;
pub mod features;
pub mod flow;
pub mod info;
pub mod man;
pub mod mesh;
pub mod report;
pub mod sample;
pub mod synth;

use atomesh::enhance::EnhanceError;
use atomesh::measure::MeasureError;

use crate::failure::Failure;

/// What measuring refuses, in the user's terms.
fn measure_failure(error: MeasureError) -> Failure {
    match error {
        MeasureError::Cancelled(_) => Failure::cancelled(),
        _ => Failure::content(error),
    }
}

/// Whether an option is to blame, and not the image.
pub fn is_option(error: &EnhanceError) -> bool {
    use EnhanceError::{Denoise, EdgeScale, Option, Smooth};
    matches!(error, EdgeScale { .. } | Smooth { .. } | Denoise(_) | Option { .. })
}
