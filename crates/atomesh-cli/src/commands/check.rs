//! `atomesh check`: whether a mesh keeps its promises.

use std::path::PathBuf;

use atomesh::mesh::Mesh;
use atomesh::watch::Watch;
use atomesh_io::mesh::cells::LoadedCells;
use atomesh_job::mesh_file::{self, MeshFile};
use atomesh_job::{Dimension, JobError};

/// Check that a mesh is valid
///
/// By exact arithmetic: every cell has positive measure, at most two cells meet in a facet and lie on
/// different sides of it, and every point is a corner. Voronoi cells: every cell is closed, convex and holds its site,
/// faces are flat, those at the border lie on the sides of the image's box, and the cells fill it, all up to the rounding
/// of coordinates. The first fault is named, with exit code 1.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  atomesh check mesh.vtu")]
pub struct CheckArgs {
    /// Mesh to check: .vtu .vtk .msh .msh2 .npz .inp; or Voronoi cells that atomesh wrote: .vtu
    #[arg(value_name = "MESH")]
    mesh: PathBuf,
}

/// Runs the command; the text is for standard output.
///
/// # Errors
/// [`JobError`] if the file holds no mesh, or one that breaks a promise.
pub fn run(args: &CheckArgs, watch: &mut dyn Watch) -> Result<String, JobError> {
    let verdict = match &mesh_file::read(&args.mesh, watch)? {
        MeshFile::Flat(loaded) => verdict(&loaded.mesh, &Dimension::plane()),
        MeshFile::Volume(loaded) => verdict(&loaded.mesh, &Dimension::space()),
        MeshFile::Polygons(cells) => verdict_of_cells(cells, &Dimension::plane()),
        MeshFile::Polyhedra(cells) => verdict_of_cells(cells, &Dimension::space()),
    };
    let verdict = verdict.map_err(|f| f.about(&args.mesh))?;
    Ok(format!("{}: {verdict}\n", args.mesh.display()))
}

fn verdict<const D: usize>(mesh: &Mesh<D>, dimension: &Dimension<D>) -> Result<String, JobError> {
    mesh.validate().map_err(JobError::content)?;
    let (points, cells) = (mesh.points().len(), mesh.cell_count());
    Ok(format!("valid, {points} points, {cells} {}", dimension.cells))
}

fn verdict_of_cells<const D: usize>(
    cells: &LoadedCells<D>,
    dimension: &Dimension<D>,
) -> Result<String, JobError> {
    cells.validate().map_err(JobError::content)?;
    let (points, count) = (cells.mesh.points().len(), cells.mesh.cell_count());
    Ok(format!("valid, {points} points, {count} {}", dimension.voronoi_cells))
}
