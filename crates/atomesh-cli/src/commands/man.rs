//! `atomesh man`: manual pages.

use std::path::{Path, PathBuf};
use std::{fs, io};

use atomesh_io::output_group::OutputGroup;
use atomesh_job::JobError;

use crate::progress::writing;

/// Print the manual page, or write one for every command
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  atomesh man | man -l -\n  atomesh man -o ~/.local/share/man/man1"
)]
pub struct ManArgs {
    /// Folder for atomesh.1, atomesh-mesh.1 ...; it must exist
    #[arg(short, long, value_name = "FOLDER")]
    output: Option<PathBuf>,
}

/// Runs the command; the text is for standard output.
///
/// # Errors
/// [`JobError`] if a page cannot be written.
pub fn run(args: &ManArgs, mut command: clap::Command) -> Result<String, JobError> {
    let Some(folder) = &args.output else {
        let mut page = Vec::new();
        clap_mangen::Man::new(command).render(&mut page).map_err(JobError::content)?;
        return Ok(String::from_utf8_lossy(&page).into_owned());
    };
    let _guard = writing();
    // a page for `help` would say what `--help` says
    command = command.disable_help_subcommand(true);
    write(command, folder).map_err(|e| JobError::unwritable(&e).about(folder))?;
    Ok(String::new())
}

/// Writes all pages into a folder, or none.
fn write(command: clap::Command, folder: &Path) -> io::Result<()> {
    if !folder.metadata()?.is_dir() {
        return Err(io::Error::from(io::ErrorKind::NotADirectory));
    }
    let mut group = OutputGroup::default();
    let staged = group.stage_folder(folder)?;
    fs::create_dir(&staged)?;
    clap_mangen::generate_to(command, &staged)?;
    group.place().map_err(|e| e.error)
}
