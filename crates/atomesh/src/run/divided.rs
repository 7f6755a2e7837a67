//! The last stage on the way to Voronoi's cells, after the atoms have settled.

use crate::mesh::{Mesh, PolyMesh};
use crate::watch::Watch;

use super::connected::Connected;
use super::error::RunError;
use super::improved;
use super::outcome::Outcome;
use super::prepared::Prepared;

/// Voronoi's cells of the atoms, and the Delaunay mesh that they are dual to.
#[derive(Clone, Debug)]
pub struct Divided<const D: usize> {
    pub(super) connected: Connected<D>,
    pub(super) cells: PolyMesh<D>,
}

impl<const D: usize> Divided<D> {
    /// What the run was prepared from.
    pub fn run(&self) -> &Prepared<D> {
        &self.connected.run
    }

    /// The cells in lattice coordinates.
    pub fn cells(&self) -> &PolyMesh<D> {
        &self.cells
    }

    /// Delaunay's mesh of the atoms, in lattice coordinates.
    pub fn mesh(&self) -> &Mesh<D> {
        &self.connected.mesh
    }

    /// Labels the mesh and reads the fields at its points.
    ///
    /// # Errors
    /// [`RunError::Sample`], also when cancelled.
    pub fn finish(self, watch: &mut dyn Watch) -> Result<Outcome<D>, RunError> {
        (self.run().parts().method.stages().finish_divided)(self, watch)
    }
}

/// [`Divided::finish`].
pub(super) fn finish<const D: usize>(
    divided: Divided<D>,
    watch: &mut dyn Watch,
) -> Result<Outcome<D>, RunError> {
    let Divided { connected, cells } = divided;
    let outcome = improved::finish(connected.unimproved(), watch)?;
    Ok(Outcome { cells: Some(cells), ..outcome })
}
