//! `atomesh replay`: the mesh of a studio's session, without a page.

use std::path::PathBuf;

use atomesh_job::JobError;
use atomesh_job::files::shown;

use crate::progress::Progress;

/// Make the mesh of a studio's session from its log
///
/// What was done on the page is done again, to the same bytes, at any number of threads.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Example:
  atomesh replay faults-studio/log.jsonl -o faults.vtu")]
pub struct ReplayArgs {
    /// Log of the session, log.jsonl in its folder
    #[arg(value_name = "LOG")]
    log: PathBuf,
    /// Mesh to write: .vtu .vtk .msh .msh2 .npz .inp, or a folder named polyMesh
    #[arg(short, long, value_name = "MESH")]
    output: PathBuf,
}

/// Runs the command; the text is for standard output.
///
/// # Errors
/// [`JobError`] if the log or an image cannot be used, or the mesh cannot be written.
pub fn run(args: &ReplayArgs, progress: &mut Progress) -> Result<String, JobError> {
    atomesh_studio::replay::replay(&args.log, &args.output, progress)?;
    progress.finish();
    progress.tell(&format!("{} written", shown(&args.output)));
    Ok(String::new())
}
