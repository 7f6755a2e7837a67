//! `atomesh clusters`: the cells of a mesh in parts that end at features.

use atomesh_job::JobError;
use atomesh_job::clusters::{ClustersRequest, ClustersSummary, clusters_file};

use super::standard_output::StandardOutput;
use crate::progress::Progress;

/// Part the cells of a mesh at features of an image: units between faults, organs, grains
///
/// Between cells that share a facet is a weight: large where the facet is, small where the potential b is low along it, 0
/// where the mesh names it as a feature's. Cells are cut in two where weights are least for the size of both sides
/// (normalised cuts of Shi & Malik), and again and again the part that is cut most easily, until there are as many as
/// asked for. So parts of a run with more of them lie within those of a run with fewer. Part 1 keeps most cells at every
/// cut.
///
/// b comes from an image, by the options of features below, or from a potential; without either it is the mesh's own field
/// `potential`, which is known at points alone and therefore poorer.
#[derive(Debug, clap::Args)]
#[command(
    allow_negative_numbers = true,
    after_help = "\
Examples:
  atomesh mesh faults.png -o faults.vtu --size 8
  atomesh clusters faults.vtu faults.png --parts 20 -o blocks.vtu --picture blocks.png
  atomesh surfaces blocks.vtu --region region-3 -o block.obj"
)]
pub struct ClustersArgs {
    #[command(flatten)]
    request: ClustersRequest,
    #[command(flatten)]
    standard_output: StandardOutput,
}

/// Runs the command; the text is for standard output.
///
/// # Errors
/// [`JobError`] if a file cannot be used or options make no sense.
pub fn run(mut args: ClustersArgs, progress: &mut Progress) -> Result<String, JobError> {
    args.standard_output.format_any(&mut args.request.output)?;
    let mesh = args.request.mesh.display().to_string();
    let words = |found: &ClustersSummary, _| {
        let ClustersSummary { parts, cells: [least, most] } = found;
        format!("{mesh}: {parts} parts of {least} to {most} cells")
    };
    progress.job(|session| clusters_file(&args.request, session), words)?;
    Ok(String::new())
}
