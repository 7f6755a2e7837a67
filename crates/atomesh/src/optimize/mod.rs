//! Moving the atoms to lower the total potential energy (Hale 2001, algorithm 3).
//!
//! Two nested loops: the outer perturbs the atoms a little, at random and seeded, so that the lattice may
//! leave a poor local minimum; the inner lets L-BFGS lower the energy. Both end when the energy falls by
//! less than a share ε. Before them, on request, stages with a smoothed b(x), from smooth to sharp, let
//! atoms feel narrow features from afar (section 2.3). The best lattice seen is kept: the outer test can
//! end on a worse one. Every loop has a limit, and the report says which test ended it.

mod energy;
mod options;
mod report;
mod run;
#[cfg(test)]
mod tests;

pub use options::{OptimizeError, OptimizeOptions};
pub use report::{EngineKind, OptimizeReport, Stage, Stop};

use crate::energy::{Engine, MakeEngine, PairsEngine, SampledEngine};
use crate::fields::{FieldsView, ScalarField};
use crate::image::gaussian;
use crate::lattice::Lattice;
use crate::watch::{Phase, Watch, check};
use run::Run;

/// A lattice whose atoms have been moved, and how.
#[derive(Clone, Debug)]
pub struct OptimizedLattice<const D: usize> {
    lattice: Lattice<D>,
    report: OptimizeReport,
}

impl<const D: usize> OptimizedLattice<D> {
    /// The atoms where they ended.
    pub fn lattice(&self) -> &Lattice<D> {
        &self.lattice
    }

    /// The effort spent and the energy reached.
    pub fn report(&self) -> &OptimizeReport {
        &self.report
    }

    /// The lattice and the report.
    pub fn into_parts(self) -> (Lattice<D>, OptimizeReport) {
        (self.lattice, self.report)
    }
}

/// Moves the lattice's atoms to lower the total potential energy, computed by one of our engines.
///
/// # Errors
/// [`OptimizeError`] if an option is out of range, the energy is not finite, or the work was cancelled.
pub fn optimize<const D: usize>(
    lattice: Lattice<D>,
    fields: FieldsView<'_, D>,
    options: &OptimizeOptions,
    watch: &mut dyn Watch,
) -> Result<OptimizedLattice<D>, OptimizeError> {
    fn make<const D: usize>(
        kind: EngineKind,
        fields: FieldsView<'_, D>,
    ) -> Box<dyn Engine<D> + '_> {
        match kind {
            EngineKind::Pairs => Box::new(PairsEngine::new(fields)),
            EngineKind::Sampled => Box::new(SampledEngine::new(fields)),
        }
    }
    let kind = options.engine;
    let mut done = optimize_with(lattice, fields, &|fields| make(kind, fields), options, watch)?;
    done.report.engine = Some(kind);
    Ok(done)
}

/// The same with any engine: `make` is asked for one for each stage, with the potential of that stage,
/// smoothed or sharp. [`OptimizeOptions::engine`] does not count.
///
/// # Errors
/// As [`optimize`].
pub fn optimize_with<const D: usize>(
    mut lattice: Lattice<D>,
    fields: FieldsView<'_, D>,
    make: &MakeEngine<'_, D>,
    options: &OptimizeOptions,
    watch: &mut dyn Watch,
) -> Result<OptimizedLattice<D>, OptimizeError> {
    options.validate()?;
    let mut report = OptimizeReport::default();
    let early = OptimizeOptions { outer_limit: 1, ..options.clone() };
    for step in (1..=options.smoothing_steps).rev() {
        check(watch, Phase::Optimize, 0.0, None)?;
        // σ of d/8, d/4, d/2 … halved from stage to stage, in lattice units
        let sigma = fields.distance.least() * 0.0625 * 2f64.powi(step as i32);
        let smooth = smoothed(fields.potential, sigma);
        let engine = make(FieldsView { potential: &smooth, ..fields });
        lattice = Run::new(lattice, engine, &early, sigma, &mut report).finish(watch)?;
    }
    lattice = Run::new(lattice, make(fields), options, 0.0, &mut report).finish(watch)?;
    Ok(OptimizedLattice { lattice, report })
}

/// The potential smoothed by a Gaussian of `sigma` lattice units.
fn smoothed<const D: usize>(potential: &ScalarField<D>, sigma: f64) -> ScalarField<D> {
    let grid = *potential.grid();
    let mut samples = potential.samples().to_vec();
    gaussian(&mut samples, grid.shape, grid.step.map(|s| sigma / s));
    samples.iter_mut().for_each(|b| *b = b.clamp(-1.0, 1.0)); // rounding may step over
    ScalarField::potential(grid, samples, potential.interpolation())
        .expect("a mean of values within −1…1 is within it")
}
