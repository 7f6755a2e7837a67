//! Moving the atoms to lower the total potential energy (Hale 2001, algorithm 3).
//!
//! Two nested loops: the outer perturbs the atoms a little, at random and seeded, so that the lattice may
//! leave a poor local minimum; the inner lets L-BFGS lower the energy. Both end when the energy falls by
//! less than a share ε. Before them, on request, stages with a smoothed b(x), from smooth to sharp, let
//! atoms feel narrow features from afar (section 2.3). The best lattice seen is kept: the outer test can
//! end on a worse one. Every loop has a limit, and the report says which test ended it.

mod energy;
mod report;
#[cfg(test)]
mod tests;

pub use report::{EngineKind, OptimizeReport, Stage, Stop};

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use crate::energy::{Engine, PairsEngine, SampledEngine};

use crate::fields::{Fields, ScalarField};
use crate::image::gaussian;
use crate::lattice::Lattice;
use crate::minimize::{Lbfgs, LbfgsOptions, Objective, Step};
use crate::watch::{Cancelled, Phase, Watch, check};

use energy::LatticeEnergy;

/// How atoms are moved.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct OptimizeOptions {
    /// What computes the energy. Default pairs.
    pub engine: EngineKind,
    /// ε: both loops end when the energy falls by less than this share. Default 10⁻³, the paper's.
    pub tolerance: f64,
    /// Iterations one inner loop may take. Default 200.
    pub inner_limit: usize,
    /// Perturbations tried. Default 2: more of them gain a little alignment for as much shape.
    pub outer_limit: usize,
    /// The farthest that a perturbation moves an atom, over its nominal distance. Default 0.1, the paper's.
    pub perturbation: f64,
    /// The farthest that an iteration moves an atom, over its nominal distance. Default 0.1.
    pub longest_move: f64,
    /// How near to a side of the box a free atom may come, over its nominal distance: what is nearer
    /// would make flat cells. Default 0.35.
    pub margin: f64,
    /// Stages with a smoothed b(x) before the sharp one, 10 or less. Default 0.
    pub smoothing_steps: usize,
    /// The seed of the perturbations. Default 0.
    pub seed: u64,
}

impl Default for OptimizeOptions {
    fn default() -> Self {
        Self {
            engine: EngineKind::Pairs,
            tolerance: 1e-3,
            inner_limit: 200,
            outer_limit: 2,
            perturbation: 0.1,
            longest_move: 0.1,
            margin: 0.35,
            smoothing_steps: 0,
            seed: 0,
        }
    }
}

/// Why atoms could not be moved.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum OptimizeError {
    /// An option is out of its range.
    #[error("{name} is {value}; expected {expected}")]
    Option {
        /// The option's name.
        name: &'static str,
        /// Its value.
        value: f64,
        /// What it should be.
        expected: &'static str,
    },
    /// The energy or its gradient was not finite.
    #[error("the energy is {value} after {evaluations} evaluations; expected a finite number")]
    NotFinite {
        /// The energy.
        value: f64,
        /// Evaluations so far.
        evaluations: usize,
    },
    /// The caller ended the work.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

impl OptimizeOptions {
    /// The defaults for images of a dimension.
    ///
    /// In 2-D the hexagonal lattice is a stable minimum of the pair potential, and the longer atoms
    /// search, from a smoothed image to the sharp one, the better the mesh: fault images gain a tenth
    /// to two fifths in alignment at nearly equal shape. In 3-D no lattice of that density is: a long search
    /// lets it fall into disorder, with more alignment but flat cells, so it stops early, after one
    /// perturbation: on a brain at d = 6 a second one took a third more evaluations, for recall
    /// 0.638 against 0.635 and mean quality 0.870 against 0.873.
    pub fn for_dimension(dimension: usize) -> Self {
        if dimension == 2 {
            Self { smoothing_steps: 2, ..Self::default() }
        } else {
            Self { outer_limit: 1, ..Self::default() }
        }
    }

    /// Checks every option's range.
    ///
    /// # Errors
    /// [`OptimizeError::Option`] names the first that is out of it.
    pub fn validate(&self) -> Result<(), OptimizeError> {
        let checks = [
            ("tolerance", self.tolerance, 0.0..1.0, "0 or more, below 1"),
            ("perturbation", self.perturbation, 0.0..0.5, "0 or more, below 0.5"),
            ("longest_move", self.longest_move, 1e-6..0.5, "above 0, below 0.5"),
            ("margin", self.margin, 0.0..0.5, "0 or more, below 0.5"),
            ("smoothing_steps", self.smoothing_steps as f64, 0.0..10.5, "10 or less"),
        ];
        for (name, value, range, expected) in checks {
            if !range.contains(&value) {
                return Err(OptimizeError::Option { name, value, expected });
            }
        }
        Ok(())
    }
}

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

/// Moves the lattice's atoms to lower the total potential energy.
///
/// # Errors
/// [`OptimizeError`] if an option is out of range, the energy is not finite, or the work was cancelled.
pub fn optimize<const D: usize>(
    lattice: Lattice<D>,
    fields: Fields<'_, D>,
    options: &OptimizeOptions,
    watch: &mut dyn Watch,
) -> Result<OptimizedLattice<D>, OptimizeError> {
    options.validate()?;
    let mut report = OptimizeReport::new(options.engine);
    let mut lattice = lattice;
    for step in (1..=options.smoothing_steps).rev() {
        check(watch, Phase::Optimize, 0.0, None)?;
        // σ of d/8, d/4, d/2 … halved from stage to stage, in lattice units
        let sigma = fields.distance.least() * 0.0625 * 2f64.powi(step as i32);
        let smooth = smoothed(fields.potential, sigma);
        let fields = Fields { potential: &smooth, ..fields };
        let early = OptimizeOptions { outer_limit: 1, ..options.clone() };
        lattice = minimize_stage(lattice, fields, &early, sigma, &mut report, watch)?;
    }
    lattice = minimize_stage(lattice, fields, options, 0.0, &mut report, watch)?;
    Ok(OptimizedLattice { lattice, report })
}

/// The potential smoothed by a Gaussian of `sigma` lattice units.
fn smoothed<const D: usize>(potential: &ScalarField<D>, sigma: f64) -> ScalarField<D> {
    let grid = *potential.grid();
    let mut samples = potential.samples().to_vec();
    gaussian(&mut samples, grid.shape, grid.step.map(|s| sigma / s));
    samples.iter_mut().for_each(|b| *b = b.clamp(-1.0, 1.0)); // rounding may step over
    ScalarField::new(grid, samples, potential.interpolation())
        .expect("a mean of values within −1…1 is within it")
}

/// Algorithm 3 on one potential, with whichever engine is wanted.
fn minimize_stage<const D: usize>(
    lattice: Lattice<D>,
    fields: Fields<'_, D>,
    options: &OptimizeOptions,
    smoothing: f64,
    report: &mut OptimizeReport,
    watch: &mut dyn Watch,
) -> Result<Lattice<D>, OptimizeError> {
    let Fields { potential, weight, distance } = fields;
    match options.engine {
        EngineKind::Pairs => {
            let engine = PairsEngine::new(potential, weight, distance);
            Run::new(lattice, engine, options, smoothing, report).finish(watch)
        }
        EngineKind::Sampled => {
            let engine = SampledEngine::new(potential, weight, distance);
            Run::new(lattice, engine, options, smoothing, report).finish(watch)
        }
    }
}

/// One run of algorithm 3.
struct Run<'r, E, const D: usize> {
    energy: LatticeEnergy<E, D>,
    minimizer: Lbfgs,
    options: &'r OptimizeOptions,
    stage: Stage,
    report: &'r mut OptimizeReport,
}

impl<'r, E: Engine<D>, const D: usize> Run<'r, E, D> {
    fn new(
        lattice: Lattice<D>,
        engine: E,
        options: &'r OptimizeOptions,
        smoothing: f64,
        report: &'r mut OptimizeReport,
    ) -> Self {
        let mut energy = LatticeEnergy::new(lattice, engine, options.margin, options.longest_move);
        let x = energy.start();
        let first_move = 0.5 * options.longest_move * energy.least_distance();
        let minimizer = Lbfgs::new(x, LbfgsOptions { first_move, ..Default::default() });
        Self { energy, minimizer, options, stage: Stage::new(smoothing), report }
    }

    /// The outer loop.
    fn finish(mut self, watch: &mut dyn Watch) -> Result<Lattice<D>, OptimizeError> {
        let start = self.begin();
        let mut random = Pcg64::seed_from_u64(self.options.seed);
        let mut best = (self.minimizer.value(), self.minimizer.x().to_vec());
        self.stage.stop = Stop::OuterLimit;
        for outer in 0..self.options.outer_limit.max(1) {
            let done = outer as f64 / self.options.outer_limit.max(1) as f64;
            check(watch, Phase::Optimize, done, None)?;
            let before = self.minimizer.value();
            self.perturb(&mut random);
            let inner_stop = self.descend(outer, watch)?;
            let value = self.minimizer.value();
            self.stage.perturbations += 1;
            if value < best.0 {
                best = (value, self.minimizer.x().to_vec());
            }
            if before - value <= self.options.tolerance * before.abs() {
                self.stage.stop = inner_stop;
                break;
            }
        }
        let mut x = best.1;
        let mut energy = self.energy.evaluate_at(&x);
        // d and β were read where atoms had been: read where they are, the start may be the better one
        if energy.total() > self.stage.energy_first {
            x = start;
            energy = self.energy.evaluate_at(&x);
        }
        self.stage.energy_last = energy.total();
        self.report.finish_stage(self.stage, energy, self.minimizer.evaluations() + 1);
        Ok(self.energy.into_lattice(&x))
    }

    /// Evaluates the energy where the atoms start, and says where that is: those that were nearer to a side
    /// than the margin have been moved.
    fn begin(&mut self) -> Vec<f64> {
        let given = self.minimizer.x().to_vec();
        self.minimizer.restart(&mut self.energy);
        self.stage.energy_first = self.minimizer.value();
        let start = self.minimizer.x().to_vec();
        if start != given {
            // d, β and who is near whom were read before they were moved
            self.stage.energy_first = self.energy.evaluate_at(&start).total();
            self.minimizer.restart(&mut self.energy);
        }
        start
    }

    /// Moves each free atom by at most `perturbation` nominal distances, at random.
    fn perturb(&mut self, random: &mut Pcg64) {
        if self.options.perturbation == 0.0 {
            return;
        }
        let reach = self.options.perturbation / (D as f64).sqrt();
        let distances = self.energy.distances();
        for (i, atom) in self.minimizer.x_mut().as_chunks_mut::<D>().0.iter_mut().enumerate() {
            for x in atom.iter_mut() {
                *x += reach * distances[i] * (2.0 * random.random::<f64>() - 1.0);
            }
        }
        self.energy.hold(self.minimizer.x_mut());
        self.energy.confine(self.minimizer.x_mut()); // d, β and lists are for where they may be
        self.energy.prepare(self.minimizer.x());
        self.minimizer.restart(&mut self.energy);
    }

    /// The inner loop: L-BFGS until the relative decrease is below ε.
    fn descend(&mut self, outer: usize, watch: &mut dyn Watch) -> Result<Stop, OptimizeError> {
        for _ in 0..self.options.inner_limit {
            let before = self.minimizer.value();
            let step = self.minimizer.iterate(&mut self.energy);
            let value = self.minimizer.value();
            self.stage.iterations += 1;
            match step {
                Step::Lower => {}
                Step::Stuck => return Ok(Stop::Stuck),
                Step::NotFinite => {
                    let evaluations = self.minimizer.evaluations();
                    return Err(OptimizeError::NotFinite { value, evaluations });
                }
            }
            if before - value <= self.options.tolerance * before.abs() {
                return Ok(Stop::Converged);
            }
            let done = (outer as f64 + 0.5) / self.options.outer_limit.max(1) as f64;
            check(watch, Phase::Optimize, done, Some(value))?;
            let last_step = self.minimizer.last_step();
            if self.energy.prepare_after(self.minimizer.x(), last_step) {
                self.minimizer.restart(&mut self.energy);
            }
        }
        Ok(Stop::InnerLimit)
    }
}
