//! The second stage: atoms that fill the box, not yet moved by the image.

use crate::conform::conform;
use crate::crests::repelling_crests;
use crate::lattice::Lattice;
use crate::mirror::{MirroredLattice, Settling, mirror};
use crate::optimize::{OptimizeReport, optimize};
use crate::watch::Watch;

use super::error::RunError;
use super::prepared::{Parts, Prepared};
use super::settled::Settled;

/// Atoms that fill the box, about d(x) apart, not yet moved by the image.
#[derive(Clone, Debug)]
pub struct Filled<const D: usize> {
    run: Prepared<D>,
    lattice: Lattice<D>,
}

impl<const D: usize> Filled<D> {
    pub(super) fn new(run: Prepared<D>, lattice: Lattice<D>) -> Self {
        Self { run, lattice }
    }

    /// What the run was prepared from.
    pub fn run(&self) -> &Prepared<D> {
        &self.run
    }

    /// The atoms.
    pub fn lattice(&self) -> &Lattice<D> {
        &self.lattice
    }

    /// The atoms, to go on with elsewhere.
    pub fn into_lattice(self) -> Lattice<D> {
        self.lattice
    }

    /// Moves the atoms to lower their energy (Hale 2001, algorithm 3). For Voronoi's cells, where
    /// [`MeshOptions::mirror`](super::MeshOptions::mirror) asks for it and features repel, pairs of atoms are
    /// put across these first.
    ///
    /// # Errors
    /// [`RunError`] if the energy is not finite or the work was cancelled.
    pub fn settle(self, watch: &mut dyn Watch) -> Result<Settled<D>, RunError> {
        (self.run.parts().method.stages().settle)(self, watch)
    }
}

/// [`Filled::settle`].
pub(super) fn settle<const D: usize>(
    filled: Filled<D>,
    watch: &mut dyn Watch,
) -> Result<Settled<D>, RunError> {
    let Filled { run, lattice } = filled;
    let Parts { method, options, .. } = run.parts();
    let options = &options.optimize;
    let is_pulled = run.fields().weight.as_constant() != Some(0.0);
    let crests = match run.faced().filter(|_| is_pulled) {
        Some(pieces) => pieces.points().map(|(point, _)| *point).collect(),
        None if run.pairs_atoms() => repelling_crests(run.fields(), watch)?,
        None => Vec::new(),
    };
    if !crests.is_empty() {
        let settling = Settling { scatterer: method.scatterer(), options };
        let MirroredLattice { lattice, report, optimize_report } =
            mirror(lattice, &crests, run.fields(), settling, watch)?;
        return Ok(Settled { run, lattice, report: optimize_report, mirror_report: Some(report) });
    }
    if let Some(pieces) = run.pieces() {
        let (lattice, report) =
            conform(lattice, pieces, run.fields(), method.scatterer(), options, watch)?;
        return Ok(Settled { run, lattice, report, mirror_report: None });
    }
    if run.stays_as_grown() {
        let report = OptimizeReport::new(options.engine);
        return Ok(Settled { run, lattice, report, mirror_report: None });
    }
    let (lattice, report) = optimize(lattice, run.fields(), options, watch)?.into_parts();
    Ok(Settled { run, lattice, report, mirror_report: None })
}
