//! Wells placed in cells, and the pressure at their walls.

use std::f64::consts::PI;

use atomesh::geometry::Sets;

use crate::error::FlowError;
use crate::grid::FlowGrid;
use crate::problem::{Control, Problem, Well};

/// A well with the cells that it flows into.
#[derive(Clone, Debug, PartialEq)]
pub struct PlacedWell {
    /// The well's number in the problem.
    pub well: usize,
    /// The cells that hold its place, ascending, all of one compartment. The well's rate is spread over their volume.
    pub cells: Vec<u32>,
    /// The area (plane) or volume (space) of the cells.
    pub measure: f64,
    /// The mean of the cells' permeabilities, by volume.
    pub permeability: f64,
}

/// Finds the cells of each well, in the problem's order.
///
/// # Errors
/// [`FlowError`] names a well outside the mesh, or with a number that is not finite.
pub(super) fn place_wells<const D: usize>(
    problem: &Problem<'_, D>,
    grid: &FlowGrid<D>,
    multipliers: &[f64],
) -> Result<Vec<PlacedWell>, FlowError> {
    let place = |(number, well): (usize, &Well<D>)| {
        let name = || well.name.clone();
        let (value, what) = match well.control {
            Control::Rate(rate) => (rate, "rate"),
            Control::Pressure(pressure) => (pressure, "pressure"),
        };
        if !value.is_finite() {
            return Err(FlowError::NotFinite { name: name(), what, value });
        }
        let found = grid.cells_at(&well.place);
        if found.is_empty() {
            return Err(FlowError::WellOutside { name: name(), place: well.place.to_vec() });
        }
        let cells = one_side(grid, multipliers, found);
        let measure_of = |cell: u32| grid.measures()[cell as usize];
        let measure: f64 = cells.iter().map(|&cell| measure_of(cell)).sum();
        let weighted =
            |&cell: &u32| problem.permeability.mean(cell as usize) * measure_of(cell) / measure;
        let permeability = cells.iter().map(weighted).sum();
        Ok(PlacedWell { well: number, cells, measure, permeability })
    };
    problem.wells.iter().enumerate().map(place).collect()
}

/// The cells that can be reached from the lowest one through facets without a barrier.
fn one_side<const D: usize>(grid: &FlowGrid<D>, multipliers: &[f64], cells: Vec<u32>) -> Vec<u32> {
    let mut sets = Sets::new(cells.len());
    for (at, &cell) in cells.iter().enumerate() {
        for &facet in grid.facets_of(cell as usize) {
            let other = grid.facets()[facet as usize].neighbour;
            let open = multipliers[facet as usize] == 1.0;
            let to = other.filter(|_| open).and_then(|other| cells.binary_search(&other).ok());
            if let Some(to) = to {
                sets.join(at as u32, to as u32);
            }
        }
    }
    let roots = sets.roots();
    cells.iter().zip(roots).filter(|(_, root)| *root == 0).map(|(&cell, _)| cell).collect()
}

impl PlacedWell {
    /// The radius at which the pressure around the well is the mean of its cells, for a scheme that spreads the rate
    /// over them. In the plane e^(−1/4) R, R = √(A/π) the radius of a disk of their area A; in space 5R/6, R that of a
    /// ball of their volume. Follows from `−k∇²p = q/A` within the disk or ball and the field of a line or point source
    /// outside.
    pub fn equivalent_radius<const D: usize>(&self) -> f64 {
        if D == 2 {
            (-0.25_f64).exp() * (self.measure / PI).sqrt()
        } else {
            5.0 / 6.0 * (self.measure * 3.0 / (4.0 * PI)).cbrt()
        }
    }
}

/// The rate of a well per unit of pressure difference between its wall, of radius r_w = `wall`, and the radius
/// r_e = `equivalent`: `2πk / ln(r_e/r_w)` in the plane, `4πk / (1/r_w − 1/r_e)` in space.
///
/// # Errors
/// [`FlowError::WellRadius`] unless 0 < wall < equivalent.
pub fn well_index<const D: usize>(
    name: &str,
    permeability: f64,
    wall: Option<f64>,
    equivalent: f64,
) -> Result<f64, FlowError> {
    let found = wall.unwrap_or(0.0);
    if !(found > 0.0 && found < equivalent) {
        return Err(FlowError::WellRadius { name: name.to_string(), found, equivalent });
    }
    Ok(match D {
        2 => 2.0 * PI * permeability / (equivalent / found).ln(),
        _ => 4.0 * PI * permeability / (1.0 / found - 1.0 / equivalent),
    })
}
