//! The walk to the cell that holds a point.

use super::Triangulation;
use super::storage::FACETS;
use crate::geometry::Point;

impl Triangulation {
    /// The finite cell that holds the point, which is not a vertex, or an infinite cell on whose side of the hull it
    /// lies.
    ///
    /// Steps through any facet that has the point strictly beyond it. In a Delaunay triangulation
    /// no cell is met twice (Edelsbrunner 1990), so the walk ends.
    pub(super) fn locate(&self, p: &Point<3>) -> u32 {
        let cells = &self.tetrahedra.cells;
        // A walk that starts in an infinite cell goes inside first.
        let start = &cells[self.hint as usize];
        let (mut cell, mut entry) =
            if start.is_infinite() { (start.neighbours[3] >> 2, 4) } else { (self.hint, 4) };
        for _ in 0..=cells.len() {
            let here = &cells[cell as usize];
            if here.is_infinite() {
                return cell;
            }
            let corners = here.corners.map(|corner| &self.vertices[corner as usize].at);
            let exit = (0..4).find(|&k| {
                let [a, b, c] = FACETS[k].map(|corner| corners[corner]);
                k != entry && self.predicates.orientation([a, b, c, p]) < 0.0
            });
            let Some(exit) = exit else { return cell };
            let facet = here.neighbours[exit];
            (cell, entry) = (facet >> 2, (facet & 3) as usize);
        }
        unreachable!("a walk meets no cell of a Delaunay triangulation twice")
    }
}
