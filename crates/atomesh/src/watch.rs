//! Progress out, cancel in.
//!
//! Long work calls [`Watch::step`] a few times a second or more; the answer says whether to go on.
//! The core neither prints nor reads a clock: shells put words, bars and times to these calls.

use std::ops::ControlFlow;

/// What the work is busy with, in the order in which a run passes through.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[non_exhaustive]
pub enum Phase {
    /// Reading an image.
    Read,
    /// Making the image potential b(x): features, smoothing, scaling.
    Potential,
    /// Making the nominal distance d(x) and limiting its gradient.
    Distance,
    /// Filling the box with atoms.
    Grow,
    /// Moving the atoms to lower the energy.
    Optimize,
    /// Connecting the atoms.
    Connect,
    /// Swapping cells and moving points of the mesh.
    Improve,
    /// Measuring the mesh.
    Measure,
    /// Writing the equations of flow.
    Assemble,
    /// Solving them.
    Solve,
    /// Following streamlines.
    Trace,
    /// Parting cells into clusters.
    Cluster,
    /// Drawing pictures.
    Draw,
    /// Writing files.
    Write,
}

impl Phase {
    /// A short lower-case name, for progress lines and reports.
    pub fn name(self) -> &'static str {
        match self {
            Phase::Read => "read",
            Phase::Potential => "potential",
            Phase::Distance => "distance",
            Phase::Grow => "grow",
            Phase::Optimize => "optimize",
            Phase::Connect => "connect",
            Phase::Improve => "improve",
            Phase::Measure => "measure",
            Phase::Assemble => "assemble",
            Phase::Solve => "solve",
            Phase::Trace => "trace",
            Phase::Cluster => "cluster",
            Phase::Draw => "draw",
            Phase::Write => "write",
        }
    }
}

/// The atoms between two iterations, as plain rows of numbers, so that one watch serves the plane and space.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub struct AtomsView<'a> {
    /// Coordinates of an atom: 2 or 3.
    pub dimension: usize,
    /// x, y (and z) of one atom after another, in lattice units.
    pub coordinates: &'a [f64],
    /// The nominal distance of each atom, in lattice units.
    pub distances: &'a [f64],
    /// (1 − β) A, the pairs' part of the energy.
    pub energy_atomic: f64,
    /// β B, the image's part.
    pub energy_image: f64,
}

/// Listens to long work and may end it.
pub trait Watch {
    /// Called between iterations with the phase, the share of it done in 0..=1 and, where there is
    /// one, the energy; `Break` ends the work early.
    fn step(&mut self, phase: Phase, done: f64, energy: Option<f64>) -> ControlFlow<()>;

    /// Called after each iteration that lowered the energy, with the atoms where they are then. Nothing is
    /// copied for it. In a stage with a smoothed image the image's part is that of the smoothed one.
    /// Default: nothing.
    fn atoms(&mut self, phase: Phase, atoms: AtomsView<'_>) {
        let _ = (phase, atoms);
    }
}

/// Listens to nothing and never ends the work.
#[derive(Clone, Copy, Debug, Default)]
pub struct Silent;

impl Watch for Silent {
    fn step(&mut self, _: Phase, _: f64, _: Option<f64>) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }
}

/// The work was ended by its [`Watch`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("cancelled")]
pub struct Cancelled;

/// [`Watch::step`] as a `Result`, so that `?` ends the work.
pub fn check(
    watch: &mut dyn Watch,
    phase: Phase,
    done: f64,
    energy: Option<f64>,
) -> Result<(), Cancelled> {
    match watch.step(phase, done, energy) {
        ControlFlow::Continue(()) => Ok(()),
        ControlFlow::Break(()) => Err(Cancelled),
    }
}
