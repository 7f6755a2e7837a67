//! Discontinuous Galerkin on triangles and tetrahedra.
//!
//! In each cell the pressure is a polynomial; nothing joins those of neighbours but the flux between them (see
//! `interface`), so pressure may jump, mass balances in every cell, and a fault is a facet through which less flows,
//! or nothing. Permeability is a number or a tensor, constant in each cell.
//!
//! 1. maps of the cells and interfaces of the facets are made (`scheme`), of polynomials that are orthonormal in every
//!    cell (`basis`) and tables that all cells share (`element`, `quadrature`);
//! 2. what the source term, wells and the boundary bring is the right-hand side (`loads`); cells write their rows of
//!    the matrix (`assemble`);
//! 3. the equations are solved, with the continuous linear functions as the space of the smooth part (`coarse`);
//! 4. fluxes are read off (`solution`), and what solving left unbalanced is sent away (`balance`).
//!
//! Assumes cells of positive measure, such as [`atomesh::mesh::Mesh::validate`] finds. Cost besides solving: O(cells).
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

/// About how much memory [`solve()`] takes for a grid, in bytes, where it iterates: 34 for each entry of the matrix, that
/// is for each pair of functions in a cell and the cells beside it, and 260 for each unknown. Measured; factors, where
/// they are taken, keep to [`SolveOptions::memory`](crate::solve::SolveOptions::memory).
pub fn memory<const D: usize>(grid: &FlowGrid<D>, options: &DgOptions) -> u64 {
    let block = (1..=D).fold(1, |n, k| n * (options.order.min(MOST_ORDER) + k) / k) as u64;
    let inner = grid.facets().iter().filter(|facet| facet.neighbour.is_some()).count() as u64;
    let cells = grid.cell_count() as u64;
    34 * block * block * (cells + 2 * inner) + 260 * block * cells
}

/// Solves `−∇·(k∇p) = q`.
///
/// Reports [`Phase::Assemble`] and [`Phase::Solve`].
///
/// # Errors
/// [`FlowError`]: an order or penalty out of range, a grid of other than triangles or tetrahedra, a well whose radius
/// does not fit, equations that were not solved, or the watch.
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
