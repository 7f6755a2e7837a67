//! Two-point flux on Voronoi cells: one pressure per cell, at its site, and through each face a flux in proportion to
//! the difference between the pressures on its two sides.
//!
//! Faces of Voronoi cells are normal to the lines between sites. So the flux of a linear pressure is exact for
//! isotropic permeability and cells of any shape (Heinemann et al. 1991). In order:
//!
//! 1. `transmissibility`: of each face between two cells, with k on either side and the multiplier of a barrier;
//! 2. `boundary`: conditions on faces on sides of the box. If the pressure is given on a side, a cell whose site lies on
//!    that side has this pressure, and no unknown;
//! 3. `well`: the radius at which a well's pressure is that of its cell;
//! 4. `equations`: one row for each unknown pressure, symmetric and positive definite; fluxes from the solution.
//!
//! Mass is conserved in each cell to the residual of the equations. The error of pressures is of order 2 in the
//! distance between sites on lattices, and of order 1 or more on other cells.

mod boundary;
mod equations;
mod shares;
#[cfg(test)]
mod tests;
mod transmissibility;
mod well;

pub use transmissibility::transmissibilities;
pub use well::{RINGS, equivalent_radius};

use atomesh::mesh::PolyMesh;
use atomesh::watch::{Phase, Watch, check};

use crate::error::FlowError;
use crate::grid::FlowGrid;
use crate::setting::Setting;
use crate::solution::Solution;
use crate::solve::SolveOptions;

/// Steady flow on Voronoi cells. `grid` is [`FlowGrid::of_cells`] of `cells`, with any sets added, and `setting` is of
/// that grid. Pressures are those at the sites.
///
/// Cost: that of solving one equation per cell. Reports [`Phase::Assemble`] and [`Phase::Solve`] to `watch`.
///
/// # Errors
/// [`FlowError::Tensor`] if the permeability is one, [`FlowError::Skewed`] if a face is not normal to the line between
/// its sites, [`FlowError::WellRadius`] if a well of given pressure has no radius or one that is too large, and the
/// errors of [`solve`](crate::solve::solve()).
///
/// # Panics
/// If the grid is not of these cells.
pub fn solve<const D: usize>(
    cells: &PolyMesh<D>,
    grid: &FlowGrid<D>,
    setting: &Setting<'_, D>,
    options: &SolveOptions,
    watch: &mut dyn Watch,
) -> Result<Solution<D>, FlowError> {
    assert_eq!(grid.facets().len(), cells.face_count(), "the grid is of these cells");
    check(watch, Phase::Assemble, 0.0, None)?;
    let inner = transmissibilities(cells, setting.permeability(), setting.multipliers())?;
    let sides = boundary::sides(cells, grid, setting);
    let wells = well::couple(cells, setting)?;
    let equations = equations::Equations::new(grid, setting, inner, sides, wells);
    let (pressures, report) = equations.solve(cells.centers(), options, watch)?;
    Ok(equations.solution(pressures, report).rest(grid, setting))
}
