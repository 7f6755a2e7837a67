//! Cells of second order: a mesh with a node in the middle of every edge.
//!
//! Nodes are the mesh's points, in their order, then the middles of its edges, in lexicographic order of their ends.
//! Cells are straight until [`Quadratic::curve`] moves middles. A cell is valid as long as the determinant of its map is
//! positive: a polynomial of degree D, tested on a lattice of points fine enough to determine it.

use super::Mesh;
use crate::geometry::{Point, Simplex};

/// The edges of a cell in the order of their nodes, which is VTK's: of a triangle the first three.
const EDGES: [[usize; 2]; 6] = [[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]];

/// Least determinant of a curved cell's map, over that of the straight cell.
const LEAST_SHARE: f64 = 0.2;

/// A mesh of 6-node triangles or 10-node tetrahedra.
#[derive(Clone, Debug, PartialEq)]
pub struct Quadratic<const D: usize> {
    nodes: Vec<Point<D>>,
    /// The ends of the edges, ascending; edge i has the node `points + i`.
    edges: Vec<[u32; 2]>,
    point_count: usize,
    /// The nodes of all cells.
    cells: Vec<u32>,
}

impl<const D: usize> Quadratic<D> {
    /// The nodes of one cell: 6 in 2-D, 10 in 3-D. Corners first, then the middles of the edges 01, 12, 20,
    /// and in 3-D 03, 13, 23: VTK's order. (Gmsh has the last two the other way round.)
    pub const NODES: usize = (D + 1) * (D + 2) / 2;

    /// The mesh with a node in the middle of each edge. Cost: O(cells).
    pub fn new(mesh: &Mesh<D>) -> Self {
        let of_cell = |cell: &[u32]| -> Vec<[u32; 2]> {
            let edge = |&[i, j]: &[usize; 2]| [cell[i].min(cell[j]), cell[i].max(cell[j])];
            EDGES[..Self::NODES - D - 1].iter().map(edge).collect()
        };
        let mut edges: Vec<[u32; 2]> = mesh.cells().flat_map(of_cell).collect();
        edges.sort_unstable();
        edges.dedup();
        let mut nodes = mesh.points().to_vec();
        let point_count = nodes.len();
        nodes.extend(edges.iter().map(|&[a, b]| {
            let (a, b) = (&mesh.points()[a as usize], &mesh.points()[b as usize]);
            std::array::from_fn(|k| 0.5 * (a[k] + b[k]))
        }));
        let mut this = Self { nodes, edges, point_count, cells: Vec::new() };
        let mut cells = Vec::with_capacity(mesh.cell_count() * Self::NODES);
        for cell in mesh.cells() {
            cells.extend_from_slice(cell);
            cells.extend(of_cell(cell).into_iter().filter_map(|[a, b]| this.middle(a, b)));
        }
        this.cells = cells;
        this
    }

    /// The nodes' coordinates.
    pub fn nodes(&self) -> &[Point<D>] {
        &self.nodes
    }

    /// The nodes of all cells, [`Self::NODES`] a cell.
    pub fn cells(&self) -> &[u32] {
        &self.cells
    }

    /// The node in the middle of the edge between two points, if there is such an edge.
    pub fn middle(&self, a: u32, b: u32) -> Option<u32> {
        let at = self.edges.binary_search(&[a.min(b), a.max(b)]).ok()?;
        Some((self.point_count + at) as u32)
    }

    /// The values at the points, followed by those at the middles of edges, the mean of the values at their ends.
    ///
    /// # Panics
    /// If there is not one value for each point.
    pub fn extend(&self, values: &[f32]) -> Vec<f32> {
        assert_eq!(values.len(), self.point_count, "one value a point");
        let mean = |&[a, b]: &[u32; 2]| 0.5 * (values[a as usize] + values[b as usize]);
        values.iter().copied().chain(self.edges.iter().map(mean)).collect()
    }

    /// The nodes of a facet of the mesh: its corners, then the middles of its edges 01 (2-D), or 01, 12, 20
    /// (3-D), the order of VTK and Gmsh.
    pub fn facet(&self, corners: &[u32; D]) -> Vec<u32> {
        let edges = &EDGES[..if D == 2 { 1 } else { 3 }];
        let middle = |&[i, j]: &[usize; 2]| self.middle(corners[i], corners[j]);
        corners.iter().copied().chain(edges.iter().filter_map(middle)).collect()
    }

    /// Moves the middles of the edges of `facets` to where `place` says, if anywhere, and puts back those of cells whose
    /// map would not stay invertible (see the module). Returns the number of middles that stay moved.
    pub fn curve(
        &mut self,
        facets: &[[u32; D]],
        place: impl Fn(&Point<D>) -> Option<Point<D>>,
    ) -> usize {
        let mut moved: Vec<(u32, Point<D>)> = Vec::new();
        let mut middles: Vec<u32> =
            facets.iter().flat_map(|facet| self.facet(facet)[D..].to_vec()).collect();
        middles.sort_unstable();
        middles.dedup();
        for node in middles {
            let straight = self.nodes[node as usize];
            if let Some(p) = place(&straight) {
                self.nodes[node as usize] = p;
                moved.push((node, straight));
            }
        }
        // a cell that fails is made straight, and its neighbours, which lose a bend, are tested again
        loop {
            let bad: Vec<u32> = self
                .cells
                .chunks_exact(Self::NODES)
                .filter(|cell| !self.is_sound(cell))
                .flat_map(|cell| cell[D + 1..].to_vec())
                .collect();
            let before = moved.len();
            moved.retain(|(node, straight)| {
                let keep = !bad.contains(node);
                if !keep {
                    self.nodes[*node as usize] = *straight;
                }
                keep
            });
            if moved.len() == before {
                return before;
            }
        }
    }

    /// The same cells with their nodes elsewhere, turned over if the move mirrors, as a mesh's cells are whose
    /// last two corners change places.
    pub fn moved(mut self, mirrored: bool, to: impl Fn(&Point<D>) -> Point<D>) -> Self {
        self.nodes.iter_mut().for_each(|p| *p = to(p));
        if mirrored {
            for cell in self.cells.chunks_exact_mut(Self::NODES) {
                cell.swap(D - 1, D);
                // the middles of 01 and 20; of 12 and 13, 20 and 03
                let swaps: &[[usize; 2]] = if D == 2 { &[[3, 5]] } else { &[[5, 8], [6, 7]] };
                swaps.iter().for_each(|&[a, b]| cell.swap(a, b));
            }
        }
        self
    }

    /// Whether the map of a cell keeps a share of the straight cell's determinant wherever it is tested.
    fn is_sound(&self, cell: &[u32]) -> bool {
        let node = |i: usize| &self.nodes[cell[i] as usize];
        let simplex = Simplex { first: *node(0), others: std::array::from_fn(|k| *node(k + 1)) };
        let is_straight = EDGES[..Self::NODES - D - 1].iter().enumerate().all(|(e, &[i, j])| {
            (0..D).all(|k| node(D + 1 + e)[k] == 0.5 * (node(i)[k] + node(j)[k]))
        });
        is_straight || {
            let limit = LEAST_SHARE * simplex.measure();
            places::<D>().all(|weights| self.determinant(cell, &weights) > limit)
        }
    }

    /// The determinant of a cell's map at barycentric weights, over D!: the measure of a straight cell.
    fn determinant(&self, cell: &[u32], weights: &[f64; 4]) -> f64 {
        // dx/dλ_i of the quadratic map: (4 λ_i − 1) x_i + 4 Σ_j λ_j m_ij
        let slope = |i: usize| -> Point<D> {
            let mut v = self.nodes[cell[i] as usize].map(|x| (4.0 * weights[i] - 1.0) * x);
            for (e, edge) in EDGES[..Self::NODES - D - 1].iter().enumerate() {
                if let Some(at) = edge.iter().position(|&c| c == i) {
                    let m = &self.nodes[cell[D + 1 + e] as usize];
                    let w = 4.0 * weights[edge[1 - at]];
                    v = std::array::from_fn(|k| v[k] + w * m[k]);
                }
            }
            v
        };
        let first = slope(0);
        let others = std::array::from_fn(|k| slope(k + 1));
        Simplex { first, others }.measure()
    }
}

/// Barycentric weights of the points of a lattice that divides each edge in four.
fn places<const D: usize>() -> impl Iterator<Item = [f64; 4]> {
    (0..5_usize.pow(D as u32)).filter_map(|code| {
        let (mut rest, mut left, mut weights) = (code, 4, [0.0; 4]);
        for w in weights.iter_mut().take(D) {
            let share = rest % 5;
            rest /= 5;
            if share > left {
                return None;
            }
            left -= share;
            *w = share as f64 / 4.0;
        }
        weights[D] = left as f64 / 4.0;
        Some(weights)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tetrahedron() -> Mesh<3> {
        let points = vec![[0.0; 3], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 2.0]];
        Mesh::new(points, vec![0, 1, 2, 3]).unwrap()
    }

    #[test]
    fn middles_are_in_the_order_of_vtk() {
        let quadratic = Quadratic::new(&tetrahedron());
        let nodes: Vec<[f64; 3]> =
            quadratic.cells()[4..].iter().map(|&n| quadratic.nodes()[n as usize]).collect();
        let expected = [
            [1.0, 0.0, 0.0],
            [1.0, 1.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.0, 0.0, 1.0],
            [1.0, 0.0, 1.0],
            [0.0, 1.0, 1.0],
        ];
        assert_eq!(nodes, expected);
        assert_eq!(quadratic.extend(&[0.0, 2.0, 4.0, 6.0])[4..], [1.0, 2.0, 3.0, 3.0, 4.0, 5.0]);
    }

    #[test]
    fn neighbours_share_their_middles() {
        let square = vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        let quadratic = Quadratic::new(&Mesh::new(square, vec![0, 1, 2, 0, 2, 3]).unwrap());
        assert_eq!((quadratic.nodes().len(), quadratic.cells().len()), (9, 12));
        let middle = quadratic.middle(2, 0).unwrap();
        assert_eq!(quadratic.cells().iter().filter(|&&n| n == middle).count(), 2);
        assert_eq!(quadratic.middle(1, 3), None);
        assert_eq!(quadratic.facet(&[2, 0]), [2, 0, middle]);
    }

    #[test]
    fn the_map_of_a_straight_cell_has_its_measure_everywhere() {
        let quadratic = Quadratic::new(&tetrahedron());
        let mut count = 0;
        for weights in places::<3>() {
            let determinant = quadratic.determinant(quadratic.cells(), &weights);
            assert!((determinant - 8.0 / 6.0).abs() < 1e-14, "{weights:?}: {determinant}");
            count += 1;
        }
        assert_eq!(count, 35); // 7 choose 3
    }

    #[test]
    fn a_bend_that_would_fold_a_cell_is_taken_back() {
        let triangle = vec![[0.0, 0.0], [2.0, 0.0], [1.0, 1.5]];
        let mesh = Mesh::new(triangle, vec![0, 1, 2]).unwrap();
        let bent = |depth: f64| {
            let mut quadratic = Quadratic::new(&mesh);
            let count = quadratic.curve(&[[0, 1]], |p| Some([p[0], p[1] + depth]));
            (count, quadratic.nodes()[quadratic.middle(0, 1).unwrap() as usize][1])
        };
        assert_eq!(bent(-0.2), (1, -0.2));
        assert_eq!(bent(0.2), (1, 0.2));
        assert_eq!(bent(1.0), (0, 0.0));
    }
}
