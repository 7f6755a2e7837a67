//! `atomesh sample`: properties of cells from images.

use atomesh_job::JobError;
use atomesh_job::files::shown;
use atomesh_job::sample::{SampleRequest, sample_file};

use super::standard_output::StandardOutput;
use crate::progress::Progress;

/// Give each cell of a mesh the mean, total or majority of an image inside it
///
/// Every sample stands for the box around it and counts by the exact volume (2-D: area) of that box that lies in
/// the cell. Boxes are cut at the rim of the image, where meshes end, so totals are conserved: over a mesh that
/// fills the image's box, the totals of cells sum to that of the image.
///
/// Points, fields, frame and metadata of the mesh are kept. With one statistic the field is called NAME, with
/// more NAME-mean, NAME-std and so on. Where cells have samples in a part of them only, the field NAME-coverage
/// says in which.
#[derive(Debug, clap::Args)]
#[command(
    mut_arg("fill", |arg| arg.help("Value that replaces NaN samples. Default: NaN samples are ignored")),
    after_help = "\
Examples:
  Mean porosity, harmonic mean and extremes of permeability:
    atomesh sample mesh.vtu --image porosity=phi.npy -o cells.vtu
    atomesh sample mesh.vtu --image k=perm.npy --statistic harmonic --statistic min --statistic max \\
      -o cells.vtu
  The tissue that fills the most of each cell, and how much of it:
    atomesh sample brain.vtu --image tissue=labels.nii.gz --statistic majority \\
      --statistic homogeneity -o tissues.vtu"
)]
pub struct SampleArgs {
    #[command(flatten)]
    request: SampleRequest,
    #[command(flatten)]
    standard_output: StandardOutput,
}

/// Runs the command; the text is for standard output.
///
/// # Errors
/// [`JobError`] if a file cannot be used, options make no sense, or the user ends the work.
pub fn run(mut args: SampleArgs, progress: &mut Progress) -> Result<String, JobError> {
    args.standard_output.format(&mut args.request.output)?;
    let path = shown(&args.request.output);
    progress.job(
        |session| sample_file(&args.request, session),
        |found, _| format!("{path}: {} cells with {}", found.cell_count, found.fields.join(", ")),
    )?;
    Ok(String::new())
}
