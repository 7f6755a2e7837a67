//! The fourth stage: Delaunay's mesh of the atoms.

use crate::conform::feature_facets;
use crate::improve::{Align, Held};
use crate::mesh::Mesh;
use crate::mirror::MirrorReport;
use crate::optimize::OptimizeReport;
use crate::watch::Watch;

use super::error::RunError;
use super::improved::Improved;
use super::prepared::{Parts, Prepared};

/// Delaunay's mesh of the atoms, as it is before facets are turned onto features.
#[derive(Clone, Debug)]
pub struct Connected<const D: usize> {
    pub(super) run: Prepared<D>,
    pub(super) mesh: Mesh<D>,
    /// The axes along which each point may move, as bits.
    pub(super) freedom: Vec<u8>,
    pub(super) report: OptimizeReport,
    pub(super) mirror_report: Option<MirrorReport>,
}

impl<const D: usize> Connected<D> {
    /// What the run was prepared from.
    pub fn run(&self) -> &Prepared<D> {
        &self.run
    }

    /// The mesh in lattice coordinates.
    pub fn mesh(&self) -> &Mesh<D> {
        &self.mesh
    }

    /// Turns facets onto features and mends badly shaped cells, as
    /// [`MeshOptions::improve`](super::MeshOptions::improve) asks; with [`Align::Off`] the mesh stays as it is.
    ///
    /// # Errors
    /// [`RunError::Improve`], also when cancelled.
    pub fn improve(self, watch: &mut dyn Watch) -> Result<Improved<D>, RunError> {
        (self.run.parts().method.stages().improve)(self, watch)
    }

    /// The mesh as it is, as the next stage.
    pub(super) fn unimproved(self) -> Improved<D> {
        let Self { run, mesh, report, mirror_report, .. } = self;
        Improved { run, mesh, report, mirror_report, improve_report: None }
    }
}

/// [`Connected::improve`].
pub(super) fn improve<const D: usize>(
    connected: Connected<D>,
    watch: &mut dyn Watch,
) -> Result<Improved<D>, RunError> {
    let Parts { method, options, .. } = connected.run.parts();
    let (Some(improver), false) = (method.improver(), options.improve.align == Align::Off) else {
        return Ok(connected.unimproved());
    };
    let Connected { run, mesh, freedom, report, mirror_report } = connected;
    let options = &run.options().improve;
    let facets: Vec<[u32; D]> = match run.pieces() {
        Some(pieces) => (feature_facets(&mesh, pieces, run.distance()).iter())
            .map(|facet| facet.corners)
            .collect(),
        None => Vec::new(),
    };
    let held = Held { freedom: &freedom, facets: &facets };
    let (mesh, improved) = improver.improve(mesh, held, run.fields(), options, watch)?;
    Ok(Improved { run, mesh, report, mirror_report, improve_report: Some(improved) })
}
