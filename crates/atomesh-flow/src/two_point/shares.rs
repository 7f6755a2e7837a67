//! The fluxes through the sides of a cell whose pressure is given: together they balance the cell, and each is near
//! what the velocity in the cell makes it.

use atomesh::geometry::{Point, dot};

use crate::grid::FlowGrid;

/// Shares what has to flow out of a cell, `excess`, among its `fixed` faces on sides, whose entries in `fluxes` are 0
/// before. Each gets the flux of the velocity that fits the cell's other faces by least squares; the rest is shared by
/// area. So a uniform velocity is exact in the corners of the box, too.
pub(super) fn share<const D: usize>(
    grid: &FlowGrid<D>,
    cell: usize,
    fixed: &[u32],
    excess: f64,
    fluxes: &mut [f64],
) {
    let velocity = match fixed.len() {
        1 => [0.0; D],
        _ => velocity(grid, cell, fixed, fluxes).unwrap_or([0.0; D]),
    };
    let facets = grid.facets();
    let of = |face: &u32| &facets[*face as usize];
    let guess = |face: &u32| dot(&velocity, &of(face).area);
    let whole: f64 = fixed.iter().map(|face| of(face).measure()).sum();
    let rest = excess - fixed.iter().map(guess).sum::<f64>();
    for face in fixed {
        fluxes[*face as usize] = guess(face) + rest * of(face).measure() / whole;
    }
}

/// The least sum of (flux − v · area)² / area over the faces that are not fixed; `None` if they do not determine v.
fn velocity<const D: usize>(
    grid: &FlowGrid<D>,
    cell: usize,
    fixed: &[u32],
    fluxes: &[f64],
) -> Option<Point<D>> {
    let (mut matrix, mut rhs) = ([[0.0; D]; D], [0.0; D]);
    for face in grid.facets_of(cell).iter().filter(|face| !fixed.contains(face)) {
        let facet = &grid.facets()[*face as usize];
        let measure = facet.measure();
        if measure == 0.0 {
            continue;
        }
        for i in 0..D {
            // seen from the other side, area and flux both change sign
            rhs[i] += facet.area[i] * fluxes[*face as usize] / measure;
            (0..D).for_each(|j| matrix[i][j] += facet.area[i] * facet.area[j] / measure);
        }
    }
    solved(matrix, rhs)
}

/// Solves by Gaussian elimination, for a positive semidefinite matrix; `None` if a pivot is lost to rounding.
fn solved<const D: usize>(mut matrix: [[f64; D]; D], mut rhs: [f64; D]) -> Option<Point<D>> {
    let largest = (0..D).fold(0.0_f64, |most, i| most.max(matrix[i][i]));
    for i in 0..D {
        let pivot = matrix[i][i];
        if pivot <= 1e-6 * largest || pivot.is_nan() {
            return None;
        }
        for below in i + 1..D {
            let times = matrix[below][i] / pivot;
            let row = matrix[i];
            (i..D).for_each(|j| matrix[below][j] -= times * row[j]);
            rhs[below] -= times * rhs[i];
        }
    }
    for i in (0..D).rev() {
        let known: f64 = (i + 1..D).map(|j| matrix[i][j] * rhs[j]).sum();
        rhs[i] = (rhs[i] - known) / matrix[i][i];
    }
    Some(rhs)
}
