//! Triangles that can be swapped and moved: who is beside whom, and which guides lie in which.

use crate::geometry::{Bounds, Point};
use crate::mesh::{Mesh, MeshError};

use super::energy::doubled_area;
use super::guides::Guide;
use super::star::StarCell;

/// No cell: beyond the hull.
pub(super) const NONE: u32 = u32::MAX;

/// Triangles, counter-clockwise.
pub(super) struct Triangles {
    pub points: Vec<Point<2>>,
    corners: Vec<[u32; 3]>,
    /// The cell across from each corner.
    neighbours: Vec<[u32; 3]>,
    /// A cell of each point.
    cell_of: Vec<u32>,
    /// The guides in each cell.
    guides: Vec<Vec<u32>>,
}

impl Triangles {
    /// The cells of a mesh without fault, and the guides in them. The edges of `held`, ascending, stay.
    pub fn new(mesh: Mesh<2>, guides: &[Guide], held: &[[u32; 2]]) -> Self {
        let mut neighbours = vec![[NONE; 3]; mesh.cell_count()];
        for facet in mesh.facets() {
            let Some(neighbour) = facet.neighbour else { continue };
            for (cell, other) in [(facet.cell, neighbour), (neighbour, facet.cell)] {
                let corners = &mesh.corners()[3 * cell as usize..][..3];
                let off = corners.iter().position(|c| !facet.corners.contains(c));
                neighbours[cell as usize][off.expect("a facet leaves out one corner")] = other;
            }
        }
        let (points, corners) = mesh.into_parts();
        let corners = corners.as_chunks::<3>().0.to_vec();
        let mut cell_of = vec![NONE; points.len()];
        for (cell, corners) in corners.iter().enumerate() {
            corners.iter().for_each(|&c| cell_of[c as usize] = cell as u32);
        }
        let empty = vec![Vec::new(); corners.len()];
        let mut triangles = Self { points, corners, neighbours, cell_of, guides: empty };
        let starts = WalkStarts::new(&triangles);
        for (i, guide) in guides.iter().enumerate() {
            // beyond the outline of a mesh that is not convex there is nothing to guide
            if let Some(cell) = triangles.locate(guide.at.position, starts.near(guide.at.position))
            {
                triangles.guides[cell as usize].push(i as u32);
            }
        }
        triangles.hold(held);
        triangles
    }

    /// Parts the cells at these edges, ascending, as if they were on the hull.
    fn hold(&mut self, held: &[[u32; 2]]) {
        if held.is_empty() {
            return;
        }
        for (corners, neighbours) in self.corners.iter().zip(&mut self.neighbours) {
            for k in 0..3 {
                let mut edge = [corners[(k + 1) % 3], corners[(k + 2) % 3]];
                edge.sort_unstable();
                if held.binary_search(&edge).is_ok() {
                    neighbours[k] = NONE;
                }
            }
        }
    }

    /// The cell that holds a point, if a walk from `start` reaches one: each time across the side that the point
    /// is farthest beyond. Among Delaunay's cells of a convex box it does.
    fn locate(&self, p: Point<2>, start: u32) -> Option<u32> {
        let mut cell = start;
        for _ in 0..self.corners.len() {
            let [a, b, c] = self.corners_at(cell);
            let sides = [doubled_area(b, c, p), doubled_area(c, a, p), doubled_area(a, b, p)];
            let beyond = (0..3).min_by(|&i, &j| sides[i].total_cmp(&sides[j]))?;
            let next = self.neighbours[cell as usize][beyond];
            if sides[beyond] >= 0.0 {
                return Some(cell);
            }
            if next == NONE {
                // a rounding beyond the hull is still within
                return (sides[beyond] >= -1e-9 * doubled_area(a, b, c)).then_some(cell);
            }
            cell = next;
        }
        None
    }

    /// The number of cells, those that have gone too.
    pub fn len(&self) -> usize {
        self.corners.len()
    }

    /// The corners of a cell.
    #[inline]
    pub fn corners(&self, cell: u32) -> [u32; 3] {
        self.corners[cell as usize]
    }

    /// The coordinates of a cell's corners.
    #[inline]
    pub fn corners_at(&self, cell: u32) -> [Point<2>; 3] {
        self.corners[cell as usize].map(|c| self.points[c as usize])
    }

    /// The guides in a cell.
    #[inline]
    pub fn guides_in(&self, cell: u32) -> &[u32] {
        &self.guides[cell as usize]
    }

    /// The guides in a cell, to be changed.
    #[inline]
    pub fn guides_in_mut(&mut self, cell: u32) -> &mut Vec<u32> {
        &mut self.guides[cell as usize]
    }

    /// The place of a point among a cell's corners.
    #[inline]
    fn place(&self, cell: u32, point: u32) -> usize {
        let corners = &self.corners[cell as usize];
        usize::from(corners[1] == point) + 2 * usize::from(corners[2] == point)
    }

    /// Puts the cells around a point into `star`, counter-clockwise; whether they close. Those of a point of the hull
    /// begin and end at the hull.
    pub fn star(&self, point: u32, star: &mut Vec<StarCell>) -> bool {
        star.clear();
        let first = self.cell_of[point as usize];
        let mut start = first;
        loop {
            let next = self.neighbours[start as usize][(self.place(start, point) + 2) % 3];
            if next == NONE || next == first {
                break;
            }
            start = next;
        }
        let mut cell = start;
        loop {
            let place = self.place(cell, point);
            let corners = &self.corners[cell as usize];
            let [first, second] = [1, 2].map(|k| corners[(place + k) % 3]);
            star.push(StarCell { cell, first, second });
            cell = self.neighbours[cell as usize][(place + 1) % 3];
            if cell == NONE || cell == start {
                return cell == start;
            }
        }
    }

    /// The pair of cells beside the edge across from a corner; `None` on the hull.
    pub fn pair(&self, cell: u32, place: usize) -> Option<CellPair> {
        let other = self.neighbours[cell as usize][place];
        if other == NONE {
            return None;
        }
        let corners = self.corners[cell as usize];
        let [apex, a, b] = [0, 1, 2].map(|k| corners[(place + k) % 3]);
        let beyond = self.corners[other as usize].into_iter().find(|&c| c != a && c != b);
        let beyond = beyond.expect("a cell has a corner off an edge");
        Some(CellPair { cells: [cell, other], edge: [a, b], apices: [apex, beyond] })
    }

    /// Gives a pair of cells the other diagonal, with these guides in the new cells.
    pub fn swap(&mut self, pair: &CellPair, guides: [&mut Vec<u32>; 2]) {
        let CellPair { cells: [cell, other], edge: [a, b], apices: [v, u] } = *pair;
        let (at, over) = (self.place(cell, v), self.place(other, u));
        // across from a, b in the one cell and from b, a in the other
        let across = |cell: u32, place: usize| self.neighbours[cell as usize][place % 3];
        let (beside_bv, beside_va) = (across(cell, at + 1), across(cell, at + 2));
        let (beside_au, beside_ub) = (across(other, over + 1), across(other, over + 2));
        self.corners[cell as usize] = [v, a, u];
        self.corners[other as usize] = [u, b, v];
        self.neighbours[cell as usize] = [beside_au, other, beside_va];
        self.neighbours[other as usize] = [beside_bv, cell, beside_ub];
        self.replace(beside_au, other, cell);
        self.replace(beside_bv, cell, other);
        for (point, cell) in [(v, cell), (a, cell), (u, other), (b, other)] {
            self.cell_of[point as usize] = cell;
        }
        for (cell, new) in [cell, other].into_iter().zip(guides) {
            std::mem::swap(&mut self.guides[cell as usize], new);
        }
    }

    /// Takes a point away whose star closes: the `to`-th corner around takes its place in all cells of the star but
    /// the two that have both, which go.
    pub fn collapse(&mut self, point: u32, star: &[StarCell], to: usize) {
        let at = |place: usize| star[place % star.len()];
        let count = star.len();
        let StarCell { cell: gone, first: corner, second: next } = at(to);
        let StarCell { cell: also_gone, first: previous, .. } = at(to + count - 1);
        let (after, before) = (at(to + 1).cell, at(to + count - 2).cell);
        for (gone, beside) in [(gone, after), (also_gone, before)] {
            let beyond = self.neighbours[gone as usize][self.place(gone, point)];
            self.replace(beside, gone, beyond);
            self.replace(beyond, gone, beside);
        }
        for &StarCell { cell, .. } in star {
            let place = self.place(cell, point);
            self.corners[cell as usize][place] = corner;
        }
        for gone in [gone, also_gone] {
            self.corners[gone as usize] = [NONE; 3];
            self.neighbours[gone as usize] = [NONE; 3];
            self.guides[gone as usize].clear();
        }
        self.cell_of[point as usize] = NONE;
        for (corner, cell) in [(corner, after), (next, after), (previous, before)] {
            self.cell_of[corner as usize] = cell;
        }
    }

    /// Puts a new point into a pair of cells, which become four: those along the sides from the pair's first
    /// corner of the edge to the far apex, and so on around. Returns them.
    pub fn split(&mut self, pair: &CellPair, x: Point<2>) -> [u32; 4] {
        let CellPair { cells: [cell, other], edge: [a, b], apices: [v, u] } = *pair;
        let (at, over) = (self.place(cell, v), self.place(other, u));
        let across = |cell: u32, place: usize| self.neighbours[cell as usize][place % 3];
        let (beside_bv, beside_va) = (across(cell, at + 1), across(cell, at + 2));
        let (beside_au, beside_ub) = (across(other, over + 1), across(other, over + 2));
        let point = self.points.len() as u32;
        let (third, fourth) = (self.corners.len() as u32, self.corners.len() as u32 + 1);
        self.points.push(x);
        self.corners[other as usize] = [a, u, point];
        self.corners[cell as usize] = [v, a, point];
        self.corners.extend([[u, b, point], [b, v, point]]);
        self.neighbours[other as usize] = [third, cell, beside_au];
        self.neighbours[cell as usize] = [other, fourth, beside_va];
        self.neighbours.extend([[fourth, other, beside_ub], [cell, third, beside_bv]]);
        self.replace(beside_ub, other, third);
        self.replace(beside_bv, cell, fourth);
        self.guides.extend([Vec::new(), Vec::new()]);
        self.cell_of.push(cell);
        for (point, cell) in [(v, cell), (a, other), (u, third), (b, fourth)] {
            self.cell_of[point as usize] = cell;
        }
        [other, third, fourth, cell]
    }

    /// Makes `cell` the neighbour of `new` where it had been that of `old`.
    fn replace(&mut self, cell: u32, old: u32, new: u32) {
        if cell != NONE {
            for neighbour in &mut self.neighbours[cell as usize] {
                if *neighbour == old {
                    *neighbour = new;
                }
            }
        }
    }

    /// The mesh of what is left, each cell with its lowest corner first, in lexicographic order: as Delaunay's
    /// are. Points keep their order.
    pub fn into_mesh(self) -> Result<Mesh<2>, MeshError> {
        let mut numbers = vec![NONE; self.points.len()];
        let mut points = Vec::with_capacity(self.points.len());
        for (i, &p) in self.points.iter().enumerate().filter(|(i, _)| self.cell_of[*i] != NONE) {
            numbers[i] = points.len() as u32;
            points.push(p);
        }
        let live = self.corners.iter().filter(|corners| corners[0] != NONE);
        let mut cells: Vec<[u32; 3]> =
            live.map(|corners| corners.map(|c| numbers[c as usize])).collect();
        for corners in &mut cells {
            let lowest = (0..3).min_by_key(|&k| corners[k]).expect("three corners");
            corners.rotate_left(lowest);
        }
        cells.sort_unstable();
        Mesh::new(points, cells.into_flattened())
    }
}

/// Two cells that share an edge: v a b and u b a, for the edge a b and the apices v u.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct CellPair {
    pub cells: [u32; 2],
    pub edge: [u32; 2],
    pub apices: [u32; 2],
}

impl CellPair {
    /// All corners, counter-clockwise.
    pub fn corners(&self) -> [u32; 4] {
        let ([a, b], [v, u]) = (self.edge, self.apices);
        [a, u, b, v]
    }
}

/// A cell near any place, from which to walk: of squares about as large as two cells, one cell each.
struct WalkStarts {
    low: Point<2>,
    side: f64,
    columns: usize,
    cells: Vec<u32>,
}

impl WalkStarts {
    fn new(triangles: &Triangles) -> Self {
        let bounds = Bounds::of(&triangles.points);
        let (low, extent) = bounds.map_or(([0.0; 2], [0.0; 2]), |b| (b.min, b.extent()));
        let cell_count = triangles.corners.len().max(1);
        let side = (2.0 * extent[0] * extent[1] / cell_count as f64).sqrt();
        let [columns, rows] = extent.map(|x| (x / side) as usize + 1);
        let mut starts = Self { low, side, columns, cells: vec![0; columns * rows] };
        for cell in 0..triangles.corners.len() as u32 {
            let [a, b, c] = triangles.corners_at(cell);
            let middle = std::array::from_fn(|k| (a[k] + b[k] + c[k]) / 3.0);
            let place = starts.place(middle);
            starts.cells[place] = cell;
        }
        starts
    }

    fn place(&self, p: Point<2>) -> usize {
        let [column, row] = [0, 1].map(|k| ((p[k] - self.low[k]) / self.side) as usize);
        (column.min(self.columns - 1) + row * self.columns).min(self.cells.len() - 1)
    }

    fn near(&self, p: Point<2>) -> u32 {
        self.cells[self.place(p)]
    }
}
