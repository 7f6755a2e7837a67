//! Discontinuous Galerkin on triangles and tetrahedra.
//!
//! In each cell the pressure is a polynomial, coupled to its neighbours' only by the fluxes through facets (see
//! `interface`). So pressure may jump, mass balances in every cell, and a fault is a facet with a reduced flux, or
//! none. Permeability is a number or a tensor, constant in each cell.
//!
//! 1. `scheme`: maps of the cells and interfaces of the facets, from polynomials that are orthonormal in every
//!    cell (`basis`) and tables that all cells share (`element`, `quadrature`);
//! 2. `loads`: the right-hand side, from source term, wells and boundary; `assemble`: the matrix, each cell its rows;
//! 3. `coarse`: the continuous linear functions, the coarse space for solving;
//! 4. `solution`: fluxes from the pressures; `balance`: corrects them so that every cell balances to rounding.
//!
//! Assumes cells of positive measure, as [`atomesh::mesh::Mesh::validate`] checks. Cost besides solving: O(cells).
//! The same bits at any number of threads.

mod assemble;
mod balance;
mod basis;
mod coarse;
mod element;
mod interface;
mod loads;
mod options;
mod quadrature;
mod scheme;
mod solution;
#[cfg(test)]
mod tests;

use atomesh::watch::{Phase, Watch, check};

pub use options::{DgOptions, Form, UnknownForm};
pub use solution::DgSolution;

use crate::error::FlowError;
use crate::grid::FlowGrid;
use crate::setting::Setting;
use crate::solve::{self, System};
use options::MOST_ORDER;
use scheme::Scheme;

/// An estimate of the memory that [`solve()`] takes when it iterates, in bytes: [`memory_of`] the grid's cells. Factors
/// keep to [`SolveOptions::memory`](crate::solve::SolveOptions::memory).
pub fn memory<const D: usize>(grid: &FlowGrid<D>, options: &DgOptions) -> u64 {
    let inner = grid.facets().iter().filter(|facet| facet.neighbour.is_some()).count();
    memory_of::<D>(grid.cell_count() as u64, inner as u64, options.order)
}

/// The same for so many cells and facets between them: 26 bytes for each entry of the matrix, that is for each pair of
/// functions in a cell and the cells beside it, and 200 for each unknown. Measured on 4,700 and 35,000 tetrahedra of
/// second order.
pub fn memory_of<const D: usize>(cells: u64, inner_facets: u64, order: usize) -> u64 {
    let block = unknowns_of::<D>(1, order);
    26 * block * block * (cells + 2 * inner_facets) + 200 * block * cells
}

/// How many unknowns so many cells have: the polynomials of that order in D variables, for each.
pub fn unknowns_of<const D: usize>(cells: u64, order: usize) -> u64 {
    let block = (1..=D).fold(1, |n, k| n * (order.min(MOST_ORDER) + k) / k) as u64;
    block * cells
}

/// The estimated memory of a Cholesky factor of n equations in the plane, in bytes: 6.7 ln n numbers for each row.
pub fn factor_memory(unknowns: u64) -> u64 {
    let n = unknowns.max(2) as f64;
    (8.0 * 6.7 * n * n.ln()) as u64
}

/// Solves `−∇·(k∇p) = q`.
///
/// Reports [`Phase::Assemble`] and [`Phase::Solve`].
///
/// # Errors
/// [`FlowError`]: an order or penalty out of range, a grid of Voronoi cells, a well radius out of range, equations that
/// were not solved, or the watch.
pub fn solve<const D: usize>(
    grid: &FlowGrid<D>,
    setting: &Setting<'_, D>,
    options: &DgOptions,
    watch: &mut dyn Watch,
) -> Result<DgSolution<D>, FlowError> {
    options.check()?;
    check(watch, Phase::Assemble, 0.0, None)?;
    let scheme = Scheme::new(grid, setting, options)?;
    let loads = loads::loads(&scheme);
    let matrix = assemble::matrix(&scheme, watch)?;
    let coarse = coarse::coarse(&scheme);
    let system = System {
        matrix: &matrix,
        rhs: &loads.rhs,
        is_symmetric: options.form == Form::InteriorPenalty,
        block: scheme.element.count(),
        places: grid.centroids(),
        coarse: Some(&coarse),
    };
    let (coefficients, report) = solve::solve(&system, &options.solve, watch)?;
    solution::conclude(scheme, coefficients, loads.sources, report)
}
