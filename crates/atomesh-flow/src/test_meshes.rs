//! Random meshes for tests: jittered lattice points connected by Delaunay's rule, with named facets.

use atomesh::geometry::{Bounds, Point};
use atomesh::mesh::{Delaunay, FacetGroup, Mesh, Tags};
use atomesh::watch::Silent;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use crate::grid::{FacetSet, FlowGrid};

/// Points of a lattice of `steps` steps along each axis of the box, each moved at random by up to `jitter` (below 0.5) of
/// a step along each axis. Points on the boundary stay on their face or edge, corners in place.
pub(crate) fn jittered_points<const D: usize>(
    bounds: &Bounds<D>,
    steps: [usize; D],
    jitter: f64,
    seed: u64,
) -> Vec<Point<D>> {
    let mut random = Pcg64::seed_from_u64(seed);
    let count = steps.iter().map(|n| n + 1).product::<usize>();
    let extent = bounds.extent();
    let point = |number: usize| {
        let mut rest = number;
        std::array::from_fn(|axis| {
            let at = rest % (steps[axis] + 1);
            rest /= steps[axis] + 1;
            let away = jitter * random.random_range(-1.0..1.0);
            match at {
                0 => bounds.min[axis],
                at if at == steps[axis] => bounds.max[axis],
                at => bounds.min[axis] + extent[axis] * (at as f64 + away) / steps[axis] as f64,
            }
        })
    };
    (0..count).map(point).collect()
}

/// Delaunay's mesh of the points, as a grid whose sides are named `xmin` ... `zmax`.
pub(crate) fn connect<const D: usize>(delaunay: Delaunay<D>, points: &[Point<D>]) -> FlowGrid<D> {
    let mesh = delaunay.connect(points, &mut Silent).expect("distinct points");
    grid(&mesh, Vec::new())
}

/// The mesh of jittered points of the unit square or cube, with `steps` steps along each axis.
pub(crate) fn unit_box<const D: usize>(
    delaunay: Delaunay<D>,
    steps: usize,
    jitter: f64,
    seed: u64,
) -> FlowGrid<D> {
    let bounds = Bounds { min: [0.0; D], max: [1.0; D] };
    connect(delaunay, &jittered_points(&bounds, [steps; D], jitter, seed))
}

/// A mesh of a box as a grid, its sides named, with more groups of facets.
pub(crate) fn grid<const D: usize>(mesh: &Mesh<D>, groups: Vec<FacetGroup<D>>) -> FlowGrid<D> {
    let bounds = Bounds::of(mesh.points()).expect("a mesh has points");
    let tolerance = 1e-9 * bounds.extent().iter().fold(0.0_f64, |a, &b| a.max(b));
    let tags = Tags::sides(mesh, &bounds, tolerance);
    let tags = tags.merge(Tags::new(mesh, groups, None).expect("facets of the mesh"));
    FlowGrid::of_mesh(mesh, &tags.expect("names of their own"))
}

/// Names the inner facets for all of whose corners `holds` is true.
pub(crate) fn name_inner_facets<const D: usize>(
    grid: &mut FlowGrid<D>,
    name: &str,
    holds: impl Fn(&Point<D>) -> bool,
) {
    let mesh = grid.mesh().expect("triangles or tetrahedra");
    let on = |corners: &[u32; D]| corners.iter().all(|&c| holds(&mesh.points()[c as usize]));
    let inner = mesh.facets().into_iter().enumerate().filter(|(_, f)| f.neighbour.is_some());
    let facets = inner.filter(|(_, f)| on(&f.corners)).map(|(number, _)| number as u32).collect();
    grid.add_set(FacetSet { name: name.to_string(), facets });
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fills_the_box<const D: usize>(delaunay: Delaunay<D>) {
        let mut grid = unit_box(delaunay, 4, 0.3, 7);
        let measure: f64 = grid.measures().iter().sum();
        assert!((measure - 1.0).abs() < 1e-12, "{measure}");
        assert!(grid.mesh().unwrap().validate().is_ok());
        let sides: f64 = grid.sets()[..2 * D]
            .iter()
            .flat_map(|set| &set.facets)
            .map(|&facet| grid.facets()[facet as usize].measure())
            .sum();
        assert!((sides - 2.0 * D as f64).abs() < 1e-12, "{sides}");
        name_inner_facets(&mut grid, "all", |_| true);
        let boundary = grid.facets().iter().filter(|facet| facet.neighbour.is_none()).count();
        assert_eq!(grid.sets().last().unwrap().facets.len() + boundary, grid.facets().len());
    }

    #[test]
    fn a_jittered_mesh_fills_its_box_and_its_sides_are_named() {
        fills_the_box(Delaunay::<2>::new());
        fills_the_box(Delaunay::<3>::new());
    }
}
