//! The cells in conflict with a point.

use super::Triangulation;
use super::dimension::{Dimension, Simplices};
use super::storage::{Cell, Cells, Mark};
use crate::geometry::Point;
use std::ops::Range;

impl<const D: usize, const N: usize> Triangulation<D, N>
where
    Simplices: Dimension<D, N>,
{
    /// Finds all cells in conflict with `p`, from the one that holds it, and the facets around them.
    ///
    /// Works from the cells of one step to all their neighbours at once. Whether a cell is in conflict
    /// cannot be predicted: without a branch on it the processor works on many at a time.
    pub(super) fn dig(&mut self, p: &Point<D>, holder: u32) {
        debug_assert!(self.conflicts(&self.cells.list[holder as usize], p));
        self.cavity.clear();
        self.cavity.push(holder);
        self.cells.marks[holder as usize] = Mark::Conflict;
        let mut start = 0;
        while start < self.cavity.len() {
            let end = self.cavity.len();
            self.test_neighbours(start..end, p);
            start = end;
        }
        self.surround();
    }

    /// Adds to the cavity the neighbours of some of its cells that are in conflict with `p`.
    #[inline]
    fn test_neighbours(&mut self, steps: Range<usize>, p: &Point<D>) {
        let Cells { list, marks, .. } = &mut self.cells;
        self.candidates.resize(self.candidates.len().max(N * steps.len()), (0, 0.0));
        let mut count = 0;
        for &cell in &self.cavity[steps] {
            for facet in list[cell as usize].neighbours {
                let mark = &mut marks[(facet >> 2) as usize];
                self.candidates[count].0 = facet >> 2;
                count += usize::from(*mark == Mark::Unseen);
                *mark = if *mark == Mark::Unseen { Mark::Pending } else { *mark };
            }
        }
        for (cell, rounded) in &mut self.candidates[..count] {
            let corners = list[*cell as usize].corners;
            let corners = corners.map(|v| &self.vertices[v as usize].at);
            *rounded = Simplices::rounded_in_sphere(corners, p);
        }
        let mut end = self.cavity.len();
        self.cavity.resize(end + count, 0);
        for at in 0..count {
            let (cell, rounded) = self.candidates[at];
            let here = &self.cells.list[cell as usize];
            let conflict = match self.predicates.in_sphere_if_clear(rounded) {
                Some(inside) if !here.is_infinite() => inside,
                _ => self.conflicts(here, p),
            };
            self.cells.marks[cell as usize] = if conflict { Mark::Conflict } else { Mark::Kept };
            self.cavity[end] = cell;
            end += usize::from(conflict);
        }
        self.cavity.truncate(end);
    }

    /// Finds the facets around the cavity.
    #[inline]
    fn surround(&mut self) {
        self.boundary.resize(N * self.cavity.len(), 0);
        let mut count = 0;
        for &cell in &self.cavity {
            for facet in self.cells.list[cell as usize].neighbours {
                self.boundary[count] = facet;
                count += usize::from(self.cells.marks[(facet >> 2) as usize] == Mark::Kept);
            }
        }
        self.boundary.truncate(count);
    }

    /// Finds all cells in conflict, from some of them, and the facets around them: `cavity` and
    /// `boundary`. The cells are marked.
    #[inline(always)]
    pub(super) fn spread(
        &mut self,
        from: impl IntoIterator<Item = u32>,
        conflicts: impl Fn(&Self, &Cell<N>) -> bool,
    ) {
        self.boundary.clear();
        self.cavity.clear();
        for cell in from {
            if self.cells.marks[cell as usize] != Mark::Conflict {
                self.cells.marks[cell as usize] = Mark::Conflict;
                self.cavity.push(cell);
            }
        }
        let mut next = 0;
        while let Some(&cell) = self.cavity.get(next) {
            next += 1;
            for facet in self.cells.list[cell as usize].neighbours {
                let neighbour = (facet >> 2) as usize;
                match self.cells.marks[neighbour] {
                    Mark::Conflict => {}
                    Mark::Kept => self.boundary.push(facet),
                    _ if conflicts(self, &self.cells.list[neighbour]) => {
                        self.cells.marks[neighbour] = Mark::Conflict;
                        self.cavity.push(neighbour as u32);
                    }
                    _ => {
                        self.cells.marks[neighbour] = Mark::Kept;
                        self.boundary.push(facet);
                    }
                }
            }
        }
    }

    /// Whether the circumsphere of the cell holds `p`. That of an infinite cell is the open half
    /// space beyond its facet and, in the facet's plane, the sphere around it: what the plane cuts from the
    /// circumsphere of the finite cell behind, perturbed or not.
    pub(super) fn conflicts(&self, cell: &Cell<N>, p: &Point<D>) -> bool {
        let mut corners = cell.corners.map(|vertex| &self.vertices[vertex as usize].at);
        if !cell.is_infinite() {
            return self.predicates.in_sphere(corners, p);
        }
        corners[D] = p;
        let side = self.predicates.orientation(corners);
        if side != 0.0 {
            return side > 0.0;
        }
        let behind = cell.behind() as usize;
        match self.cells.marks[behind] {
            Mark::Conflict => true,
            Mark::Kept => false,
            _ => self.conflicts(&self.cells.list[behind], p),
        }
    }
}
