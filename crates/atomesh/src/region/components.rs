//! The parts into which facets cut a mesh.

use crate::mesh::Mesh;

/// For each cell the part that it belongs to, numbered from 1 in the order of their first cells: two cells are
/// of one part if a path through facets leads from one to the other and passes none of `walls` (corners in
/// any order). Cost: O(cells).
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
    let mut root: Vec<u32> = (0..mesh.cell_count() as u32).collect();
    for facet in mesh.facets() {
        if let Some(other) = facet.neighbour
            && walls.binary_search(&facet.corners).is_err()
        {
            join(&mut root, facet.cell, other);
        }
    }
    numbered(&mut root)
}

/// Makes two sets one, under the lower root.
pub(super) fn join(root: &mut [u32], a: u32, b: u32) {
    let (a, b) = (find(root, a), find(root, b));
    root[a.max(b) as usize] = a.min(b);
}

/// The root of a set; shortens the way there.
pub(super) fn find(root: &mut [u32], mut cell: u32) -> u32 {
    while root[cell as usize] != cell {
        root[cell as usize] = root[root[cell as usize] as usize];
        cell = root[cell as usize];
    }
    cell
}

/// The sets' numbers, from 1 in the order of their roots.
pub(super) fn numbered(root: &mut [u32]) -> Vec<i32> {
    let mut number = vec![0; root.len()];
    let mut count = 0;
    for cell in 0..root.len() {
        // the root of a set is its lowest cell, and so numbered before
        let at = find(root, cell as u32) as usize;
        if at == cell {
            count += 1;
            number[cell] = count;
        } else {
            number[cell] = number[at];
        }
    }
    number
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
        // on the hull there is nobody behind the wall
        assert_eq!(components(&mesh, &[[0, 2], [0, 1]]), [1; 6]);
    }
}
