//! The cells in conflict with a point.

use super::Triangulation;
use super::storage::{Mark, Tetrahedron};
use crate::geometry::Point;

impl Triangulation {
    /// Finds all cells in conflict with `p`, from the one that holds it, and the facets around them.
    #[inline]
    pub(super) fn dig(&mut self, p: &Point<3>, holder: u32) {
        debug_assert!(self.conflicts(&self.tetrahedra.cells[holder as usize], p));
        self.spread([holder], |triangulation, cell| triangulation.conflicts(cell, p));
    }

    /// Finds all cells in conflict, from some of them, and the facets around them: `cavity` and
    /// `boundary`. The cells are marked.
    #[inline(always)]
    pub(super) fn spread(
        &mut self,
        from: impl IntoIterator<Item = u32>,
        conflicts: impl Fn(&Self, &Tetrahedron) -> bool,
    ) {
        self.boundary.clear();
        self.cavity.clear();
        for cell in from {
            if self.tetrahedra.marks[cell as usize] != Mark::Conflict {
                self.tetrahedra.marks[cell as usize] = Mark::Conflict;
                self.cavity.push(cell);
            }
        }
        let mut next = 0;
        while let Some(&cell) = self.cavity.get(next) {
            next += 1;
            for facet in self.tetrahedra.cells[cell as usize].neighbours {
                let neighbour = (facet >> 2) as usize;
                match self.tetrahedra.marks[neighbour] {
                    Mark::Conflict => {}
                    Mark::Kept => self.boundary.push(facet),
                    _ if conflicts(self, &self.tetrahedra.cells[neighbour]) => {
                        self.tetrahedra.marks[neighbour] = Mark::Conflict;
                        self.cavity.push(neighbour as u32);
                    }
                    _ => {
                        self.tetrahedra.marks[neighbour] = Mark::Kept;
                        self.boundary.push(facet);
                    }
                }
            }
        }
    }

    /// Whether the circumsphere of the cell holds `p`. That of an infinite cell is the open half
    /// space beyond its facet and, in the facet's plane, the circle around it: the circle that the
    /// plane cuts from the circumsphere of the finite cell behind, perturbed or not.
    fn conflicts(&self, cell: &Tetrahedron, p: &Point<3>) -> bool {
        let at = |k: usize| &self.vertices[cell.corners[k] as usize].at;
        if !cell.is_infinite() {
            return self.predicates.in_sphere([at(0), at(1), at(2), at(3)], p);
        }
        let side = self.predicates.orientation([at(0), at(1), at(2), p]);
        if side != 0.0 {
            return side > 0.0;
        }
        let behind = (cell.neighbours[3] >> 2) as usize;
        match self.tetrahedra.marks[behind] {
            Mark::Conflict => true,
            Mark::Kept => false,
            _ => self.conflicts(&self.tetrahedra.cells[behind], p),
        }
    }
}
