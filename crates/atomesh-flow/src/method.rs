//! Flow in the plane or in space, as a value: what callers that are generic over the dimension call.
//!
//! The functions behind it are compiled in this crate, once for each dimension. A caller that names the generic
//! functions themselves compiles them again.

use atomesh::features::FeatureFaces;
use atomesh::geometry::Point;
use atomesh::mesh::{Mesh, PolyMesh, Tags};
use atomesh::watch::Watch;

use crate::dg::{self, DgOptions, DgSolution};
use crate::error::FlowError;
use crate::grid::FlowGrid;
use crate::permeability::Permeability;
use crate::problem::Problem;
use crate::setting::Setting;
use crate::solution::{Balance, Solution};
use crate::solve::SolveOptions;
use crate::streamlines::{self, Porosity, Streamline, TraceOptions};
use crate::two_point;

type SolveDg<const D: usize> = fn(
    &FlowGrid<D>,
    &Setting<'_, D>,
    &DgOptions,
    &mut dyn Watch,
) -> Result<DgSolution<D>, FlowError>;

type SolveTwoPoint<const D: usize> = fn(
    &PolyMesh<D>,
    &FlowGrid<D>,
    &Setting<'_, D>,
    &SolveOptions,
    &mut dyn Watch,
) -> Result<Solution<D>, FlowError>;

type Trace<const D: usize> = fn(
    &FlowGrid<D>,
    &Setting<'_, D>,
    &Solution<D>,
    &TraceOptions<'_>,
    &mut dyn Watch,
) -> Result<Vec<Streamline<D>>, FlowError>;

type TimeOfFlight<const D: usize> = fn(
    &FlowGrid<D>,
    &Setting<'_, D>,
    &Solution<D>,
    Porosity<'_>,
    &mut dyn Watch,
) -> Result<Vec<f64>, FlowError>;

type Transmissibilities<const D: usize> =
    fn(&PolyMesh<D>, &Permeability<D>, &[f64]) -> Result<Vec<f64>, FlowError>;

/// The functions of flow in `D` dimensions; each does what the function that it is named after says.
#[derive(Clone, Copy)]
pub struct FlowMethod<const D: usize> {
    /// [`FlowGrid::of_mesh`].
    pub grid_of_mesh: fn(&Mesh<D>, &Tags<D>) -> FlowGrid<D>,
    /// [`FlowGrid::of_cells`].
    pub grid_of_cells: fn(&PolyMesh<D>, Option<&FeatureFaces>) -> FlowGrid<D>,
    /// [`Setting::new`].
    pub setting: for<'a> fn(&'a Problem<'a, D>, &FlowGrid<D>) -> Result<Setting<'a, D>, FlowError>,
    /// [`dg::solve`](dg::solve()).
    pub solve_dg: SolveDg<D>,
    /// [`two_point::solve`](two_point::solve()).
    pub solve_two_point: SolveTwoPoint<D>,
    /// [`two_point::transmissibilities`].
    pub transmissibilities: Transmissibilities<D>,
    /// [`streamlines::trace`].
    pub trace: Trace<D>,
    /// [`streamlines::time_of_flight`].
    pub time_of_flight: TimeOfFlight<D>,
    /// [`Solution::velocities`].
    pub velocities: fn(&Solution<D>, &FlowGrid<D>) -> Vec<Point<D>>,
    /// [`Solution::balance`].
    pub balance: fn(&Solution<D>, &FlowGrid<D>) -> Balance,
}

impl FlowMethod<2> {
    /// Flow on triangles and polygons.
    // inlined elsewhere, it would have all functions compiled there
    #[inline(never)]
    pub fn plane() -> Self {
        Self::new()
    }
}

impl FlowMethod<3> {
    /// Flow on tetrahedra and polyhedra.
    #[inline(never)]
    pub fn space() -> Self {
        Self::new()
    }
}

impl<const D: usize> FlowMethod<D> {
    fn new() -> Self {
        Self {
            grid_of_mesh: FlowGrid::of_mesh,
            grid_of_cells: FlowGrid::of_cells,
            setting: |problem, grid| Setting::new(problem, grid),
            solve_dg: dg::solve,
            solve_two_point: two_point::solve,
            transmissibilities: two_point::transmissibilities,
            trace: streamlines::trace,
            time_of_flight: streamlines::time_of_flight,
            velocities: |solution, grid| solution.velocities(grid),
            balance: |solution, grid| solution.balance(grid),
        }
    }
}
