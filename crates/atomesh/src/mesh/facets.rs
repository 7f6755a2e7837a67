//! Facets: the edges of triangles, the faces of tetrahedra, each with the cells beside it.

use std::ops::Range;

use crate::parallel::prelude::*;

use super::Mesh;
use crate::geometry::{Point, difference};

/// Points whose facets one task gathers.
const BLOCK: usize = 1 << 12;

/// A facet of a mesh: an edge in 2-D, a triangle in 3-D.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Facet<const D: usize> {
    /// The corners, ascending.
    pub corners: [u32; D],
    /// A cell that has the facet; the lowest.
    pub cell: u32,
    /// The cell on the other side, or `None` on the hull.
    pub neighbour: Option<u32>,
}

/// A facet as one of its cells has it.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct HalfFacet<const D: usize> {
    /// The facet's corners, ascending.
    pub corners: [u32; D],
    pub cell: u32,
    /// The cell's corner off the facet.
    pub apex: u32,
}

impl<const D: usize> Mesh<D> {
    /// All facets, in lexicographic order of their corners. Of more than two cells at a facet, a fault that
    /// [`Mesh::validate`] names, the two lowest are given. Cost: O(cells).
    pub fn facets(&self) -> Vec<Facet<D>> {
        let of_block = |points, cells: &CellsOfPoints| {
            let mut facets = Vec::new();
            self.each_facet_led_by(points, cells, |halves| {
                let neighbour = halves.get(1).map(|half| half.cell);
                facets.push(Facet { corners: halves[0].corners, cell: halves[0].cell, neighbour });
            });
            Some(facets)
        };
        self.blocks(of_block).collect::<Vec<_>>().concat()
    }

    /// What `of_block` gives for each block of points and the cells of all points, on all threads.
    fn blocks<T: Send>(
        &self,
        of_block: impl Fn(Range<u32>, &CellsOfPoints) -> Option<T> + Sync + Send,
    ) -> impl Parallel<Item = T> {
        let cells = self.cells_of_points();
        let count = self.points.len();
        let blocks = (0..count.div_ceil(BLOCK)).into_par_iter().map(|block| block * BLOCK);
        blocks.filter_map(move |start| {
            of_block(start as u32..count.min(start + BLOCK) as u32, &cells)
        })
    }

    /// The facet of a cell opposite to its corner number `opposite`, its normal out of the cell if the
    /// cell has positive orientation. The *normal* of a facet is to the right of an edge from its first
    /// corner to its second (2-D), or on the side from which the corners of a triangle run
    /// counter-clockwise (3-D).
    ///
    /// # Panics
    /// If the cell or the corner does not exist.
    pub fn facet_of(&self, cell: usize, opposite: usize) -> [u32; D] {
        let corners = &self.corners[cell * Self::CORNERS..(cell + 1) * Self::CORNERS];
        assert!(opposite <= D, "a cell has D + 1 corners");
        let mut facet = std::array::from_fn(|k| corners[k + usize::from(k >= opposite)]);
        if opposite % 2 == 1 {
            facet.swap(D - 2, D - 1);
        }
        facet
    }

    /// The facet of a cell that has these corners, in any order, turned as [`Mesh::facet_of`] turns it; `None` if the
    /// cell has no such facet.
    pub(crate) fn facet_out_of(&self, cell: u32, corners: &[u32; D]) -> Option<[u32; D]> {
        let at = cell as usize * Self::CORNERS;
        let own = &self.corners[at..at + Self::CORNERS];
        let opposite = own.iter().position(|corner| !corners.contains(corner))?;
        corners.iter().all(|c| own.contains(c)).then(|| self.facet_of(cell as usize, opposite))
    }

    /// The facet's normal, as long as the facet is long (2-D) or large (3-D).
    ///
    /// # Panics
    /// If a corner is not a point of the mesh.
    pub fn facet_normal(&self, facet: &[u32; D]) -> Point<D> {
        area_vector(&facet.map(|corner| self.points[corner as usize]))
    }

    /// What `find` finds first, of each facet as all of its cells have it, by ascending cells; facets come in lexicographic
    /// order.
    pub(super) fn first_of_facets<T: Send>(
        &self,
        find: impl Fn(&[HalfFacet<D>]) -> Option<T> + Sync + Send,
    ) -> Option<T> {
        let of_block = |points, cells: &CellsOfPoints| {
            let mut found = None;
            self.each_facet_led_by(points, cells, |halves| {
                found = found.take().or_else(|| find(halves));
            });
            found
        };
        self.blocks(of_block).find_first(|_| true)
    }

    /// Calls `visit` with each facet whose lowest corner is one of these points, as all of its cells have it, by ascending
    /// cells; facets come in lexicographic order.
    fn each_facet_led_by(
        &self,
        points: Range<u32>,
        cells: &CellsOfPoints,
        mut visit: impl FnMut(&[HalfFacet<D>]),
    ) {
        let mut halves: Vec<HalfFacet<D>> = Vec::new();
        for point in points {
            halves.clear();
            for &cell in cells.of(point) {
                self.facets_led_by(point, cell, &mut halves);
            }
            halves.sort_unstable();
            halves.chunk_by(|a, b| a.corners == b.corners).for_each(&mut visit);
        }
    }

    /// Appends the facets of a cell whose lowest corner is `point`.
    fn facets_led_by(&self, point: u32, cell: u32, halves: &mut Vec<HalfFacet<D>>) {
        let at = cell as usize * Self::CORNERS;
        let corners = &self.corners[at..at + Self::CORNERS];
        for (skip, &apex) in corners.iter().enumerate() {
            let mut corners: [u32; D] =
                std::array::from_fn(|k| corners[k + usize::from(k >= skip)]);
            corners.sort_unstable();
            if corners[0] == point {
                halves.push(HalfFacet { corners, cell, apex });
            }
        }
    }

    /// The cells that have each point as a corner. Cost: O(cells).
    pub fn cells_of_points(&self) -> CellsOfPoints {
        let mut starts = vec![0_u32; self.points.len() + 1];
        for &corner in &self.corners {
            starts[corner as usize + 1] += 1;
        }
        for point in 0..self.points.len() {
            starts[point + 1] += starts[point];
        }
        let mut next = starts.clone();
        let mut cells = vec![0; self.corners.len()];
        for (at, &corner) in self.corners.iter().enumerate() {
            let place = &mut next[corner as usize];
            cells[*place as usize] = (at / Self::CORNERS) as u32;
            *place += 1;
        }
        CellsOfPoints { starts, cells }
    }

    /// The cells that have all corners of `facet`, ascending: one or two for a facet of a valid mesh, none for other
    /// corners.
    pub fn cells_beside<'a>(
        &'a self,
        facet: &'a [u32; D],
        cells: &'a CellsOfPoints,
    ) -> impl Iterator<Item = u32> + 'a {
        let has_all = |cell: &u32| {
            let at = *cell as usize * Self::CORNERS;
            let corners = &self.corners[at..at + Self::CORNERS];
            facet.iter().all(|corner| corners.contains(corner))
        };
        cells.of(facet[0]).iter().copied().filter(has_all)
    }
}

/// The cells of a mesh that have each point as a corner.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CellsOfPoints {
    /// Where the cells of each point begin, and where the last ones end.
    starts: Vec<u32>,
    cells: Vec<u32>,
}

impl CellsOfPoints {
    /// The cells of a point, ascending; none if the point does not exist.
    #[inline]
    pub fn of(&self, point: u32) -> &[u32] {
        match self.starts.get(point as usize..point as usize + 2) {
            Some(&[start, end]) => &self.cells[start as usize..end as usize],
            _ => &[],
        }
    }
}

/// The normal of a segment or triangle, as long as the segment is long or the triangle large: to the right of a
/// segment from its first point to its second, on the side from which a triangle's points run counter-clockwise.
pub(crate) fn area_vector<const D: usize>(corners: &[Point<D>; D]) -> Point<D> {
    const { assert!(D == 2 || D == 3) };
    let u = difference(&corners[1], &corners[0]);
    if D == 2 {
        return std::array::from_fn(|k| if k == 0 { u[1] } else { -u[0] });
    }
    let v = difference(&corners[D - 1], &corners[0]);
    std::array::from_fn(|k| {
        let (a, b) = ((k + 1) % D, (k + 2) % D);
        0.5 * (u[a] * v[b] - u[b] * v[a])
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_triangles_share_one_of_five_edges() {
        let points = vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        let mesh = Mesh::new(points, vec![0, 1, 2, 2, 3, 0]).unwrap();
        let found = mesh.facets();
        let corners: Vec<[u32; 2]> = found.iter().map(|facet| facet.corners).collect();
        assert_eq!(corners, [[0, 1], [0, 2], [0, 3], [1, 2], [2, 3]]);
        assert_eq!(found[1], Facet { corners: [0, 2], cell: 0, neighbour: Some(1) });
        assert_eq!(found[4], Facet { corners: [2, 3], cell: 1, neighbour: None });
    }
    #[test]
    fn facets_of_a_cell_have_their_normals_out_of_it() {
        let plane = Mesh::new(vec![[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], vec![0, 1, 2]).unwrap();
        assert_eq!([0, 1, 2].map(|k| plane.facet_of(0, k)), [[1, 2], [2, 0], [0, 1]]);
        assert_eq!(plane.facet_normal(&[2, 0]), [-1.0, 0.0]);
        let points = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let space = Mesh::new(points, vec![0, 1, 2, 3]).unwrap();
        for k in 0..4 {
            // out of the cell: the corner opposite lies behind, and so makes a negative tetrahedron
            let [a, b, c] = space.facet_of(0, k);
            let simplex = space.simplex(&[a, b, c, k as u32]);
            assert!(simplex.orientation() < 0.0, "{k}");
            // and the normals of a closed surface cancel
            let normal = space.facet_normal(&[a, b, c]);
            let expected =
                if k == 0 { [0.5; 3] } else { [1, 2, 3].map(|j| if j == k { -0.5 } else { 0.0 }) };
            assert_eq!(normal.map(|x| x + 0.0), expected, "{k}");
        }
        assert_eq!(space.facet_out_of(0, &[0, 2, 3]), Some(space.facet_of(0, 1)));
        assert_eq!(space.facet_out_of(0, &[0, 2, 9]), None);
    }

    #[test]
    fn cells_beside_a_facet_are_those_that_it_names() {
        let points = vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        let mesh = Mesh::new(points, vec![0, 1, 2, 2, 3, 0]).unwrap();
        let cells = mesh.cells_of_points();
        let beside = |facet: [u32; 2]| mesh.cells_beside(&facet, &cells).collect::<Vec<_>>();
        assert_eq!(beside([2, 0]), [0, 1]);
        assert_eq!(beside([2, 3]), [1]);
        assert!(beside([1, 3]).is_empty());
        assert!(beside([9, 3]).is_empty());
    }
}
