//! The third stage: atoms where they end.

use crate::conform;
use crate::lattice::{Lattice, Outlined};
use crate::mesh::{Mesh, merge_duplicates};
use crate::mirror::MirrorReport;
use crate::optimize::OptimizeReport;
use crate::region::{Outline, RegionError, Trimmed, fit_facets, smooth_outline, trim_to_outline};
use crate::voronoi::{sites_apart, voronoi};
use crate::watch::Watch;

use super::connected::Connected;
use super::divided::Divided;
use super::error::RunError;
use super::prepared::{Parts, Prepared};

/// Atoms whose energy is low: in features, and about d(x) apart.
#[derive(Clone, Debug)]
pub struct Settled<const D: usize> {
    pub(super) run: Prepared<D>,
    pub(super) lattice: Lattice<D>,
    pub(super) report: OptimizeReport,
    pub(super) mirror_report: Option<MirrorReport>,
}

impl<const D: usize> Settled<D> {
    /// What the run was prepared from.
    pub fn run(&self) -> &Prepared<D> {
        &self.run
    }

    /// The atoms.
    pub fn lattice(&self) -> &Lattice<D> {
        &self.lattice
    }

    /// The atoms, to go on with elsewhere, such as in an [`Editor`](crate::edit::Editor);
    /// [`Prepared::with_settled`] takes them back.
    pub fn into_lattice(self) -> Lattice<D> {
        self.lattice
    }

    /// How the atoms were moved.
    pub fn optimize_report(&self) -> &OptimizeReport {
        &self.report
    }

    /// Connects the atoms by Delaunay's rule; within a mask, only what is inside.
    ///
    /// # Errors
    /// [`RunError`] if the atoms make no mesh or the work was cancelled.
    pub fn connect(self, watch: &mut dyn Watch) -> Result<Connected<D>, RunError> {
        (self.run.parts().method.stages().connect)(self, watch)
    }

    /// Divides the box into Voronoi's cells, one around each atom.
    ///
    /// # Errors
    /// [`RunError`] if the atoms make no cells or the work was cancelled.
    pub fn divide(self, watch: &mut dyn Watch) -> Result<Divided<D>, RunError> {
        (self.run.parts().method.stages().divide)(self, watch)
    }
}

/// [`Settled::connect`].
pub(super) fn connect<const D: usize>(
    settled: Settled<D>,
    watch: &mut dyn Watch,
) -> Result<Connected<D>, RunError> {
    let Settled { run, lattice, report, mirror_report } = settled;
    let (mesh, freedom) = match run.outline() {
        Some(outline) => {
            let trimmed = connect_within(&run, lattice, outline, watch)?;
            (trimmed.mesh, trimmed.freedom)
        }
        None => connect_all(&run, lattice, watch)?,
    };
    Ok(Connected { run, mesh, freedom, report, mirror_report })
}

/// [`Settled::divide`].
pub(super) fn divide<const D: usize>(
    settled: Settled<D>,
    watch: &mut dyn Watch,
) -> Result<Divided<D>, RunError> {
    let connected = connect(settled, watch)?;
    let bounds = connected.run.bounds();
    let sites = sites_apart(&connected.mesh, &bounds);
    let delaunay = connected.run.parts().method.delaunay();
    let cells = voronoi(delaunay, &sites, bounds, watch)?;
    Ok(Divided { connected, cells })
}

/// Connects the atoms; with the axes along which the box lets each point move.
fn connect_all<const D: usize>(
    run: &Prepared<D>,
    lattice: Lattice<D>,
    watch: &mut dyn Watch,
) -> Result<(Mesh<D>, Vec<u8>), RunError> {
    // where the image alone counts, atoms may fall into the same corner
    let (points, merged) = merge_duplicates(lattice.atoms());
    if let (Some(pieces), true) = (run.pieces(), points.len() == lattice.len()) {
        let delaunay = run.parts().method.delaunay();
        let (lattice, mesh) = conform::connect(lattice, pieces, run.distance(), delaunay, watch)?;
        return Ok((mesh, lattice.freedom()));
    }
    let freedom = lattice.freedom_of(&merged, points.len());
    drop(lattice);
    Ok((run.parts().method.delaunay().connect(&points, watch)?, freedom))
}

/// Connects the atoms of a masked lattice and drops what is outside; points on the outline may not move
/// any more.
fn connect_within<const D: usize>(
    run: &Prepared<D>,
    lattice: Lattice<D>,
    outline: &Outline<D>,
    watch: &mut dyn Watch,
) -> Result<Trimmed<D>, RunError> {
    let (Parts { method, .. }, distance) = (run.parts(), run.distance());
    let outlined = Outlined::new(lattice, outline, distance);
    if outlined.lattice().len() <= D {
        return Err(RegionError::SmallMask { distance: distance.least() }.into());
    }
    let (outlined, mesh) = outlined.connect(method.delaunay(), outline, distance, watch)?;
    let freedom = outlined.lattice().freedom();
    let trimmed = trim_to_outline(mesh, outlined.on_outline(), &freedom, outline, watch)?;
    drop(outlined);
    let mut trimmed = fit_facets(smooth_outline(trimmed, outline, watch)?, outline)?;
    for &point in trimmed.facets.as_flattened() {
        trimmed.freedom[point as usize] = 0;
    }
    Ok(trimmed)
}
