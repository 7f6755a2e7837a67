//! New cells in place of the cavity: each joins the new vertex to a facet of the boundary.

use super::Triangulation;
use super::storage::{FACETS, INFINITE, Mark, Tetrahedron, Vertex};

/// Rims up to this size are matched by a square table, larger ones by sorting.
const TABLE_SIDE: usize = 256;

/// The surface of a cavity: its vertices, and its new cells around their edges.
#[derive(Debug, Default)]
pub(super) struct Rim {
    /// The vertices met; the label of each is its place here.
    vertices: Vec<u32>,
    new_cells: Vec<NewCell>,
    /// For each edge from one vertex to another, the facet of the new cell left of it.
    table: Vec<u32>,
    /// The same as a list, for large rims: the edge's two places, low and high, and the facet.
    edges: Vec<(u64, u32)>,
}

/// A new cell, joining the new vertex to the facet a, b, c.
#[derive(Debug)]
struct NewCell {
    place: u32,
    /// The places of a, b, c in the rim.
    rim: [u32; 3],
    /// Which corners of the cell a, b, c are.
    corners: [u8; 3],
}

impl NewCell {
    /// For each side facet: the rim's edge, as seen from this cell, and the facet's number.
    #[inline]
    fn sides(&self) -> [(u32, u32, u32); 3] {
        let [a, b, c] = self.rim;
        let facet = |k: usize| self.place * 4 + u32::from(self.corners[k]);
        [(b, c, facet(0)), (c, a, facet(1)), (a, b, facet(2))]
    }
}

impl Rim {
    /// The place of a vertex in the rim; a vertex not met before gets the next.
    #[inline]
    fn place(&mut self, vertices: &mut [Vertex], vertex: u32) -> u32 {
        let label = &mut vertices[vertex as usize].label;
        // A label may be stale: the list decides.
        if self.vertices.get(*label as usize) != Some(&vertex) {
            *label = self.vertices.len() as u32;
            self.vertices.push(vertex);
        }
        *label
    }
}

impl Triangulation {
    /// Replaces the cells in the cavity by cells that join the vertex to the boundary.
    pub(super) fn fill(&mut self, vertex: u32) {
        self.rim.vertices.clear();
        self.rim.new_cells.clear();
        for at in 0..self.boundary.len() {
            let place = match self.cavity.get(at) {
                Some(&place) => place,
                None => self.tetrahedra.allocate(),
            };
            self.join(vertex, self.boundary[at], place);
        }
        for at in self.boundary.len()..self.cavity.len() {
            self.tetrahedra.release(self.cavity[at]);
        }
        if self.rim.vertices.len() <= TABLE_SIDE {
            self.link_by_table();
        } else {
            self.link_by_sorting();
        }
        self.hint = self.rim.new_cells[0].place;
    }

    /// Makes the cell of the vertex and a facet, given as seen from the cell that stays.
    #[inline]
    fn join(&mut self, vertex: u32, facet: u32, place: u32) {
        let (kept, side) = ((facet >> 2) as usize, (facet & 3) as usize);
        let outside = &mut self.tetrahedra.cells[kept];
        // Seen from the other side, the facet turns the other way.
        let [a, c, b] = FACETS[side].map(|k| outside.corners[k]);
        let [a, b, c] = if a == INFINITE {
            [b, c, a]
        } else if b == INFINITE {
            [c, a, b]
        } else {
            [a, b, c]
        };
        // Written as a whole: a list changed at one place could not be read at once.
        let (cell, at, apex) = if c == INFINITE {
            (Tetrahedron { corners: [b, a, vertex, c], neighbours: [0, 0, facet, 0] }, [1, 0, 3], 2)
        } else {
            (Tetrahedron { corners: [a, b, c, vertex], neighbours: [0, 0, 0, facet] }, [0, 1, 2], 3)
        };
        outside.neighbours[side] = place * 4 + apex;
        self.tetrahedra.marks[kept] = Mark::Unseen;
        self.tetrahedra.cells[place as usize] = cell;
        self.tetrahedra.marks[place as usize] = Mark::Unseen;
        let rim = [a, b, c].map(|corner| self.rim.place(&mut self.vertices, corner));
        self.rim.new_cells.push(NewCell { place, rim, corners: at });
    }

    /// Links the new cells: each edge of the rim is met once in each direction.
    fn link_by_table(&mut self) {
        let Rim { vertices, new_cells, table, .. } = &mut self.rim;
        let shift = vertices.len().next_power_of_two().trailing_zeros();
        if table.len() < 1 << (2 * shift) {
            table.resize(1 << (2 * shift), 0);
        }
        for cell in new_cells.iter() {
            for (from, to, facet) in cell.sides() {
                table[(from << shift | to) as usize] = facet;
            }
        }
        for cell in new_cells.iter() {
            for (from, to, facet) in cell.sides() {
                let other = table[(to << shift | from) as usize];
                self.tetrahedra.cells[cell.place as usize].neighbours[facet as usize & 3] = other;
            }
        }
    }

    /// Links the new cells of a rim too large for a square table.
    fn link_by_sorting(&mut self) {
        let Rim { new_cells, edges, .. } = &mut self.rim;
        edges.clear();
        for (from, to, facet) in new_cells.iter().flat_map(NewCell::sides) {
            edges.push((u64::from(from.min(to)) << 32 | u64::from(from.max(to)), facet));
        }
        edges.sort_unstable();
        for pair in edges.chunks_exact(2) {
            let (one, other) = (pair[0].1, pair[1].1);
            self.tetrahedra.cells[(one >> 2) as usize].neighbours[one as usize & 3] = other;
            self.tetrahedra.cells[(other >> 2) as usize].neighbours[other as usize & 3] = one;
        }
    }
}
