//! Features first: atoms on features before all others, and facets on features once atoms are connected.
//!
//! As the box has its corners, edges and faces before its inside, features have
//!
//! 1. nodes: where curves cross or end;
//! 2. curves: in the plane the features; in space where they meet the sides of the box and each other;
//! 3. surfaces, in space.
//!
//! Atoms stand on them about d(x) apart ([`Pieces`] say where they are), and stay there. Others keep off
//! ([`conform`]). What edges still cross once the atoms are connected is mended by atoms at the crossings, or by
//! taking away what is too near ([`connect`]). The facets of a feature are those between the cells on its two sides
//! ([`feature_facets`]).
//!
//! Nothing is random but the perturbation of the optimizer. The same at any thread count.

mod atoms;
mod curves;
mod cut;
mod facets;
mod recover;
mod trace;
mod unmet;

use std::collections::HashSet;

use rayon::prelude::*;

use crate::crests::{Bins, Pieces, PointGrid};
use crate::fields::{FieldsView, NominalDistance, ScalarField};
use crate::geometry::{Point, distance_squared};
use crate::lattice::{Lattice, LatticeError, Scatterer, fill_holes};
use crate::mesh::{ConnectError, Delaunay, Mesh};
use crate::optimize::{OptimizeError, OptimizeOptions, OptimizeReport, optimize};
use crate::watch::{Cancelled, Phase, Watch, check};

use atoms::{FeatureAtom, feature_atoms};
pub use cut::cut_cells;
pub(crate) use facets::are_on_pieces;
pub use facets::{FeatureFacet, feature_facets};
use recover::{Heights, brought_near, crossings, recovered};
pub use unmet::{Unmet, unmet};

/// The least distance of other atoms from those on features, over d: before they settle, and after.
const CLEAR: [f64; 2] = [0.7, 0.55];
/// The same for atoms on the sides of the box.
const CLEAR_SIDE: [f64; 2] = [0.5, 0.4];
/// A piece is met where one of the places at which it is met is nearer than this, over d.
const MET: f64 = 0.75;
/// How far from pieces b no longer counts, over d, and in mean steps.
const CLEARED: f64 = 0.6;
const CLEARED_STEPS: f64 = 3.0;
/// How often holes are looked for and filled.
const FILL_ROUNDS: usize = 2;
/// How often the atoms are connected to mend crossings.
const RECOVER_ROUNDS: usize = 8;

/// Why a lattice could not be made to conform.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ConformError {
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

impl From<LatticeError> for ConformError {
    fn from(error: LatticeError) -> Self {
        match error {
            LatticeError::Cancelled(cancelled) => Self::Cancelled(cancelled),
            other => Self::Lattice(other),
        }
    }
}

impl From<OptimizeError> for ConformError {
    fn from(error: OptimizeError) -> Self {
        match error {
            OptimizeError::Cancelled(cancelled) => Self::Cancelled(cancelled),
            other => Self::Optimize(other),
        }
    }
}

/// Puts atoms on features, and lets the others settle around them.
///
/// Reports [`Phase::Grow`] and [`Phase::Optimize`] to `watch`.
///
/// # Errors
/// [`ConformError`] if the atoms cannot be connected or moved, or `watch` ends the work.
pub fn conform<const D: usize>(
    lattice: Lattice<D>,
    pieces: &Pieces<D>,
    fields: FieldsView<'_, D>,
    scatterer: &Scatterer<D>,
    options: &OptimizeOptions,
    watch: &mut dyn Watch,
) -> Result<(Lattice<D>, OptimizeReport), ConformError> {
    let (bounds, distance) = (*lattice.bounds(), fields.distance);
    let atoms = feature_atoms(pieces, &bounds, distance, watch)?;
    let mut lattice = without_near(lattice, &atoms, distance, 0);
    let bits = |p: &Point<D>| p.map(f64::to_bits);
    let there: HashSet<[u64; D]> = lattice.atoms().iter().map(bits).collect();
    for FeatureAtom { position, .. } in atoms.iter().filter(|a| !there.contains(&bits(&a.position)))
    {
        lattice.push(*position, bounds.freedom(position), 0.0);
    }
    let lattice = fill_holes(scatterer, lattice, distance, FILL_ROUNDS, watch)?;
    let lattice = without_near(lattice.along_curve(), &atoms, distance, 1);
    let options = OptimizeOptions { smoothing_steps: 0, ..options.clone() };
    let met = atoms.iter().map(|atom| atom.position).collect::<Vec<_>>();
    let rest = without_met(fields.potential, pieces, &met, distance);
    let fields = FieldsView { potential: &rest, ..fields };
    let settled = optimize(lattice, fields, &options, watch)?;
    let (lattice, report) = settled.into_parts();
    Ok((without_near(lattice, &atoms, distance, 1), report))
}

/// b without the valleys of pieces near the places at which they are met: weaker features go on attracting, and what of
/// pieces could not be met.
fn without_met<const D: usize>(
    potential: &ScalarField<D>,
    pieces: &Pieces<D>,
    met: &[Point<D>],
    distance: &NominalDistance<D>,
) -> ScalarField<D> {
    let grid = *potential.grid();
    let mut samples = potential.samples().to_vec();
    let near_met = PointGrid::new(&grid.bounds(), distance.least(), met.iter().copied());
    let is_met = |place: &Point<D>| {
        let (reach, mut is_met) = (MET * distance.at(place), false);
        near_met.near(place, reach, |other, _| {
            is_met |= distance_squared(place, other) <= reach * reach;
        });
        is_met
    };
    let between = 0.5 * pieces.apart() * pieces.step();
    for (place, _) in pieces.places().filter(|(place, _)| is_met(place)) {
        let reach = (CLEARED * distance.at(&place)).max(CLEARED_STEPS * pieces.step()) + between;
        let range = |k: usize| {
            let low = ((place[k] - reach) / grid.step[k]).ceil().max(0.0) as usize;
            let high = ((place[k] + reach) / grid.step[k]).floor().max(0.0) as usize;
            low..high.min(grid.shape[k] - 1) + 1
        };
        let ranges: [std::ops::Range<usize>; D] = std::array::from_fn(range);
        for row in 0..ranges[1..].iter().map(ExactSizeIterator::len).product() {
            let (mut rest, mut index, mut stride) = (row, 0, grid.shape[0]);
            let mut beside = 0.0;
            for k in 1..D {
                let at = ranges[k].start + rest % ranges[k].len();
                rest /= ranges[k].len();
                beside += (at as f64 * grid.step[k] - place[k]).powi(2);
                index += at * stride;
                stride *= grid.shape[k];
            }
            let half = (reach * reach - beside).max(0.0).sqrt();
            let first = ((place[0] - half) / grid.step[0]).ceil().max(0.0) as usize;
            let end = ((place[0] + half) / grid.step[0]).floor().max(-1.0) + 1.0;
            let end = (end as usize).min(grid.shape[0]);
            if beside <= reach * reach && first < end {
                samples[index + first..index + end].fill(0.0);
            }
        }
    }
    ScalarField::potential(grid, samples, potential.interpolation())
        .expect("values within -1 to 1, one for each sample")
}

/// The lattice without those atoms that may move and are too near to atoms on features.
fn without_near<const D: usize>(
    lattice: Lattice<D>,
    atoms: &[FeatureAtom<D>],
    distance: &NominalDistance<D>,
    stage: usize,
) -> Lattice<D> {
    let least = distance.least();
    let bins = Bins::of(lattice.bounds(), least, atoms.iter().map(|atom| atom.position));
    let stays = |i: usize| {
        let p: &Point<D> = &lattice.atoms()[i];
        if lattice.temperature(i) == 0.0 || lattice.freedom_in_box(i) == 0 {
            return true;
        }
        let is_inner = lattice.freedom_in_box(i).count_ones() as usize == D;
        let clear = if is_inner { CLEAR[stage] } else { CLEAR_SIDE[stage] } * distance.at(p);
        let mut is_clear = true;
        bins.near(p, clear, |j| {
            is_clear &= distance_squared(&atoms[j].position, p) >= clear * clear;
        });
        is_clear
    };
    let stays: Vec<bool> = (0..lattice.len()).into_par_iter().map(stays).collect();
    lattice.retained(|i| stays[i])
}

/// Connects atoms by Delaunay's rule, with atoms added and taken away until no edge crosses a feature, or nothing
/// helps.
///
/// # Errors
/// [`ConnectError`] if the atoms make no mesh, or `watch` ends the work.
pub fn connect<const D: usize>(
    mut lattice: Lattice<D>,
    pieces: &Pieces<D>,
    distance: &NominalDistance<D>,
    delaunay: &Delaunay<D>,
    watch: &mut dyn Watch,
) -> Result<(Lattice<D>, Mesh<D>), ConnectError> {
    let mut known = Heights::default();
    for _ in 0..RECOVER_ROUNDS {
        lattice = brought_near(lattice, pieces);
        let mesh = delaunay.connect(lattice.atoms(), watch)?;
        check(watch, Phase::Connect, 0.5, None)?;
        let crossings = crossings(&mesh, pieces, distance, &mut known);
        if crossings.is_empty() {
            return Ok((lattice, mesh));
        }
        let (next, is_changed) = recovered(lattice, &crossings, pieces, distance);
        lattice = next;
        if !is_changed {
            return Ok((lattice, mesh));
        }
    }
    let mesh = delaunay.connect(lattice.atoms(), watch)?;
    Ok((lattice, mesh))
}
