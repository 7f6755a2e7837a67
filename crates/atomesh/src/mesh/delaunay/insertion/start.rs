//! The first cell and the infinite cells around it.

use super::dimension::{Dimension, Simplices};
use super::predicates::exact_orientation;
use super::storage::{Cells, INFINITE, Vertex};
use crate::geometry::Point;
use robust::{Coord, orient2d};

/// Moves the first vertices that span a cell, positive, to the front of the order; false if all lie on one line
/// (plane) or plane (space).
pub(super) fn bring_simplex_first<const D: usize, const N: usize>(
    vertices: &[Vertex<D>],
    order: &mut [u32],
) -> bool
where
    Simplices: Dimension<D, N>,
{
    let at = |vertex: u32| &vertices[vertex as usize].at;
    if D == 3 {
        let is_third = |&k: &usize| !are_collinear([at(order[0]), at(order[1]), at(order[k])]);
        let Some(third) = (2..order.len()).find(is_third) else { return false };
        order[2..=third].rotate_right(1);
    }
    let orientation = |order: &[u32], k: usize| {
        exact_orientation(std::array::from_fn(|i| at(order[if i < D { i } else { k }])))
    };
    let Some(last) = (D..order.len()).find(|&k| orientation(order, k) != 0.0) else {
        return false;
    };
    order[D..=last].rotate_right(1);
    if orientation(order, D) < 0.0 {
        order.swap(0, 1);
    }
    true
}

/// Whether three points in space lie on one line: their shadows along every axis do.
fn are_collinear<const D: usize>(points: [&Point<D>; 3]) -> bool {
    (0..D).all(|axis| {
        let [a, b, c] = points.map(|p| Coord { x: p[(axis + 1) % D], y: p[(axis + 2) % D] });
        orient2d(a, b, c) == 0.0
    })
}

/// One positive cell and an infinite cell beyond each facet.
pub(super) fn first_cells<const D: usize, const N: usize>(
    first: [u32; N],
    point_count: usize,
) -> Cells<N>
where
    Simplices: Dimension<D, N>,
{
    let mut cells = Cells::with_capacity(Simplices::CELLS_A_POINT * point_count);
    let outside = Simplices::FACETS.map(|facet| {
        let mut corners = facet.map(|k| first[k]);
        corners.swap(D - 2, D - 1);
        corners[D] = INFINITE;
        corners
    });
    for corners in std::iter::once(first).chain(outside) {
        let place = cells.allocate();
        cells.list[place as usize].corners = corners;
    }
    let facets = (0..=N).flat_map(|cell| (0..N).map(move |corner| [cell, corner]));
    for facet in facets.clone() {
        let is_same =
            |other: &[usize; 2]| *other != facet && rim(&cells, *other) == rim(&cells, facet);
        let [other, corner] = facets.clone().find(is_same).expect("the cells close up");
        let [cell, side] = facet;
        cells.list[cell].neighbours[side] = (4 * other + corner) as u32;
    }
    cells
}

/// The vertices of a facet, sorted.
fn rim<const D: usize, const N: usize>(cells: &Cells<N>, [cell, corner]: [usize; 2]) -> [u32; D]
where
    Simplices: Dimension<D, N>,
{
    let facet = Simplices::FACETS[corner];
    let mut rim = std::array::from_fn(|k| cells.list[cell].corners[facet[k]]);
    rim.sort_unstable();
    rim
}
