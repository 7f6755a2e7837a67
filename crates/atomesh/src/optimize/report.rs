//! What a run of the optimizer did.

use crate::energy::Energy;

/// What computes the energy.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum EngineKind {
    /// Neighbour lists; the default.
    #[default]
    Pairs,
    /// Algorithm 1 on the image's samples.
    Sampled,
}

/// The test that ended a stage.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Stop {
    /// The energy fell by less than the share ε in either loop.
    Converged,
    /// The line search found no lower energy: a minimum to rounding, or, with the sampled engine, to a
    /// sample.
    Stuck,
    /// The inner loop reached its limit, and the outer found no more to gain.
    InnerLimit,
    /// The outer loop reached its limit.
    OuterLimit,
}

/// Algorithm 3 on one potential.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Stage {
    /// The σ by which b(x) was smoothed, in lattice units; 0 on the sharp image.
    pub smoothing: f64,
    /// How many times the atoms were perturbed.
    pub perturbations: usize,
    /// Inner iterations in all.
    pub iterations: usize,
    /// P of the lattice at the start.
    pub energy_first: f64,
    /// P of the best lattice.
    pub energy_last: f64,
    /// What ended it.
    pub stop: Stop,
}

impl Stage {
    pub(super) fn new(smoothing: f64) -> Self {
        Self {
            smoothing,
            perturbations: 0,
            iterations: 0,
            energy_first: f64::NAN,
            energy_last: f64::NAN,
            stop: Stop::OuterLimit,
        }
    }
}

/// What a run of the optimizer did.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
pub struct OptimizeReport {
    /// What computed the energy; `None`: an engine of the caller's.
    pub engine: Option<EngineKind>,
    /// Evaluations of energy and gradient in all.
    pub evaluations: usize,
    /// (1 − β) A at the end.
    pub energy_atomic: f64,
    /// β B at the end.
    pub energy_image: f64,
    /// The stages, from smooth to sharp.
    pub stages: Vec<Stage>,
}

impl OptimizeReport {
    /// The report of a lattice that was not moved.
    pub fn new(engine: EngineKind) -> Self {
        Self { engine: Some(engine), ..Self::default() }
    }

    pub(super) fn finish_stage(&mut self, stage: Stage, energy: Energy, evaluations: usize) {
        self.evaluations += evaluations;
        self.energy_atomic = energy.atomic;
        self.energy_image = energy.image;
        self.stages.push(stage);
    }

    /// Inner iterations in all stages.
    pub fn iterations(&self) -> usize {
        self.stages.iter().map(|stage| stage.iterations).sum()
    }
}
