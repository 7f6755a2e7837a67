//! The solution: polynomials, and the fluxes between them.

use atomesh::geometry::Point;
use rayon::prelude::*;

use super::balance::{Flows, balance};
use super::basis::Basis;
use super::element::Affine;
use super::loads::place;
use super::quadrature::Rule;
use super::scheme::{Scheme, gradient, value};
use crate::error::FlowError;
use crate::grid::FlowGrid;
use crate::problem::Control;
use crate::setting::well_index;
use crate::solution::{Solution, WellFlow};
use crate::solve::SolveReport;

/// Flow by discontinuous Galerkin: the solution that every scheme gives, and the pressure as a polynomial in each cell.
#[derive(Clone, Debug)]
pub struct DgSolution<const D: usize> {
    /// Mean pressures, fluxes, wells.
    pub solution: Solution<D>,
    basis: Basis<D>,
    cells: Vec<Affine<D>>,
    /// Cell by cell.
    coefficients: Vec<f64>,
}

impl<const D: usize> DgSolution<D> {
    /// The degree of the polynomials.
    pub fn order(&self) -> usize {
        self.basis.order()
    }

    /// The pressure of a cell's polynomial at a place in the cell; outside it has no meaning.
    ///
    /// # Panics
    /// If there is no such cell.
    pub fn pressure(&self, cell: usize, place: &Point<D>) -> f64 {
        let coordinates = self.cells[cell].coordinates(place);
        value(self.of(cell), &self.basis.values(&coordinates))
    }

    /// The gradient of a cell's polynomial at a place.
    ///
    /// # Panics
    /// If there is no such cell.
    pub fn gradient(&self, cell: usize, place: &Point<D>) -> Point<D> {
        let coordinates = self.cells[cell].coordinates(place);
        let slopes = self.basis.slopes(&coordinates).map(|slopes| value(self.of(cell), &slopes));
        gradient(&self.cells[cell], &slopes)
    }

    /// The distance in L² of the pressure from `exact`, `√∫(p − exact)²`, and `√∫exact²`, over the cells for which
    /// `includes` holds; by quadrature, exact for polynomials two degrees higher.
    ///
    /// # Panics
    /// If the grid is not the one solved on.
    pub fn l2_distance(
        &self,
        grid: &FlowGrid<D>,
        includes: impl Fn(usize) -> bool,
        exact: impl Fn(&Point<D>) -> f64,
    ) -> (f64, f64) {
        let mesh = grid.mesh().expect("the grid solved on is of simplices");
        assert_eq!(mesh.cell_count(), self.cells.len(), "the grid solved on");
        let rule = Rule::new(D + 1, 2 * self.order() + 4);
        let (mut error, mut norm) = (0.0, 0.0);
        for (cell, corners) in mesh.cells().enumerate().filter(|(cell, _)| includes(*cell)) {
            for (barycentric, weight) in rule.places().zip(&rule.weights) {
                let place = place(mesh.points(), corners, barycentric);
                let (weight, exact) = (weight * grid.measures()[cell], exact(&place));
                error += weight * (self.pressure(cell, &place) - exact).powi(2);
                norm += weight * exact * exact;
            }
        }
        (error.sqrt(), norm.sqrt())
    }

    fn of(&self, cell: usize) -> &[f64] {
        let count = self.basis.count();
        &self.coefficients[cell * count..(cell + 1) * count]
    }
}

/// Computes fluxes and wells from the coefficients of the pressures relative to their references, and adds the references.
pub(super) fn conclude<const D: usize>(
    scheme: Scheme<'_, D>,
    mut coefficients: Vec<f64>,
    sources: Vec<f64>,
    solve: SolveReport,
) -> Result<DgSolution<D>, FlowError> {
    let grid = scheme.grid;
    let count = scheme.element.count();
    let facets = (0..grid.facets().len()).into_par_iter();
    let fluxes = facets.map(|facet| scheme.flux(facet, &coefficients)).collect();
    let rates = vec![0.0; scheme.setting.wells().len()];
    let mut flows = Flows { fluxes, sources, rates };
    for well in &scheme.pressure_wells {
        let share = |cell: u32| grid.measures()[cell as usize] / well.measure;
        let mean: f64 =
            well.cells.iter().map(|&c| share(c) * coefficients[c as usize * count]).sum();
        flows.rates[well.well] = well.index * (well.pressure - mean);
        for &cell in &well.cells {
            flows.sources[cell as usize] += share(cell) * flows.rates[well.well];
        }
    }
    balance(&scheme, &mut flows);
    let Flows { fluxes, sources, rates } = flows;
    for (cell, own) in coefficients.chunks_exact_mut(count).enumerate() {
        own[0] += scheme.reference(cell);
    }
    let pressures: Vec<f64> = coefficients.iter().step_by(count).copied().collect();
    let wells = wells(&scheme, &pressures, &rates)?;
    let pinned = scheme.setting.pinned().map(|(number, _)| number + 1).collect();
    let solution = Solution { pressures, fluxes, sources, wells, pinned, solve };
    let Scheme { cells, element, .. } = scheme;
    Ok(DgSolution { solution, basis: element.basis, cells, coefficients })
}

/// The flow of each well; `rates` holds those of wells of given pressure.
fn wells<const D: usize>(
    scheme: &Scheme<'_, D>,
    pressures: &[f64],
    rates: &[f64],
) -> Result<Vec<WellFlow>, FlowError> {
    let report = |placed: &crate::setting::PlacedWell| {
        let well = &scheme.setting.problem().wells[placed.well];
        let part = |cell: u32| scheme.grid.measures()[cell as usize] / placed.measure;
        let cell_pressure =
            placed.cells.iter().map(|&cell| part(cell) * pressures[cell as usize]).sum();
        let (rate, wall_pressure) = match well.control {
            Control::Pressure(pressure) => (rates[placed.well], Some(pressure)),
            Control::Rate(rate) if well.radius.is_none() => (rate, None),
            Control::Rate(rate) => {
                let equivalent = placed.equivalent_radius::<D>();
                let index =
                    well_index::<D>(&well.name, placed.permeability, well.radius, equivalent)?;
                (rate, Some(cell_pressure + rate / index))
            }
        };
        let compartment = scheme.setting.compartment_of()[placed.cells[0] as usize] as usize + 1;
        let name = well.name.clone();
        Ok(WellFlow { name, compartment, rate, cell_pressure, wall_pressure })
    };
    scheme.setting.wells().iter().map(report).collect()
}
