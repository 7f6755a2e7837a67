//! The edges in which a plane cuts tetrahedra.

use std::collections::HashMap;

use atomesh::geometry::Point;
use atomesh::mesh::Mesh;

/// Where the plane at a level of an axis cuts the edges of the cells, and the segments between these places, two numbers
/// each. A corner on the plane counts as above it, so that each cell has none, three or four cut edges. Cost: O(cells).
pub fn slice_cells<const D: usize>(
    mesh: &Mesh<D>,
    axis: usize,
    level: f64,
) -> (Vec<Point<D>>, Vec<u32>) {
    let points = mesh.points();
    let mut places = Vec::new();
    let mut numbers: HashMap<[u32; 2], u32> = HashMap::new();
    let mut edges = std::collections::BTreeSet::new();
    let mut cut = |below: u32, above: u32| {
        *numbers.entry([below, above]).or_insert_with(|| {
            let (a, b) = (&points[below as usize], &points[above as usize]);
            let t = (level - a[axis]) / (b[axis] - a[axis]);
            places.push(std::array::from_fn(|k| a[k] + t * (b[k] - a[k])));
            places.len() as u32 - 1
        })
    };
    for cell in mesh.cells() {
        let (below, above): (Vec<u32>, Vec<u32>) =
            cell.iter().partition(|&&corner| points[corner as usize][axis] < level);
        if below.is_empty() || above.is_empty() {
            continue;
        }
        // two cut edges bound a side of the cell's section where they have a corner in common
        let cuts: Vec<[u32; 2]> =
            below.iter().flat_map(|&a| above.iter().map(move |&b| [a, b])).collect();
        for (i, first) in cuts.iter().enumerate() {
            for second in &cuts[..i] {
                if first[0] == second[0] || first[1] == second[1] {
                    let (p, q) = (cut(first[0], first[1]), cut(second[0], second[1]));
                    edges.insert([p.min(q), p.max(q)]);
                }
            }
        }
    }
    (places, edges.into_iter().flatten().collect())
}
