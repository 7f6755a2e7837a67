//! The first tetrahedron and the infinite cells around it.

use super::predicates::exact_orientation;
use super::storage::{FACETS, INFINITE, Tetrahedra, Vertex};
use crate::geometry::Point;
use robust::{Coord, orient2d};

/// Cells for each point, finite and infinite, at random; the arrays grow if there are more.
const CELLS_A_POINT: usize = 7;

/// Moves the first four vertices that span a tetrahedron, positive, to the front of the order; false
/// if all lie on one plane.
pub(super) fn bring_simplex_first(vertices: &[Vertex], order: &mut [u32]) -> bool {
    let at = |vertex: u32| &vertices[vertex as usize].at;
    let Some(third) =
        (2..order.len()).find(|&k| !are_collinear([at(order[0]), at(order[1]), at(order[k])]))
    else {
        return false;
    };
    order[2..=third].rotate_right(1);
    let orientation =
        |order: &[u32], k: usize| exact_orientation([0, 1, 2, k].map(|i| at(order[i])));
    let Some(fourth) = (3..order.len()).find(|&k| orientation(order, k) != 0.0) else {
        return false;
    };
    order[3..=fourth].rotate_right(1);
    if orientation(order, 3) < 0.0 {
        order.swap(0, 1);
    }
    true
}

/// Whether three points lie on one line: their shadows along every axis do.
fn are_collinear(points: [&Point<3>; 3]) -> bool {
    (0..3).all(|axis| {
        let [a, b, c] = points.map(|p| Coord { x: p[(axis + 1) % 3], y: p[(axis + 2) % 3] });
        orient2d(a, b, c) == 0.0
    })
}

/// One positive cell and an infinite cell beyond each facet.
pub(super) fn first_cells(first: [u32; 4], point_count: usize) -> Tetrahedra {
    let mut tetrahedra = Tetrahedra::with_capacity(CELLS_A_POINT * point_count);
    let outside = FACETS.map(|[a, b, c]| [first[a], first[c], first[b], INFINITE]);
    for corners in std::iter::once(first).chain(outside) {
        let place = tetrahedra.allocate();
        tetrahedra.cells[place as usize].corners = corners;
    }
    for facet in 0..20 {
        let same = (0..20)
            .find(|&other| other != facet && rim(&tetrahedra, other) == rim(&tetrahedra, facet));
        let other = same.expect("five cells close up") as u32;
        tetrahedra.cells[facet / 4].neighbours[facet % 4] = other;
    }
    tetrahedra
}

/// The vertices of a facet, sorted.
fn rim(tetrahedra: &Tetrahedra, facet: usize) -> [u32; 3] {
    let mut rim = FACETS[facet % 4].map(|k| tetrahedra.cells[facet / 4].corners[k]);
    rim.sort_unstable();
    rim
}
