//! The format of what goes to standard output.

use std::path::PathBuf;

use atomesh_job::{JobError, files};

/// The format of standard output, which has no name to tell it.
#[derive(Debug, clap::Args)]
pub struct StandardOutput {
    /// Format of what `-o -` writes to standard output, as an extension: vtu, npy, png ...
    #[arg(long, value_name = "EXT", help_heading = "Output")]
    format: Option<String>,
}

impl StandardOutput {
    /// Gives the output that a user names its format, if it is standard output.
    ///
    /// # Errors
    /// [`JobError`] if standard output has no format, or another file one.
    pub fn format(&self, output: &mut PathBuf) -> Result<(), JobError> {
        *output = files::with_format(output, self.format.as_deref())?;
        Ok(())
    }

    /// The same where an output may be named.
    ///
    /// # Errors
    /// [`JobError`] too if there is a format and no output.
    pub fn format_any(&self, output: &mut Option<PathBuf>) -> Result<(), JobError> {
        match (output, &self.format) {
            (Some(output), _) => self.format(output),
            (None, None) => Ok(()),
            (None, Some(format)) => {
                let message = format!("--format {format} without -o; expected -o - beside it");
                Err(JobError::misuse(message))
            }
        }
    }
}
