//! The parts into which facets cut a mesh: its connected components.

use crate::geometry::Sets;
use crate::mesh::Mesh;

/// The number of the part that each cell belongs to, from 1 on in the order of the parts' first cells. Two cells are of
/// one part if a path through facets leads from one to the other without crossing any of `walls` (corners in any
/// order). Cost: O(cells).
///
/// ```
/// use atomesh::{mesh::Mesh, region::components};
///
/// let square = vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
/// let mesh = Mesh::new(square, vec![0, 1, 2, 0, 2, 3])?;
/// assert_eq!(components(&mesh, &[]), [1, 1]);
/// assert_eq!(components(&mesh, &[[2, 0]]), [1, 2]);
/// # Ok::<(), atomesh::mesh::MeshError>(())
/// ```
pub fn components<const D: usize>(mesh: &Mesh<D>, walls: &[[u32; D]]) -> Vec<i32> {
    let mut walls: Vec<[u32; D]> = walls.to_vec();
    walls.iter_mut().for_each(|wall| wall.sort_unstable());
    walls.sort_unstable();
    let mut parts = Sets::new(mesh.cell_count());
    for facet in mesh.facets() {
        if let Some(other) = facet.neighbour
            && walls.binary_search(&facet.corners).is_err()
        {
            parts.join(facet.cell, other);
        }
    }
    parts.numbers().into_iter().map(|number| number as i32 + 1).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wall_with_a_gap_parts_nothing() {
        // a strip of six triangles; the walls across it are the edges between neighbours
        let points = (0..8).map(|i| [f64::from(i / 2), f64::from(i % 2)]).collect();
        let corners = (0..3).flat_map(|i| {
            let a = 2 * i;
            [a, a + 2, a + 1, a + 2, a + 3, a + 1]
        });
        let mesh = Mesh::<2>::new(points, corners.collect()).unwrap();
        assert_eq!(mesh.validate(), Ok(()));
        assert_eq!(components(&mesh, &[]), [1; 6]);
        assert_eq!(components(&mesh, &[[3, 2]]), [1, 1, 2, 2, 2, 2]);
        assert_eq!(components(&mesh, &[[2, 3], [4, 5]]), [1, 1, 2, 2, 3, 3]);
        // behind a wall on the hull there is no cell
        assert_eq!(components(&mesh, &[[0, 2], [0, 1]]), [1; 6]);
    }
}
