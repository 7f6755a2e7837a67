//! Facets: the edges of triangles, the faces of tetrahedra, each with the cells beside it.

use super::Mesh;

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

/// A cell beside a facet: the facet's corners, ascending; the cell; and its corner off the facet.
pub(super) type Side<const D: usize> = ([u32; D], u32, u32);

impl<const D: usize> Mesh<D> {
    /// All facets, in lexicographic order of their corners. Facets of more than two cells, a fault
    /// that [`Mesh::validate`] names, have the two lowest. Cost: O(cells).
    pub fn facets(&self) -> Vec<Facet<D>> {
        let mut facets = Vec::with_capacity(self.cell_count() * Self::CORNERS / 2);
        self.each_facet(|sides| {
            let neighbour = sides.get(1).map(|side| side.1);
            facets.push(Facet { corners: sides[0].0, cell: sides[0].1, neighbour });
        });
        facets
    }

    /// Calls `visit` with the cells beside each facet, ascending, facet after facet in lexicographic
    /// order.
    pub(super) fn each_facet(&self, mut visit: impl FnMut(&[Side<D>])) {
        let (starts, cells) = self.cells_of_points();
        let mut sides: Vec<Side<D>> = Vec::new();
        for point in 0..self.points.len() {
            sides.clear();
            for &cell in &cells[starts[point] as usize..starts[point + 1] as usize] {
                self.sides_led_by(point as u32, cell, &mut sides);
            }
            sides.sort_unstable();
            sides.chunk_by(|a, b| a.0 == b.0).for_each(&mut visit);
        }
    }

    /// Appends the facets of a cell whose lowest corner is `point`.
    fn sides_led_by(&self, point: u32, cell: u32, sides: &mut Vec<Side<D>>) {
        let at = cell as usize * Self::CORNERS;
        let corners = &self.corners[at..at + Self::CORNERS];
        for (skip, &apex) in corners.iter().enumerate() {
            let mut facet: [u32; D] = std::array::from_fn(|k| corners[k + usize::from(k >= skip)]);
            facet.sort_unstable();
            if facet[0] == point {
                sides.push((facet, cell, apex));
            }
        }
    }

    /// The cells that have each point as a corner: those of point `i` are
    /// `cells[starts[i]..starts[i + 1]]`, ascending.
    fn cells_of_points(&self) -> (Vec<u32>, Vec<u32>) {
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
        (starts, cells)
    }
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
}
