//! How atoms are moved, and the mesh improved once they are connected.

use atomesh::fields::Interpolation;
use atomesh::improve::{Align, ImproveOptions};
use atomesh::optimize::{EngineKind, OptimizeOptions};

use super::section::section;
use crate::values::{LabelSize, Labels, Numbers, Text};
#[cfg(feature = "clap")]
use crate::values::{named, number_in};

/// Stages on smoothed potentials that anyone could want.
#[cfg(feature = "clap")]
const MOST_STEPS: u64 = 10;

section! {
    /// How atoms are moved.
    pub struct OptimizerOptions {
        /// How the energy is computed: from pairs of neighbours (pairs), or by the paper's sums over samples
        /// (sampled). Default: pairs
        #[arg(long, value_name = "ENGINE",
            value_parser = named::<EngineKind>(&["pairs", "sampled"]))]
        pub engine: EngineKind,
        /// How the potential is interpolated between samples. Default: spline in 2-D, linear in 3-D
        #[arg(long, value_name = "KIND",
            value_parser = named::<Interpolation>(&["nearest", "linear", "spline"]))]
        pub interpolation: Interpolation,
        /// Stages on a smoothed potential before the sharp one, 0 to 10. Default: 2 in 2-D,
        /// 0 in 3-D and with --mesh voronoi
        #[arg(long, value_name = "COUNT", value_parser = clap::value_parser!(u64).range(0..=MOST_STEPS))]
        pub smoothing_steps: u64,
        /// Relative decrease ε of the energy at which the work ends, 0 or more, below 1. Default: 0.001
        #[arg(long, value_name = "EPSILON",
            value_parser = number_in(0.0, 0.999, "a number from 0 to 0.999"))]
        pub tolerance: f64,
        /// Greatest number of iterations after each perturbation. Default: 200
        #[arg(long, value_name = "COUNT", value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
        pub inner_limit: u64,
        /// Greatest number of perturbations. Default: 2 in 2-D, 1 in 3-D
        #[arg(long, value_name = "COUNT", value_parser = clap::value_parser!(u64).range(0..=1_000_000))]
        pub outer_limit: u64,
        /// How far a perturbation moves an atom, relative to its edge length, 0 or more, below 0.5. Default: 0.1
        #[arg(long, value_name = "SHARE",
            value_parser = number_in(0.0, 0.499, "a number from 0 to 0.499"))]
        pub perturbation: f64,
        /// Seed of all random numbers. Default: 0
        #[arg(long, value_name = "SEED",
            value_parser = clap::value_parser!(u64).range(..=i64::MAX as u64))]
        pub seed: u64,
    }
}

impl OptimizerOptions {
    /// The core's options: what is not given comes from `basis`.
    pub(super) fn optimize_options(&self, basis: OptimizeOptions) -> OptimizeOptions {
        let count = |n: Option<u64>, basis: usize| n.map_or(basis, |n| n as usize);
        OptimizeOptions {
            engine: self.engine.unwrap_or(basis.engine),
            tolerance: self.tolerance.unwrap_or(basis.tolerance),
            inner_limit: count(self.inner_limit, basis.inner_limit),
            outer_limit: count(self.outer_limit, basis.outer_limit),
            perturbation: self.perturbation.unwrap_or(basis.perturbation),
            smoothing_steps: count(self.smoothing_steps, basis.smoothing_steps),
            seed: self.seed.unwrap_or(basis.seed),
            ..basis
        }
    }

    /// The core's options, spelt out.
    pub(super) fn spelt(options: &OptimizeOptions, interpolation: Interpolation) -> Self {
        Self {
            engine: Some(options.engine),
            interpolation: Some(interpolation),
            smoothing_steps: Some(options.smoothing_steps as u64),
            tolerance: Some(options.tolerance),
            inner_limit: Some(options.inner_limit as u64),
            outer_limit: Some(options.outer_limit as u64),
            perturbation: Some(options.perturbation),
            seed: Some(options.seed),
        }
    }
}

section! {
    /// How the mesh is improved once the atoms are connected.
    pub struct ImprovementOptions {
        /// Turn the edges (2-D) or faces (3-D) of the mesh onto features: not at all (off), by swaps alone, by
        /// swaps and moves of points (full), or by atoms that stand on features before all others, so that each
        /// feature is one line or sheet of them, tagged (conform); or conform where features are clean, full
        /// where they are ragged (auto). Default: auto
        #[arg(long, value_name = "HOW",
            value_parser = named::<Align>(&["auto", "off", "swaps", "full", "conform"]))]
        pub align: Align,
        /// Least angle in degrees that swaps and moves keep or restore: interior angles, below 60, in
        /// 2-D; dihedral angles, below 70.5, in 3-D. Default: 20 in 2-D, 15 in 3-D
        #[arg(long, value_name = "DEGREES",
            value_parser = number_in(0.0, 70.0, "an angle from 0 to 70"))]
        pub min_angle: f64,
    }
}

impl ImprovementOptions {
    /// The core's options: what is not given comes from `basis`.
    pub(super) fn improve_options(&self, basis: ImproveOptions) -> ImproveOptions {
        ImproveOptions {
            align: self.align.unwrap_or(basis.align),
            min_angle: self.min_angle.unwrap_or(basis.min_angle),
        }
    }
}

section! {
    /// How cells are labelled.
    pub struct RegionOptions {
        /// Connected groups of cells of one label, if of fewer cells than this, take the label of their
        /// neighbours. Default: 0
        #[arg(long, value_name = "COUNT", value_parser = clap::value_parser!(u64).range(0..=1_000_000_000))]
        pub least_island: u64,
        /// Values of IMAGE, ascending, that part it into phases, in place of --labels: label 0 below the first, 1 from it
        /// up to the next, and so on. With --denoise, of the image without its noise. The phases' boundaries are the
        /// features, unless --features says others
        #[arg(long, value_name = "A[,B...]", allow_hyphen_values = true, conflicts_with = "labels")]
        pub threshold: Numbers,
        /// Labels that are left out: the mesh ends at their smooth outline, as at that of a mask
        #[arg(long, value_name = "LABEL[,...]", allow_hyphen_values = true, conflicts_with = "only")]
        pub void: Text<Labels>,
        /// The labels that are meshed; all others are left out, as by --void
        #[arg(long, value_name = "LABEL[,...]", allow_hyphen_values = true)]
        pub only: Text<Labels>,
        /// Edge length wanted where a label is, in lattice units; elsewhere it is --size, and between them it grows by 1 for
        /// each 4 units of way. May be given many times
        #[arg(long, value_name = "LABEL=D", allow_hyphen_values = true)]
        pub size_of: Vec<Text<LabelSize>>,
    }
}
