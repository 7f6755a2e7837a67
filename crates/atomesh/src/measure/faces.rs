//! The distinct edges and facets of a mesh.

use crate::mesh::Mesh;
use crate::parallel::prelude::*;
use std::ops::Range;

/// The most points whose faces are sought at once, which limits how many faces are held twice.
const MOST_POINTS: usize = 1 << 19;

/// The distinct faces with `K` corners of all cells, corners ascending, in lexicographic order.
///
/// `K = 2` gives the edges, `K = D` the facets (in 2-D the same). The points are cut in parts. Each part looks among all
/// cells for the faces whose least corner it holds, and sorts those of one point at a time. Cost: O(n) in cells, where
/// few cells share a point.
pub(super) fn faces<const D: usize, const K: usize>(mesh: &Mesh<D>) -> Vec<[u32; K]> {
    let count = mesh.points().len();
    let parts = count.div_ceil(MOST_POINTS).next_multiple_of(rayon::current_num_threads());
    let each = count.div_ceil(parts.max(1)).max(1);
    let part = |p: usize| (p * each) as u32..((p + 1) * each).min(count) as u32;
    let found: Vec<Vec<[u32; K]>> =
        (0..count.div_ceil(each)).into_par_iter().map(|p| led_by(mesh, part(p))).collect();
    found.concat()
}

/// The distinct faces whose least corner is in `part`.
fn led_by<const D: usize, const K: usize>(mesh: &Mesh<D>, part: Range<u32>) -> Vec<[u32; K]> {
    let mut starts = vec![0; part.len() + 1];
    each_face(mesh, &part, |face: [u32; K]| starts[(face[0] - part.start) as usize + 1] += 1);
    for point in 0..part.len() {
        starts[point + 1] += starts[point];
    }
    let mut faces = vec![[0; K]; starts[part.len()]];
    let mut next = starts.clone();
    each_face(mesh, &part, |face| {
        let at = &mut next[(face[0] - part.start) as usize];
        faces[*at] = face;
        *at += 1;
    });
    let mut kept = 0;
    for of_point in starts.windows(2) {
        faces[of_point[0]..of_point[1]].sort_unstable();
        for i in of_point[0]..of_point[1] {
            if i == of_point[0] || faces[i] != faces[kept - 1] {
                faces[kept] = faces[i];
                kept += 1;
            }
        }
    }
    faces.truncate(kept);
    faces
}

/// Calls `visit` with every face of every cell whose least corner is in `part`, corners ascending.
#[inline(always)]
fn each_face<const D: usize, const K: usize>(
    mesh: &Mesh<D>,
    part: &Range<u32>,
    mut visit: impl FnMut([u32; K]),
) {
    // each face of a simplex is a choice of K of its D + 1 corners
    let choices: Vec<[usize; K]> = (0u32..1 << (D + 1))
        .filter(|set| set.count_ones() as usize == K)
        .map(|set| {
            let mut members = (0..=D).filter(|k| set >> k & 1 == 1);
            std::array::from_fn(|_| members.next().unwrap_or(0))
        })
        .collect();
    for cell in mesh.cells() {
        let (least, greatest) =
            cell.iter().fold((u32::MAX, 0), |(a, b), &corner| (a.min(corner), b.max(corner)));
        if least >= part.end || greatest < part.start {
            continue;
        }
        for choice in &choices {
            let mut face = choice.map(|k| cell[k]);
            face.sort_unstable();
            if part.contains(&face[0]) {
                visit(face);
            }
        }
    }
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

    /// The definition: all faces, sorted.
    fn listed<const D: usize, const K: usize>(mesh: &Mesh<D>) -> Vec<[u32; K]> {
        let mut all = Vec::new();
        for cell in mesh.cells() {
            for set in (0u32..1 << (D + 1)).filter(|set| set.count_ones() as usize == K) {
                let mut face: Vec<u32> =
                    (0..=D).filter(|k| set >> k & 1 == 1).map(|k| cell[k]).collect();
                face.sort_unstable();
                all.push(face.try_into().unwrap());
            }
        }
        all.sort_unstable();
        all.dedup();
        all
    }

    #[test]
    fn faces_are_those_of_the_sorted_list_at_any_thread_count() {
        // any corners will do, and some points are none
        let points = vec![[0.0; 3]; 90];
        let corner = |i: u32| (i * i % 89 + i / 7) % 90;
        let corners: Vec<u32> =
            (0..400).flat_map(|c| [0, 1, 2, 3].map(|k| corner(5 * c + 11 * k))).collect();
        let mesh = Mesh::new(points, corners).unwrap();
        for threads in [1, 3] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| {
                assert_eq!(faces::<3, 2>(&mesh), listed(&mesh));
                assert_eq!(faces::<3, 3>(&mesh), listed(&mesh));
            });
        }
        let empty = Mesh::<2>::new(Vec::new(), Vec::new()).unwrap();
        assert!(faces::<2, 2>(&empty).is_empty());
    }
}
