//! What a run will take, before it starts.

use crate::fields::NominalDistance;
use crate::image::Grid;

/// What a run is expected to take.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Estimate {
    /// Atoms, which become the mesh's points.
    pub atoms: u64,
    /// Triangles or tetrahedra.
    pub cells: u64,
    /// Bytes at the peak, the image's own samples left out.
    pub memory: u64,
}

/// Bytes an atom takes at the peak: coordinates, the optimizer's history, neighbour lists.
const ATOM_BYTES: f64 = 600.0;
/// Bytes a cell takes while atoms are connected.
const CELL_BYTES: f64 = 60.0;
/// Bytes that any run takes.
const BASE_BYTES: f64 = 16e6;

impl Estimate {
    /// For so many samples held in so many single-precision copies, and so many atoms.
    pub(super) fn new<const D: usize>(samples: usize, atoms: f64, copies: usize) -> Self {
        // Euler: 2 triangles a point. Random points have 6.77 tetrahedra each, lattices 5 to 6.
        let cells = atoms * if D == 2 { 2.0 } else { 6.0 };
        let memory =
            BASE_BYTES + 4.0 * (samples * copies) as f64 + ATOM_BYTES * atoms + CELL_BYTES * cells;
        Self { atoms: atoms as u64, cells: cells as u64, memory: memory as u64 }
    }
}

/// What the number of atoms of a lattice depends on.
#[derive(Clone, Copy, Debug)]
pub(super) struct Filling {
    /// Atoms per d^D.
    pub density: f64,
    /// By how much the boundary's atoms seem to widen the box along each axis, in d; measured.
    pub rim: f64,
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
