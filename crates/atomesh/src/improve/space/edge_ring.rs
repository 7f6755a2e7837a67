//! The cells around an edge, and how to fill their space without the edge.

use super::tetrahedra::{NONE, Tetrahedra};

/// The most points around an edge that may be swapped. In Delaunay meshes of lattices, most edges have four to six;
/// swaps of more than seven seldom gain anything (Freitag & Ollivier-Gooch 1997) and have many triangulations.
pub(super) const MOST: usize = 8;

/// For corners i and j of a cell, the other two in the order that makes all four positive.
const OTHERS: [[[u8; 2]; 4]; 4] = [
    [[0, 0], [2, 3], [3, 1], [1, 2]],
    [[3, 2], [0, 0], [0, 3], [2, 0]],
    [[1, 3], [3, 0], [0, 0], [0, 1]],
    [[2, 1], [0, 2], [1, 0], [0, 0]],
];

/// The cells around an edge and the points between them, counter-clockwise seen from the edge's end.
#[derive(Clone, Copy, Debug)]
pub(super) struct EdgeRing {
    /// The edge.
    pub ends: [u32; 2],
    pub points: [u32; MOST],
    pub cells: [u32; MOST],
    /// How many points there are.
    pub count: usize,
    /// How many cells: as many as points, or one less at the hull.
    pub cell_count: usize,
}

impl EdgeRing {
    /// The cells.
    pub fn cells(&self) -> &[u32] {
        &self.cells[..self.cell_count]
    }

    /// The ring around the edge of corners `i` and `j` of a cell; `None` if it has more than [`MOST`] points, or
    /// ends at facets that must stay.
    pub fn around(tetrahedra: &Tetrahedra, cell: u32, i: usize, j: usize) -> Option<Self> {
        let (a, b) = (tetrahedra.corners[cell as usize][i], tetrahedra.corners[cell as usize][j]);
        let others = |cell: u32| {
            let [x, y] = OTHERS[tetrahedra.place(cell, a)][tetrahedra.place(cell, b)];
            (usize::from(x), usize::from(y))
        };
        // back to where the ring begins at the hull, or once around
        let (mut start, mut closed, mut length) = (cell, false, 1);
        loop {
            let back = tetrahedra.neighbours[start as usize][others(start).1];
            if back == NONE {
                break;
            }
            if back == cell {
                closed = true;
                break;
            }
            start = back;
            length += 1;
            if length > MOST {
                return None;
            }
        }
        let (points, cells) = ([0; MOST], [0; MOST]);
        let mut ring = Self { ends: [a, b], points, cells, count: 0, cell_count: length };
        let mut at = start;
        for n in 0..length {
            let (x, y) = others(at);
            ring.cells[n] = at;
            ring.points[n] = tetrahedra.corners[at as usize][x];
            if n + 1 == length && !closed {
                if length == MOST {
                    return None;
                }
                ring.points[length] = tetrahedra.corners[at as usize][y];
            }
            at = tetrahedra.neighbours[at as usize][x];
        }
        ring.count = length + usize::from(!closed);
        let last = ring.points[ring.count - 1];
        let side = [a, b, ring.points[0], last].map(|p| tetrahedra.sides[p as usize]);
        let is_free = closed || side.iter().fold(63, |all, s| all & s) != 0;
        (is_free && ring.count >= 3).then_some(ring)
    }

    /// The two cells over the triangle of three of the points.
    #[inline(always)]
    pub fn pair(&self, i: usize, k: usize, j: usize) -> [[u32; 4]; 2] {
        let [x, y, z] = [i, k, j].map(|n| self.points[n]);
        let [a, b] = self.ends;
        [[x, y, z, b], [x, z, y, a]]
    }

    /// The way to fill the ring with triangles that is worth most. `worth(ring, i, k, j)` is that of triangle i k j
    /// with its chord i j; `join`, a sum or the lesser with its `neutral` number, makes one worth of several. The
    /// answer, and every part of it, is worth more than `least`. By dynamic programming over the polygon (Klincsek
    /// 1980; for this use Shewchuk 2002). Cost: O(n³).
    pub fn fill(
        &self,
        least: f64,
        mut worth: impl FnMut(&Self, usize, usize, usize) -> f64,
        join: impl Fn(f64, f64) -> f64,
        neutral: f64,
    ) -> Option<Filling> {
        let n = self.count;
        let mut best = [[f64::NEG_INFINITY; MOST]; MOST];
        let mut choice = [[0_u8; MOST]; MOST];
        for i in 0..n - 1 {
            best[i][i + 1] = neutral;
        }
        for width in 2..n {
            for i in 0..n - width {
                let j = i + width;
                for k in i + 1..j {
                    let sides = join(best[i][k], best[k][j]);
                    if sides <= least || sides <= best[i][j] {
                        continue;
                    }
                    let total = join(sides, worth(self, i, k, j));
                    if total > best[i][j] {
                        (best[i][j], choice[i][j]) = (total, k as u8);
                    }
                }
            }
        }
        let worth = best[0][n - 1];
        (worth > least).then_some(Filling { worth, choice })
    }

    /// The cells of a filling.
    pub fn filled(&self, filling: &Filling, cells: &mut Vec<[u32; 4]>) {
        let mut open = vec![(0, self.count - 1)];
        while let Some((i, j)) = open.pop() {
            if j < i + 2 {
                continue;
            }
            let k = usize::from(filling.choice[i][j]);
            cells.extend(self.pair(i, k, j));
            open.extend([(i, k), (k, j)]);
        }
    }
}

/// A way to fill a ring with triangles.
#[derive(Clone, Copy, Debug)]
pub(super) struct Filling {
    /// What it is worth.
    pub worth: f64,
    /// For each chord the third corner of the triangle below it.
    choice: [[u8; MOST]; MOST],
}
