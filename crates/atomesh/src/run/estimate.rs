//! What a run will take, before it starts.

use crate::parallel::prelude::*;

use crate::enhance::{EdgeOperator, FeatureOptions, Features, Mixture};
use crate::fields::{Interpolation, NominalDistance, ScalarField};
use crate::image::Grid;

use super::find::LEAST_DEPTH;

/// What a run is expected to take.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Estimate {
    /// Atoms, which become the mesh's points.
    pub atoms: u64,
    /// Triangles or tetrahedra.
    pub cells: u64,
    /// Bytes at the peak of what follows the preparation, the image's own samples left out.
    pub memory: u64,
    /// Processor seconds from growth to mesh, of one core of our machine (2.5 GHz); others are within a factor of 2.
    pub cpu_seconds: f64,
}

/// What is done with atoms, by which the cost of each differs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Work {
    /// They stay as they were grown.
    AsGrown,
    /// They are moved, and facets turned onto features.
    Moved,
    /// They are put on features before all others.
    Conforming,
    /// They are divided by Voronoi cells.
    Divided,
}

impl Work {
    /// Bytes an atom takes at the peak, its cells included, in the plane and in space; measured on images of 160³ and
    /// 2000² samples.
    fn atom_bytes(self) -> [f64; 2] {
        match self {
            Self::AsGrown => [390.0, 1400.0], // crystals have ties, which cost
            Self::Moved => [530.0, 1450.0],   // of brains, whose features are everywhere
            Self::Conforming => [530.0, 1250.0],
            Self::Divided => [900.0, 3100.0],
        }
    }

    /// Processor seconds an atom takes, likewise.
    fn atom_seconds(self) -> [f64; 2] {
        match self {
            Self::AsGrown => [1.2e-5, 1.9e-5],
            Self::Moved => [6e-5, 2.6e-5],
            Self::Conforming => [4e-5, 6.5e-5],
            Self::Divided => [2e-5, 4e-5],
        }
    }
}

/// What there is besides atoms.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Beside {
    /// Samples of the image.
    pub samples: usize,
    /// Single-precision numbers held for each.
    pub copies: usize,
    /// Points of pieces of features.
    pub feature_points: usize,
    /// Bytes of the sampled engine's tables; 0 for other engines.
    pub tables: f64,
    /// Bytes that the improver takes to find valleys of b, and what lies beside them then; 0 if it looks for none.
    pub valleys: f64,
    /// How many atoms there are for each that d asks for: so many times the neighbours has each.
    pub crowding: f64,
}

/// Bytes that a point of a feature takes, with the grid that finds it.
const FEATURE_POINT_BYTES: f64 = 160.0;
/// Processor seconds that the sampled engine takes for each sample: some hundred evaluations.
const SAMPLED_SECONDS: f64 = 4.4e-7;
/// Neighbours of an atom in a lattice as dense as d asks for, listed, in the plane and in space.
const NEIGHBOURS: [f64; 2] = [10.0, 26.0];
/// Bytes that a neighbour takes in the lists.
const NEIGHBOUR_BYTES: f64 = 8.0;
/// The share of an atom's time that its neighbours take.
const PAIR_SHARE: f64 = 0.3;
/// Bytes an atom takes, its cells included, while valleys of b are looked for; measured in the plane.
const ATOM_BESIDE_VALLEYS: f64 = 82.0;
/// Bytes a sample that stages before have left behind by then, likewise.
const LEFT_BYTES: f64 = 6.0;
/// Bytes that any run takes.
const BASE_BYTES: f64 = 12e6;

impl Estimate {
    /// For so many atoms.
    pub(super) fn new<const D: usize>(work: Work, atoms: f64, beside: Beside) -> Self {
        // Euler: 2 triangles a point. Random points have 6.77 tetrahedra each, lattices 5 to 6.
        let cells = atoms * if D == 2 { 2.0 } else { 6.0 };
        let Beside { samples, copies, feature_points, tables, valleys, crowding } = beside;
        let crowded = crowding - 1.0;
        let lists = NEIGHBOUR_BYTES * NEIGHBOURS[D - 2] * crowded;
        let moving = 4.0 * (samples * copies) as f64
            + FEATURE_POINT_BYTES * feature_points as f64
            + tables
            + (work.atom_bytes()[D - 2] + lists) * atoms;
        let improving = valleys + if valleys > 0.0 { ATOM_BESIDE_VALLEYS * atoms } else { 0.0 };
        let memory = BASE_BYTES + moving.max(improving);
        let sampling = if tables > 0.0 { SAMPLED_SECONDS * samples as f64 } else { 0.0 };
        let each = work.atom_seconds()[D - 2] * (1.0 + PAIR_SHARE * crowded);
        let cpu_seconds = each * atoms + sampling;
        Self { atoms: atoms as u64, cells: cells as u64, memory: memory as u64, cpu_seconds }
    }
}

/// Bytes at the peak while the improver of the plane looks for valleys of b: a volume, b itself, what is left of stages
/// before, and for each sample in a valley its place, its depth and its derivatives. Cost: O(samples).
pub(super) fn valley_bytes<const D: usize>(potential: &ScalarField<D>) -> f64 {
    let samples = potential.samples();
    let is_deep = |b: &&f32| **b < -LEAST_DEPTH;
    let deep = samples.par_iter().with_min_len(1 << 16).filter(is_deep).count();
    let copies = if potential.interpolation() == Interpolation::Spline { 3.0 } else { 2.0 };
    let of_deep = 12.0 + 4.0 * (D + D * D) as f64;
    (4.0 * copies + LEFT_BYTES) * samples.len() as f64 + of_deep * deep as f64
}

/// Bytes a sample that making b takes at the peak, beside the image: b itself, and what finds features of these kinds.
pub fn potential_bytes(mixture: &Mixture, options: &FeatureOptions) -> f64 {
    let shares = mixture.shares();
    let kinds = shares.iter().map(|share| FeatureOptions { features: share.features, ..*options });
    let most = kinds.map(|kind| feature_bytes(&kind, shares.len() > 1)).fold(0.0, f64::max);
    4.0 + most
}

/// Bytes a sample that looking for features takes at the peak beside the image and b; what is less than a copy of b is
/// within the estimate of the rest. Measured on layers with noise, 160³ samples (2000² where the plane takes more).
pub(super) fn feature_bytes(options: &FeatureOptions, is_mixture: bool) -> f64 {
    let finding = match options.features {
        Features::None | Features::Dark | Features::Bright => 0.0,
        Features::Edges if options.edge_operator == EdgeOperator::Crest => 27.0,
        Features::Edges => 2.0,
        Features::Labels => 8.0,
        Features::Ridges => 14.0,
        Features::Horizons => 11.0,
        Features::Faults => 22.0,
    };
    let denoising = if options.denoise.is_some() { 5.0 } else { 0.0 };
    finding + denoising + if is_mixture { 4.0 } else { 0.0 }
}

/// What the number of atoms of a lattice depends on.
#[derive(Clone, Copy, Debug)]
pub(super) struct Filling {
    /// Atoms per d^D.
    pub density: f64,
    /// By how much the boundary's atoms seem to widen the box along each axis, in d; measured.
    pub rim: f64,
}

/// Where d varies, crystals of all sizes grow into each other, and atoms stand wherever others leave room: so many in
/// the place of one, times γ^−D, in the plane and in space; measured at γ from 0.1 to 0.6.
const CROWDING: [f64; 2] = [0.4, 0.37];

/// How many atoms a lattice grown with the spacing factor γ has for each that d asks for.
pub(super) fn crowding<const D: usize>(distance: &NominalDistance<D>, gamma: f64) -> f64 {
    if distance.is_constant() { 1.0 } else { (CROWDING[D - 2] / gamma.powi(D as i32)).max(1.0) }
}

/// About how many atoms fill the box, its boundary included.
pub(super) fn atoms<const D: usize>(
    grid: &Grid<D>,
    distance: &NominalDistance<D>,
    filling: Filling,
) -> f64 {
    let extent = grid.bounds().extent();
    let d = distance.mean();
    let widened: f64 = extent.iter().map(|e| 1.0 + filling.rim * d / e).product();
    (distance.estimated_atoms(filling.density) * widened).max((1 << D) as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn valleys_take_memory_by_their_share_of_the_samples() {
        let grid = Grid::<2> { shape: [40, 25], step: [1.0; 2] };
        // one sample in five is in a valley
        let b = (0..1000).map(|i| if i % 5 == 0 { -0.5 } else { -0.01 }).collect();
        let potential = ScalarField::potential(grid, b, Interpolation::Linear).unwrap();
        // b, a volume, six bytes; of those in valleys a place, a depth, two slopes and four second derivatives
        assert_eq!(valley_bytes(&potential), 14.0 * 1000.0 + 36.0 * 200.0);
        let beside = |valleys| Beside { samples: 1000, copies: 1, valleys, ..Beside::default() };
        let memory = |valleys| Estimate::new::<2>(Work::Moved, 10.0, beside(valleys)).memory;
        // of two peaks the greater counts
        assert_eq!(memory(0.0), memory(1000.0));
        assert_eq!(memory(1e6) as f64, BASE_BYTES + 1e6 + 820.0);
    }
}
