//! `atomesh check`: whether a mesh keeps its promises.

use std::path::PathBuf;

use atomesh::mesh::Mesh;
use atomesh_io::mesh::AnyMesh;

use crate::failure::Failure;
use crate::mesh_file;

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
/// [`Failure`] if the file is no mesh or the mesh breaks a promise.
pub fn run(args: &CheckArgs) -> Result<String, Failure> {
    let verdict = match &mesh_file::read(&args.mesh)? {
        AnyMesh::Flat(loaded) => verdict(&loaded.mesh, "triangles"),
        AnyMesh::Volume(loaded) => verdict(&loaded.mesh, "tetrahedra"),
    };
    let verdict = verdict.map_err(|f| f.about(&args.mesh))?;
    Ok(format!("{}: {verdict}\n", args.mesh.display()))
}

fn verdict<const D: usize>(mesh: &Mesh<D>, cells: &str) -> Result<String, Failure> {
    mesh.validate().map_err(Failure::content)?;
    Ok(format!("valid, {} points, {} {cells}", mesh.points().len(), mesh.cell_count()))
}
