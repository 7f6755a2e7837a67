//! Meshes as files.

use std::path::PathBuf;

use atomesh_job::options::{OutputOptions, RunConfig};
use atomesh_job::sample::{Property, SampledMesh};
use atomesh_job::{Dimension, JobError, Session};

use super::Made;

/// Writes a mesh: one that was made with all that the options name, one that was read alone.
pub fn written<const D: usize>(
    made: Option<&Made<D>>,
    loaded: &impl SampledMesh<D>,
    output: OutputOptions,
    properties: &[Property],
    dimension: &Dimension<D>,
    session: &mut Session<'_>,
) -> Result<(), JobError> {
    if let Some(made) = made {
        let run = RunConfig { output, ..made.run.clone() };
        return made.as_job(&run, properties).write(dimension, session).map(drop);
    }
    let path = output_alone(output)?;
    loaded.check_output(&path)?;
    session.write_together(|group, session| {
        let staged = atomesh_job::files::stage(&path, group)?;
        loaded.write(&staged, properties, dimension, session)
    })
}

/// The file of a mesh that was read, where nothing is to be written beside it.
fn output_alone(output: OutputOptions) -> Result<PathBuf, JobError> {
    let path = output.output.clone().unwrap_or_default();
    if output == (OutputOptions { output: Some(path.clone()), ..Default::default() }) {
        return Ok(path);
    }
    Err(JobError::misuse("options of writing are for meshes made from an image; expected none"))
}
