//! `atomesh enhance`: from an image to the potential that attracts atoms.

use atomesh_job::JobError;
use atomesh_job::enhance::{EnhanceRequest, enhance_file};
use atomesh_job::files::shown;

use super::standard_output::StandardOutput;
use crate::progress::Progress;

/// Turn an image into the potential that attracts atoms
///
/// The potential is -1 in features and 0 elsewhere. `mesh` makes the same by --features before it fills the
/// image with atoms; this command writes it, to look at, to change, and to mesh many times by
/// `mesh --potential`.
#[derive(Debug, clap::Args)]
#[command(allow_negative_numbers = true, after_help = EXAMPLES)]
pub struct EnhanceArgs {
    #[command(flatten)]
    request: EnhanceRequest,
    #[command(flatten)]
    standard_output: StandardOutput,
}

const EXAMPLES: &str = "\
Examples:
  Faults in a seismic section, and half as strong its reflections:
    atomesh enhance section.sgy -o faults.npy --as faults,horizons:0.5 --picture faults.png
  Thin dark lines of a micrograph, as valleys of one depth and width:
    atomesh enhance micrograph.tif -o lines.npy --as ridges --polarity dark
  The outlines in a brain scan:
    atomesh enhance t1.nii.gz -o outlines.nii.gz --as edges --picture outlines.png";

/// Runs the command; the text is for standard output.
///
/// # Errors
/// [`JobError`] if a file cannot be used, options make no sense, or the user ends the work.
pub fn run(mut args: EnhanceArgs, progress: &mut Progress) -> Result<String, JobError> {
    args.standard_output.format(&mut args.request.output)?;
    let path = shown(&args.request.output);
    progress.job(
        |session| enhance_file(&args.request, session),
        |found, _| format!("{path}: {} in {:?} samples", found.mixture, found.shape),
    )?;
    Ok(String::new())
}
