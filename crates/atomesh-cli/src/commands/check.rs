//! `atomesh check`: whether a mesh keeps its promises.

use std::path::PathBuf;

use atomesh::mesh::Mesh;
use atomesh_io::mesh::AnyMesh;
use atomesh_job::{Dimension, JobError, mesh_file};

/// Check that a mesh is valid
///
/// By exact arithmetic: every cell has positive measure, at most two cells meet in a facet and lie on
/// different sides of it, and every point is a corner. The first fault is named, with exit code 1.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  atomesh check mesh.vtu")]
pub struct CheckArgs {
    /// Mesh to check: .vtu .vtk .msh .msh2 .npz .inp
    #[arg(value_name = "MESH")]
    mesh: PathBuf,
}

/// Runs the command; the text is for standard output.
///
/// # Errors
/// [`JobError`] if the file holds no mesh, or one that breaks a promise.
pub fn run(args: &CheckArgs) -> Result<String, JobError> {
    let verdict = match &mesh_file::read(&args.mesh)? {
        AnyMesh::Flat(loaded) => verdict(&loaded.mesh, &Dimension::plane()),
        AnyMesh::Volume(loaded) => verdict(&loaded.mesh, &Dimension::space()),
    };
    let verdict = verdict.map_err(|f| f.about(&args.mesh))?;
    Ok(format!("{}: {verdict}\n", args.mesh.display()))
}

fn verdict<const D: usize>(mesh: &Mesh<D>, dimension: &Dimension<D>) -> Result<String, JobError> {
    mesh.validate().map_err(JobError::content)?;
    let (points, cells) = (mesh.points().len(), mesh.cell_count());
    Ok(format!("valid, {points} points, {cells} {}", dimension.cells))
}
