//! The permeability of a mesh's cells.

use atomesh::sample::SampleOptions;
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
    let (own, provenance) = (mesh.frame.as_ref(), mesh.provenance.as_ref());
    let beside = Beside { frame: own, provenance, options: frame, role: ImageRole::Property };
    let image = beside.read(path, dimension, session)?;
    let statistic = options.permeability_mean.parse().map_err(JobError::misuse)?;
    let statistics = [statistic];
    let (tools, wanted) = (dimension.tools, SampleOptions::new(&statistics));
    let found = match &mesh.cells {
        FlowMeshCells::Voronoi { cells, .. } => {
            (tools.sample_cells)(cells, &image, wanted, session)
        }
        FlowMeshCells::Simplices { mesh, .. } => (tools.sample)(mesh, &image, wanted, session),
    };
    let mut found = found.map_err(|e| JobError::from(e).about(path))?;
    Ok(Permeability::Cells(found.values.swap_remove(0)))
}
