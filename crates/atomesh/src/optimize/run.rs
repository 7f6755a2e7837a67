//! Algorithm 3 on one potential.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::energy::LatticeEnergy;
use super::{OptimizeError, OptimizeOptions, OptimizeReport, Stage, Stop};
use crate::energy::Engine;
use crate::lattice::Lattice;
use crate::minimize::{Lbfgs, LbfgsOptions, Objective, Step};
use crate::watch::{Phase, Watch, check};

/// One run of algorithm 3.
pub(super) struct Run<'r, const D: usize> {
    energy: LatticeEnergy<'r, D>,
    minimizer: Lbfgs,
    options: &'r OptimizeOptions,
    pub(super) stage: Stage,
    report: &'r mut OptimizeReport,
}

impl<'r, const D: usize> Run<'r, D> {
    pub fn new(
        lattice: Lattice<D>,
        engine: Box<dyn Engine<D> + 'r>,
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
    pub fn finish(mut self, watch: &mut dyn Watch) -> Result<Lattice<D>, OptimizeError> {
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

    /// Evaluates the energy where the atoms start, and returns that place: atoms nearer to a side than the
    /// margin have been moved.
    pub(super) fn begin(&mut self) -> Vec<f64> {
        let given = self.minimizer.x().to_vec();
        self.minimizer.restart(&mut self.energy);
        self.stage.energy_first = self.minimizer.value();
        let start = self.minimizer.x().to_vec();
        if start != given {
            // d, β and the lists were made before they were moved
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
            watch.atoms(Phase::Optimize, self.energy.view(self.minimizer.x()));
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
