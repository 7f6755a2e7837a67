//! Atoms in mirrored pairs across features that repel, so that faces of Voronoi cells fall on the features.
//!
//! A feature that repels (b above 0) keeps atoms off. Those on its two sides need not stand opposite each other,
//! though, and only where they do is the feature their bisector. In space hardly any do by themselves. So sites are
//! chosen on the features, and each gets a pair of atoms, as in grids that conform to faults (Merland and others 2014;
//! Berge, Klemetsdal & Lie 2019). In this order:
//!
//! 1. crests of b, with their normals ([`crate::crests::repelling_crests`]);
//! 2. sites on them about 0.85 d apart (`crests::sites`);
//! 3. `pairs`: an atom 0.35 d to either side of each site. Where another pair has an atom there already, as where
//!    features meet, it serves both, and its mirror image is the second;
//! 4. `exclusion`: other atoms that are too near, or would be nearest to a part of a feature, are taken out;
//! 5. holes are filled, and the other atoms settle by the pair potential around the pairs, which stay. Where all of the
//!    image repels, b has no other part in this: the pairs follow it, and it would only crowd the other atoms.
//!
//! Nothing is random but the perturbation of step 5. Deterministic: the same at any thread count. Cost: that of finding
//! crests, O(points on features), and that of moving the atoms.

mod exclusion;
mod pairs;

use crate::parallel::prelude::*;

use crate::crests::{FeaturePoint, sites};
use crate::fields::{FieldsView, ImageWeight};
use crate::lattice::{Lattice, LatticeError, Scatterer, fill_holes};
use crate::optimize::{OptimizeError, OptimizeOptions, OptimizeReport, optimize};
use crate::watch::{Cancelled, Phase, Watch, check};

use exclusion::Exclusion;
use pairs::Pairs;

/// The least distance between two atoms of pairs that are not opposite each other, and between the two of one, over
/// d: nearer atoms would have cells much smaller than others. On the paper's figure 1 recall is the same from 0.4
/// to 0.5, and less with 0.6.
const APART: f64 = 0.45;
/// The least distance of other atoms from those of pairs, over d: before they settle, and after.
const CLEAR: [f64; 2] = [0.7, 0.4];
/// How often holes are looked for and filled.
const FILL_ROUNDS: usize = 2;

/// Why there are no pairs.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MirrorError {
    /// Holes could not be filled.
    #[error(transparent)]
    Lattice(LatticeError),
    /// The other atoms could not be moved.
    #[error(transparent)]
    Optimize(OptimizeError),
    /// The caller ended the work.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

impl From<LatticeError> for MirrorError {
    fn from(error: LatticeError) -> Self {
        match error {
            LatticeError::Cancelled(cancelled) => Self::Cancelled(cancelled),
            other => Self::Lattice(other),
        }
    }
}

impl From<OptimizeError> for MirrorError {
    fn from(error: OptimizeError) -> Self {
        match error {
            OptimizeError::Cancelled(cancelled) => Self::Cancelled(cancelled),
            other => Self::Optimize(other),
        }
    }
}

/// What became of the features.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
#[non_exhaustive]
pub struct MirrorReport {
    /// Sites on features that were to have a pair of atoms.
    pub places: usize,
    /// Sites that have one.
    pub pairs: usize,
    /// Pairs that share an atom with another pair.
    pub shared: usize,
}

/// A lattice with mirrored pairs, and how it came about.
#[derive(Clone, Debug)]
pub struct MirroredLattice<const D: usize> {
    /// The atoms; those of pairs are frozen.
    pub lattice: Lattice<D>,
    /// The pairs.
    pub report: MirrorReport,
    /// How the other atoms were moved.
    pub optimize_report: OptimizeReport,
}

/// How atoms settle around the pairs.
#[derive(Clone, Copy)]
pub struct Settling<'a, const D: usize> {
    /// Finds the holes that removed atoms leave.
    pub scatterer: &'a Scatterer<D>,
    /// How atoms move, but for the stages with a smoothed image, which are left out.
    pub options: &'a OptimizeOptions,
}

/// Puts pairs of atoms on both sides of the features that `crests` are on, in lattice coordinates, and lets the others
/// settle around them.
///
/// Atoms that are frozen already, such as wells, stay; pairs are made with them where they are near enough to a feature.
///
/// Reports [`Phase::Grow`] and [`Phase::Optimize`] to `watch`.
///
/// # Errors
/// [`MirrorError`] if the atoms cannot be connected or moved, or `watch` ends the work.
pub fn mirror<const D: usize>(
    lattice: Lattice<D>,
    crests: &[FeaturePoint<D>],
    fields: FieldsView<'_, D>,
    settling: Settling<'_, D>,
    watch: &mut dyn Watch,
) -> Result<MirroredLattice<D>, MirrorError> {
    let (bounds, distance) = (*lattice.bounds(), fields.distance);
    check(watch, Phase::Grow, 0.0, None)?;
    let sites = sites(crests, distance, &bounds, watch)?;
    let pairs = Pairs::new(&sites, &lattice, distance);
    let exclusion = Exclusion::new(crests, &pairs, distance, &bounds);
    let report =
        MirrorReport { places: sites.len(), pairs: pairs.sites.len(), shared: pairs.shared };
    let mut lattice = without_excluded(lattice, &exclusion, CLEAR[0]);
    pairs.new_atoms().iter().for_each(|&atom| lattice.push(atom, ((1 << D) - 1) as u8, 0.0));
    let lattice = fill_holes(settling.scatterer, lattice, distance, FILL_ROUNDS, watch)?;
    let lattice = lattice.along_curve();
    let none = ImageWeight::constant(0.0).expect("0 is a weight");
    let weight = if fields.potential.range().0 < 0.0 { fields.weight } else { &none };
    let options = OptimizeOptions { smoothing_steps: 0, ..settling.options.clone() };
    let settled = optimize(lattice, FieldsView { weight, ..fields }, &options, watch)?;
    let (lattice, optimize_report) = settled.into_parts();
    let lattice = without_excluded(lattice, &exclusion, CLEAR[1]);
    Ok(MirroredLattice { lattice, report, optimize_report })
}

/// The lattice without those atoms that may move and are where only pairs may be.
fn without_excluded<const D: usize>(
    lattice: Lattice<D>,
    exclusion: &Exclusion<'_, D>,
    clear: f64,
) -> Lattice<D> {
    let stays = |i: usize| is_held(&lattice, i) || exclusion.allows(&lattice.atoms()[i], clear);
    let stays: Vec<bool> = (0..lattice.len()).into_par_iter().map(stays).collect();
    lattice.retained(|i| stays[i])
}

/// Whether an atom cannot move: corners of the box, wells and pairs.
fn is_held<const D: usize>(lattice: &Lattice<D>, i: usize) -> bool {
    (0..D).all(|k| lattice.mobility(i, k) == 0.0)
}
