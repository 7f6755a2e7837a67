//! The permeability of a mesh's cells.

use std::path::Path;

use atomesh::image::Image;
use atomesh::sample::{CellSurfaces, SampleOptions, Statistic, sample};
use atomesh_flow::Permeability;

use super::flow_mesh::{FlowMesh, FlowMeshCells};
use super::options::FlowOptions;
use crate::dimension::Dimension;
use crate::error::JobError;
use crate::images::{Beside, ImageRole};
use crate::options::FrameOptions;
use crate::permeability::given;
use crate::session::Session;

/// The permeability that options ask for.
///
/// # Errors
/// [`JobError`] if there is no such field, the numbers do not make a tensor, or the image cannot be used.
pub(super) fn permeability<const D: usize>(
    options: &FlowOptions,
    frame: &FrameOptions,
    mesh: &FlowMesh<D>,
    dimension: &Dimension<D>,
    session: &mut Session<'_>,
) -> Result<Permeability<D>, JobError> {
    let Some(path) = &options.permeability_image else {
        return given(&options.permeability, &mesh.cell_fields);
    };
    let beside = Beside { frame: mesh.frame.as_ref(), options: frame, role: ImageRole::Property };
    let image = beside.read(path, dimension, session)?;
    let statistic = options.permeability_mean.parse().map_err(JobError::misuse)?;
    let means = match &mesh.cells {
        FlowMeshCells::Voronoi { cells, .. } => means(&**cells, &image, statistic, path, session)?,
        FlowMeshCells::Simplices { mesh, .. } => means(mesh, &image, statistic, path, session)?,
    };
    Ok(Permeability::Cells(means))
}

/// The mean of the samples in each cell.
fn means<const D: usize>(
    cells: &impl CellSurfaces<D>,
    image: &Image<D>,
    statistic: Statistic,
    path: &Path,
    session: &mut Session<'_>,
) -> Result<Vec<f64>, JobError> {
    let statistics = [statistic];
    let found = sample(cells, image, SampleOptions::new(&statistics), session);
    let mut found = found.map_err(|e| JobError::from(e).about(path))?;
    Ok(found.values.swap_remove(0))
}
