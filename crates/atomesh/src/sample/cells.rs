//! Cells as closed surfaces: simplices, polygons and polyhedra.

use crate::geometry::Point;
use crate::mesh::{Mesh, PolyMesh};

/// Cells as closed surfaces: whatever has flat facets can be sampled.
pub trait CellSurfaces<const D: usize>: Sync {
    /// How many cells there are.
    fn cell_count(&self) -> usize;

    /// Calls `visit` with the corners of each facet of a cell, a convex polygon (3-D) or an edge (2-D). In 3-D
    /// they follow each other counter-clockwise as seen from outside, in 2-D the cell lies to the left; all
    /// facets of a cell may go the other way round.
    fn visit_facets(&self, cell: usize, visit: &mut dyn FnMut(&[Point<D>]));
}

impl<const D: usize> CellSurfaces<D> for Mesh<D> {
    fn cell_count(&self) -> usize {
        Self::cell_count(self)
    }

    fn visit_facets(&self, cell: usize, visit: &mut dyn FnMut(&[Point<D>])) {
        for opposite in 0..=D {
            let facet = self.facet_of(cell, opposite);
            visit(&facet.map(|corner| self.points()[corner as usize]));
        }
    }
}

impl<const D: usize> CellSurfaces<D> for PolyMesh<D> {
    fn cell_count(&self) -> usize {
        Self::cell_count(self)
    }

    fn visit_facets(&self, cell: usize, visit: &mut dyn FnMut(&[Point<D>])) {
        let mut corners: Vec<Point<D>> = Vec::new();
        for (face, out) in self.faces_of(cell) {
            corners.clear();
            corners.extend(self.face(face).iter().map(|&at| self.points()[at as usize]));
            if out < 0.0 {
                corners.reverse();
            }
            visit(&corners);
        }
    }
}
