//! The distinct edges and facets of a mesh.

use crate::mesh::Mesh;
use rayon::prelude::*;

/// The distinct faces with `K` corners of all cells, corners ascending, in lexicographic order.
///
/// `K = 2` gives the edges, `K = D` the facets (in 2-D the same). Cost: O(n log n) in cells.
pub(super) fn faces<const D: usize, const K: usize>(mesh: &Mesh<D>) -> Vec<[u32; K]> {
    // each face of a simplex is a choice of K of its D + 1 corners
    let choices: Vec<[usize; K]> = (0u32..1 << (D + 1))
        .filter(|set| set.count_ones() as usize == K)
        .map(|set| {
            let mut members = (0..=D).filter(|k| set >> k & 1 == 1);
            std::array::from_fn(|_| members.next().unwrap_or(0))
        })
        .collect();
    let mut faces = Vec::with_capacity(mesh.cell_count() * choices.len());
    for cell in mesh.cells() {
        for choice in &choices {
            let mut face = choice.map(|k| cell[k]);
            face.sort_unstable();
            faces.push(face);
        }
    }
    faces.par_sort_unstable();
    faces.dedup();
    faces
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_triangles_share_an_edge() {
        let square = vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        let mesh = Mesh::new(square, vec![0, 1, 2, 0, 2, 3]).unwrap();
        let edges = faces::<2, 2>(&mesh);
        assert_eq!(edges, [[0, 1], [0, 2], [0, 3], [1, 2], [2, 3]]);
    }

    #[test]
    fn two_tetrahedra_share_a_facet_and_three_edges() {
        let points =
            vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 1.0, 1.0]];
        let mesh = Mesh::new(points, vec![0, 1, 2, 3, 1, 2, 3, 4]).unwrap();
        assert_eq!(faces::<3, 3>(&mesh).len(), 7);
        assert_eq!(faces::<3, 2>(&mesh).len(), 9);
    }
}
