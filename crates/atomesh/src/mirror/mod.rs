//! Atoms in mirrored pairs across features that repel, so that faces of Voronoi cells fall on the features.
//!
//! A feature that repels (b above 0) keeps atoms off, but does not make those on its two sides stand opposite
//! each other, and only of atoms that do is the feature the bisector. In space hardly any do by themselves. So
//! places are chosen on the features, and at each a pair of atoms, as grids that conform to faults have it
//! (Merland and others 2014; Berge, Klemetsdal & Lie 2019). In this order:
//!
//! 1. `crests`: the bottoms of the valleys of −b, with their normals;
//! 2. `feet`: places on them about 0.85 d apart, evened out as the centroids of what is nearest to each;
//! 3. `pairs`: an atom 0.35 d to either side of each. Where another pair has an atom there already, as where
//!    features meet, it serves both, and its mirror image is the second;
//! 4. `room`: other atoms that are too near, or would be nearest to a part of a feature, are taken out;
//! 5. holes are filled, and the others settle by the pair potential around the pairs, which stay. Where all of
//!    the image repels it has no other part in this: the pairs follow it, and b would only crowd the rest.
//!
//! Nothing is random but the perturbation of step 5. Deterministic: the same at any thread count. Cost: that of
//! looking for valleys, O(points on features), and that of moving the atoms.

mod bins;
mod crests;
mod feet;
mod pairs;
mod room;

pub use crests::{Crest, crests};

use rayon::prelude::*;

use crate::fields::FieldsView;
use crate::fields::ImageWeight;
use crate::geometry::all_axes;
use crate::lattice::{Lattice, LatticeError, Scatterer, fill_holes};
use crate::optimize::{OptimizeError, OptimizeOptions, OptimizeReport, optimize};
use crate::watch::{Cancelled, Phase, Watch, check};

use pairs::Pairs;
use room::Room;

/// The least distance between two atoms of pairs that are not opposite each other, and between the two of one, over
/// d: nearer atoms would have cells much smaller than others. On the paper's figure 1 recall is the same from 0.4
/// to 0.5, and less with 0.6.
const APART: f64 = 0.45;
/// How near to the atoms of pairs others may be, over d: before they settle, and after.
const CLEAR: [f64; 2] = [0.7, 0.4];
/// Meshes that are looked at for holes.
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
    /// Places on features that were to have a pair of atoms.
    pub places: usize,
    /// Places that have one.
    pub pairs: usize,
    /// Pairs with an atom that another pair has too.
    pub shared: usize,
}

/// A lattice with pairs, and how it came about.
#[derive(Clone, Debug)]
pub struct Mirrored<const D: usize> {
    /// The atoms; those of pairs are frozen.
    pub lattice: Lattice<D>,
    /// The pairs.
    pub report: MirrorReport,
    /// How the other atoms were moved.
    pub optimize_report: OptimizeReport,
}

/// Puts pairs of atoms on both sides of the crests, and lets the others settle around them.
///
/// Atoms that are frozen already, such as wells, stay; pairs are made with them where they are near enough to a
/// feature. `options` say how the others settle, but for the stages with a smoothed image, which are left out.
///
/// Reports [`Phase::Grow`] and [`Phase::Optimize`] to `watch`.
///
/// # Errors
/// [`MirrorError`] if the atoms cannot be connected or moved, or `watch` ends the work.
pub fn mirror<const D: usize>(
    lattice: Lattice<D>,
    crests: &[Crest<D>],
    fields: FieldsView<'_, D>,
    (scatterer, options): (&Scatterer<D>, &OptimizeOptions),
    watch: &mut dyn Watch,
) -> Result<Mirrored<D>, MirrorError> {
    let (bounds, distance) = (*lattice.bounds(), fields.distance);
    check(watch, Phase::Grow, 0.0, None)?;
    let feet = feet::feet(crests, distance, &bounds, watch)?;
    let pairs = Pairs::new(&feet, &lattice, distance);
    let room = Room::new(crests, &pairs, distance, &bounds);
    let report = MirrorReport { places: feet.len(), pairs: pairs.feet.len(), shared: pairs.shared };
    let mut lattice = cleared(lattice, &room, CLEAR[0]);
    pairs.new_sites().iter().for_each(|&site| lattice.push(site, all_axes::<D>(), 0.0));
    let lattice = fill_holes(scatterer, lattice, distance, FILL_ROUNDS, watch)?.along_curve();
    let none = ImageWeight::constant(0.0).expect("0 is a weight");
    let weight = if fields.potential.range().0 < 0.0 { fields.weight } else { &none };
    let options = OptimizeOptions { smoothing_steps: 0, ..options.clone() };
    let settled = optimize(lattice, FieldsView { weight, ..fields }, &options, watch)?;
    let (lattice, optimize_report) = settled.into_parts();
    Ok(Mirrored { lattice: cleared(lattice, &room, CLEAR[1]), report, optimize_report })
}

/// The lattice without the atoms that may move and are where only pairs should be.
fn cleared<const D: usize>(lattice: Lattice<D>, room: &Room<'_, D>, clear: f64) -> Lattice<D> {
    let stays = |i: usize| is_held(&lattice, i) || room.is_free(&lattice.atoms()[i], clear);
    let stays: Vec<bool> = (0..lattice.len()).into_par_iter().map(stays).collect();
    lattice.retained(|i| stays[i])
}

/// Whether an atom cannot move: corners of the box, wells and pairs.
fn is_held<const D: usize>(lattice: &Lattice<D>, i: usize) -> bool {
    (0..D).all(|k| lattice.mobility(i, k) == 0.0)
}
