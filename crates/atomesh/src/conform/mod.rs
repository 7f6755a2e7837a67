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
mod connect;
mod curves;
mod cut;
mod facets;
mod recover;
mod segments;
mod trace;
mod unmet;

use std::collections::HashSet;

use crate::parallel::prelude::*;

use crate::crests::Pieces;
use crate::fields::{FieldsView, NominalDistance, ScalarField};
use crate::geometry::{Bins, Point, PointGrid, distance_squared};
use crate::image::Grid;
use crate::lattice::{Lattice, LatticeError, Scatterer, fill_holes, fill_holes_near};
use crate::optimize::{OptimizeError, OptimizeOptions, OptimizeReport, optimize};
use crate::watch::{Cancelled, Watch};

use atoms::{FeatureAtom, feature_atoms};
pub use connect::connect;
pub use cut::cut_cells;
pub(crate) use facets::are_on_pieces;
pub use facets::{FeatureFacet, feature_facets};
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
/// Planes of samples that one task clears.
const PLANES: usize = 16;
/// How often holes are looked for and filled.
const FILL_ROUNDS: usize = 2;

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
/// Reports [`crate::watch::Phase::Grow`] and [`crate::watch::Phase::Optimize`] to `watch`.
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
    // crystals that grow around wells, or where d varies, leave holes where they meet
    let is_whole =
        distance.is_constant() && (0..lattice.len()).all(|i| lattice.temperature(i) > 0.0);
    let mut lattice = without_near(lattice, &atoms, distance, 0);
    let bits = |p: &Point<D>| p.map(f64::to_bits);
    let there: HashSet<[u64; D]> = lattice.atoms().iter().map(bits).collect();
    for FeatureAtom { position, .. } in atoms.iter().filter(|a| !there.contains(&bits(&a.position)))
    {
        lattice.push(*position, bounds.freedom(position), 0.0);
    }
    let met = atoms.iter().map(|atom| atom.position).collect::<Vec<_>>();
    let lattice = match is_whole {
        true => fill_holes_near(scatterer, lattice, &met, distance, FILL_ROUNDS, watch)?,
        false => fill_holes(scatterer, lattice, distance, FILL_ROUNDS, watch)?,
    };
    let lattice = without_near(lattice.along_curve(), &atoms, distance, 1);
    let options = OptimizeOptions { smoothing_steps: 0, ..options.clone() };
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
    let near_met = PointGrid::new(&grid.bounds(), distance.least(), met.iter().copied());
    let is_met = |place: &Point<D>| {
        let (reach, mut is_met) = (MET * distance.at(place), false);
        near_met.near(place, reach, |other, _| {
            is_met |= distance_squared(place, other) <= reach * reach;
        });
        is_met
    };
    // balls about places so far apart leave nothing of what is as near to the piece as asked for
    let ball = |place: Point<D>| {
        let near = (CLEARED * distance.at(&place)).max(CLEARED_STEPS * pieces.step());
        (place, near.hypot(pieces.sparse()))
    };
    let balls: Vec<(Point<D>, f64)> = pieces.sparse_places().filter(is_met).map(ball).collect();
    let mut samples: Vec<f32> = potential.samples().par_iter().copied().collect();
    let plane: usize = grid.shape[..D - 1].iter().product();
    samples.par_chunks_mut(PLANES * plane).enumerate().for_each(|(chunk, samples)| {
        let first = chunk * PLANES;
        let block = Block { first, planes: samples.len() / plane, grid: &grid };
        balls.iter().for_each(|(place, reach)| block.clear(samples, place, *reach));
    });
    ScalarField::potential(grid, samples, potential.interpolation())
        .expect("values within -1 to 1, one for each sample")
}

/// Some planes of samples, of a grid.
struct Block<'a, const D: usize> {
    first: usize,
    planes: usize,
    grid: &'a Grid<D>,
}

impl<const D: usize> Block<'_, D> {
    /// Makes the samples of the block within a ball 0.
    fn clear(&self, samples: &mut [f32], centre: &Point<D>, reach: f64) {
        let Grid { shape, step } = *self.grid;
        // casts leave what is below 0 at it
        let from = |x: f64| x.max(0.0) as usize + usize::from(x > 0.0 && x.fract() > 0.0);
        let up_to = |x: f64| if x < 0.0 { 0 } else { x as usize + 1 };
        let range = |k: usize| {
            let [low, high] = [centre[k] - reach, centre[k] + reach].map(|x| x / step[k]);
            let planes =
                if k == D - 1 { self.first..self.first + self.planes } else { 0..shape[k] };
            from(low).max(planes.start)..up_to(high).min(planes.end)
        };
        let ranges: [std::ops::Range<usize>; D] = std::array::from_fn(range);
        for row in 0..ranges[1..].iter().map(ExactSizeIterator::len).product() {
            let (mut rest, mut index, mut stride) = (row, 0, shape[0]);
            let mut beside = 0.0;
            for k in 1..D {
                let at = ranges[k].start + rest % ranges[k].len();
                rest /= ranges[k].len();
                beside += (at as f64 * step[k] - centre[k]).powi(2);
                index += (if k == D - 1 { at - self.first } else { at }) * stride;
                stride *= shape[k];
            }
            if beside <= reach * reach {
                let half = (reach * reach - beside).sqrt();
                let first = from((centre[0] - half) / step[0]);
                let end = up_to((centre[0] + half) / step[0]).min(shape[0]);
                samples[index + first.min(end)..index + end].fill(0.0);
            }
        }
    }
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
