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
mod quadrature;
mod scheme;
mod solution;
#[cfg(test)]
mod tests;

use atomesh::watch::{Phase, Watch, check};

pub use solution::DgSolution;

use crate::error::FlowError;
use crate::grid::Grid;
use crate::setting::Setting;
use crate::solve::{self, SolveOptions, System};
use scheme::Scheme;

/// The highest order.
const MOST_ORDER: usize = 3;

/// A form of discontinuous Galerkin.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Form {
    /// Symmetric interior penalty (Arnold 1982), with weighted means (Ern, Stephansen & Zunino 2009): symmetric
    /// positive definite equations, stable from order 1, order p + 1 in L².
    #[default]
    #[serde(rename = "sipg")]
    InteriorPenalty,
    /// Oden, Babuška & Baumann (1998), whom Hale (2001) follows: no penalty, equations that are not symmetric, stable
    /// from order 2; order p + 1 in L² for odd p, p for even p.
    #[serde(rename = "obb")]
    OdenBabuskaBaumann,
}

impl Form {
    /// All forms.
    pub const ALL: [Self; 2] = [Self::InteriorPenalty, Self::OdenBabuskaBaumann];

    /// A short lower-case name: `sipg` or `obb`.
    pub fn name(self) -> &'static str {
        match self {
            Self::InteriorPenalty => "sipg",
            Self::OdenBabuskaBaumann => "obb",
        }
    }

    /// The lowest order that is stable.
    pub fn least_order(self) -> usize {
        match self {
            Self::InteriorPenalty => 1,
            Self::OdenBabuskaBaumann => 2,
        }
    }
}

/// A name that no form has.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("no form is named {0:?}; known are sipg, obb")]
pub struct UnknownForm(pub String);

impl std::str::FromStr for Form {
    type Err = UnknownForm;

    fn from_str(name: &str) -> Result<Self, UnknownForm> {
        let found = Self::ALL.into_iter().find(|form| form.name() == name);
        found.ok_or_else(|| UnknownForm(name.to_string()))
    }
}

/// Options of [`solve()`].
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct DgOptions {
    /// The form. Default symmetric interior penalty: stable from order 1, and symmetric.
    pub form: Form,
    /// The degree p of the polynomials: 1 to 3, with Oden, Babuška and Baumann's form 2 or 3. Default 2: the jump across
    /// a slit then has less error than by order 1 with cells half as large and twice as many unknowns (measured:
    /// 0.5 % with cells of 1/10 of the slit's half length, order 1 with 1/20 0.8 %).
    pub order: usize,
    /// The penalty over the least that is proven to be stable, on any mesh and with any permeability; 1 or more.
    /// Default 1.5: of 1, 1.5, 2 and 4 the one with the least error in the jump across a slit, at every order.
    pub penalty: f64,
    /// How the equations are solved.
    pub solve: SolveOptions,
}

impl Default for DgOptions {
    fn default() -> Self {
        Self { form: Form::InteriorPenalty, order: 2, penalty: 1.5, solve: SolveOptions::default() }
    }
}

impl DgOptions {
    fn check(&self) -> Result<(), FlowError> {
        let least = self.form.least_order();
        if !(least..=MOST_ORDER).contains(&self.order) {
            let (found, form) = (self.order, self.form.name());
            return Err(FlowError::Order { found, form, least, most: MOST_ORDER });
        }
        if !(self.penalty >= 1.0 && self.penalty.is_finite()) {
            return Err(FlowError::Penalty { value: self.penalty });
        }
        Ok(())
    }
}

/// About how much memory [`solve()`] takes for a grid, in bytes, where it iterates: 34 for each entry of the matrix, that
/// is for each pair of functions in a cell and the cells beside it, and 260 for each unknown. Measured; factors, where
/// they are taken, keep to [`SolveOptions::memory`].
pub fn memory<const D: usize>(grid: &Grid<D>, options: &DgOptions) -> u64 {
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
    grid: &Grid<D>,
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
