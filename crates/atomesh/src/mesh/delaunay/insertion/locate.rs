//! The walk to the cell that holds a point.

use super::Triangulation;
use super::dimension::{Dimension, Simplices};
use crate::geometry::Point;

impl<const D: usize, const N: usize> Triangulation<D, N>
where
    Simplices: Dimension<D, N>,
{
    /// The finite cell that holds the point, which is not a vertex, or an infinite cell on whose side of the hull it
    /// lies.
    ///
    /// Steps through any facet that has the point strictly beyond it. In a Delaunay triangulation
    /// no cell is met twice (Edelsbrunner 1990), so the walk ends.
    pub(super) fn locate(&self, p: &Point<D>) -> u32 {
        let cells = &self.cells.list;
        // A walk that starts in an infinite cell goes inside first.
        let start = &cells[self.hint as usize];
        let (mut cell, mut entry) =
            if start.is_infinite() { (start.behind(), N) } else { (self.hint, N) };
        for _ in 0..=cells.len() {
            let here = &cells[cell as usize];
            if here.is_infinite() {
                return cell;
            }
            let corners = here.corners.map(|corner| &self.vertices[corner as usize].at);
            let exit = (0..N).find(|&k| {
                let mut facet = Simplices::FACETS[k].map(|corner| corners[corner]);
                facet[D] = p;
                k != entry && self.predicates.orientation(facet) < 0.0
            });
            let Some(exit) = exit else { return cell };
            let facet = here.neighbours[exit];
            (cell, entry) = (facet >> 2, (facet & 3) as usize);
        }
        unreachable!("a walk meets no cell of a Delaunay triangulation twice")
    }
}
