//! `atomesh export`: Voronoi cells for other flow simulators.

use atomesh_job::JobError;
use atomesh_job::export::{ExportRequest, ExportSummary, export_file};

use crate::progress::Progress;

/// Write Voronoi cells for other flow simulators: connections with transmissibilities, or MODFLOW 6 grids
///
/// The transmissibility of a face of area A between two cells is m · A / (d₁/k₁ + d₂/k₂): d the distances of the
/// sites from it, k the permeabilities, m the multiplier of a barrier that it lies on. Faces of Voronoi cells stand
/// at right angles to the lines between sites, so this is exact for linear pressures and isotropic k; triangles
/// and tetrahedra are refused, since for them it is not.
///
/// A list of connections (.json) is NAME.json and NAME-cells.csv, NAME-connections.csv, NAME-boundary.csv beside it.
/// MODFLOW's grid is .disv for polygons, one layer of prisms, and .disu for polyhedra, with the permeability in
/// NAME.npf and barriers in NAME.hfb beside it. Polyhedra have a height of 1 in a .disu file and the area that makes
/// their volume: conductances and volumes are right for confined flow, tops and bottoms mean nothing.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  Cells and connections with transmissibilities, feature 1 sealed, feature 2 nearly so:
    atomesh mesh faults.png -o cells.vtu --mesh voronoi --connections cells.json
    atomesh export cells.json -o flow.json --permeability 2.5 --barrier feature-1=0 \\
      --barrier feature-2=0.01
  A layer 10 thick for MODFLOW 6, with permeability from a field of the cells:
    atomesh export cells.vtu -o layer.disv --permeability k --thickness 10")]
pub struct ExportArgs {
    #[command(flatten)]
    request: ExportRequest,
}

/// Runs the command; the text is for standard output.
///
/// # Errors
/// [`JobError`] if a file cannot be used, options make no sense, or the user ends the work.
pub fn run(args: &ExportArgs, progress: &mut Progress) -> Result<String, JobError> {
    let path = args.request.output.display();
    progress.job(
        |session| export_file(&args.request, session),
        |found, _| format!("{path}: {}", summary(found)),
    )?;
    Ok(String::new())
}

fn summary(found: &ExportSummary) -> String {
    let ExportSummary { cell_count, connections, sealed, least, greatest } = found;
    format!(
        "{cell_count} cells, {connections} connections, {sealed} of them sealed; transmissibilities \
         {least:.3e} to {greatest:.3e}"
    )
}
