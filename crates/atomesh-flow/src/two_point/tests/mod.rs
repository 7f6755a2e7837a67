//! Known answers of two-point flux.

mod barriers;
mod exact;
mod wells;

use atomesh::geometry::{Bounds, Point, lexicographic};
use atomesh::mesh::{Delaunay, PolyMesh};
use atomesh::voronoi::voronoi;
use atomesh::watch::Silent;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::*;
use crate::grid::FacetSet;
use crate::problem::{Barrier, Boundary, Condition, Control, Problem, Value, Well};

/// What differs between 2-D and 3-D here: the connector.
trait Dimension<const D: usize> {
    fn delaunay() -> Delaunay<D>;
}
struct Axes;
impl Dimension<2> for Axes {
    fn delaunay() -> Delaunay<2> {
        Delaunay::<2>::new()
    }
}
impl Dimension<3> for Axes {
    fn delaunay() -> Delaunay<3> {
        Delaunay::<3>::new()
    }
}

fn cells_of<const D: usize>(sites: &[Point<D>], bounds: Bounds<D>) -> PolyMesh<D>
where
    Axes: Dimension<D>,
{
    voronoi(&<Axes as Dimension<D>>::delaunay(), sites, bounds, &mut Silent).unwrap()
}

/// Sites of a lattice of squares or cubes of side `step`: from the corner `first`, `counts` along each axis.
fn lattice<const D: usize>(first: Point<D>, step: f64, counts: [usize; D]) -> Vec<Point<D>> {
    let site = |mut n: usize| {
        std::array::from_fn(|k| {
            let at = n % counts[k];
            n /= counts[k];
            first[k] + step * at as f64
        })
    };
    (0..counts.iter().product()).map(site).collect()
}

/// Sites at random in a cube of side 1, about one in five coordinates on a side of it, none nearer to another than
/// a tenth of the mean distance: faces of nearer ones are turned by rounding.
fn scattered<const D: usize>(count: usize, seed: u64) -> Vec<Point<D>> {
    let mut random = Pcg64::seed_from_u64(seed);
    let least = 0.1 * (count as f64).powf(-1.0 / D as f64);
    let mut sites: Vec<Point<D>> = Vec::new();
    while sites.len() < count {
        let site = std::array::from_fn(|_| match random.random_range(0..10) {
            0 => 0.0,
            1 => 1.0,
            _ => random.random::<f64>(),
        });
        let apart =
            |other: &Point<D>| atomesh::geometry::distance_squared(&site, other) > least * least;
        if sites.iter().all(apart) {
            sites.push(site);
        }
    }
    sites.sort_by(lexicographic);
    sites
}

fn cube<const D: usize>(side: f64) -> Bounds<D> {
    Bounds { min: [0.0; D], max: [side; D] }
}

/// The pressure on every side.
fn all_sides<'a, const D: usize>(
    pressure: &'a (dyn Fn(&Point<D>) -> f64 + Sync),
) -> Vec<Boundary<'a, D>> {
    let condition = Condition::Pressure(Value::Field(pressure));
    let side = |n| Boundary { group: atomesh::mesh::side_name(n).to_string(), condition };
    (0..2 * D).map(side).collect()
}

fn pressure_on<const D: usize>(group: &str, pressure: f64) -> Boundary<'static, D> {
    let condition = Condition::Pressure(Value::Constant(pressure));
    Boundary { group: group.to_string(), condition }
}

fn well<const D: usize>(place: Point<D>, control: Control, radius: Option<f64>) -> Well<D> {
    Well { name: "well".to_string(), place, control, radius }
}

/// Names the faces inside the box whose centroids the test chooses.
fn name_faces<const D: usize>(
    grid: &mut FlowGrid<D>,
    name: &str,
    chosen: impl Fn(&crate::grid::FlowFacet<D>) -> bool,
) -> usize {
    let inner = grid.facets().iter().enumerate().filter(|(_, f)| f.neighbour.is_some());
    let facets: Vec<u32> = inner.filter(|(_, f)| chosen(f)).map(|(n, _)| n as u32).collect();
    let count = facets.len();
    grid.add_set(FacetSet { name: name.to_string(), facets });
    count
}

/// Solves, and checks what holds of every answer: mass balances, and barriers leak nothing.
fn answer<const D: usize>(
    cells: &PolyMesh<D>,
    grid: &FlowGrid<D>,
    problem: &Problem<'_, D>,
) -> Solution<D> {
    let setting = Setting::new(problem, grid).unwrap();
    let found = solve(cells, grid, &setting, &SolveOptions::default(), &mut Silent).unwrap();
    let balance = found.balance(grid);
    // what flows is of size 1 in all tests, or nought, and then there is only rounding to compare with
    let scale = balance.scale.max(1e-3);
    assert!(balance.cell_error.max(balance.error.abs()) <= 1e-10 * scale, "{balance:?}");
    assert_eq!(found.leak(grid, &setting), 0.0);
    found
}
