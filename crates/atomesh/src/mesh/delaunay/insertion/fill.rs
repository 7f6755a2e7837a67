//! New cells in place of the cavity: each joins the new vertex to a facet of the boundary.

use super::Triangulation;
use super::dimension::{Dimension, Simplices};
use super::storage::{Cell, INFINITE, Mark, Vertex};

/// Rims up to this size are matched by a square table, larger ones by sorting.
const TABLE_SIDE: usize = 256;

/// The surface of a cavity: its vertices, and its new cells around their ridges. A ridge is what two facets of the
/// surface share: an edge in space, a vertex in the plane.
#[derive(Debug)]
pub(super) struct Rim<const N: usize> {
    /// The vertices met; the label of each is its place here.
    vertices: Vec<u32>,
    new_cells: Vec<NewCell<N>>,
    /// For each ridge, as seen from one side, the facet of the new cell there.
    table: Vec<u32>,
    /// The same as a list, for large rims: the ridge's number, the lower of both, and the facet.
    ridges: Vec<(u64, u32)>,
}

/// A new cell, joining a facet to the new vertex.
#[derive(Debug)]
struct NewCell<const N: usize> {
    place: u32,
    /// The places of the facet's corners in the rim; the last means nothing.
    rim: [u32; N],
    /// Which corners of the cell they are.
    corners: [u8; N],
}

impl<const N: usize> NewCell<N> {
    /// The side facets, and the ridge of each as seen from this cell and from the next; see [`Dimension::ridges`].
    #[inline(always)]
    fn sides<const D: usize>(&self, shift: u32) -> impl Iterator<Item = ([u64; 2], u32)>
    where
        Simplices: Dimension<D, N>,
    {
        let ridges = Simplices::ridges(&self.rim, shift);
        (0..D).map(move |k| (ridges[k], self.place * 4 + u32::from(self.corners[k])))
    }
}

impl<const N: usize> Default for Rim<N> {
    fn default() -> Self {
        Self { vertices: Vec::new(), new_cells: Vec::new(), table: Vec::new(), ridges: Vec::new() }
    }
}

impl<const N: usize> Rim<N> {
    /// The place of a vertex in the rim; a vertex not met before gets the next.
    #[inline]
    fn place<const D: usize>(&mut self, vertices: &mut [Vertex<D>], vertex: u32) -> u32 {
        let label = &mut vertices[vertex as usize].label;
        // A label may be stale: the list decides.
        if self.vertices.get(*label as usize) != Some(&vertex) {
            *label = self.vertices.len() as u32;
            self.vertices.push(vertex);
        }
        *label
    }
}

impl<const D: usize, const N: usize> Triangulation<D, N>
where
    Simplices: Dimension<D, N>,
{
    /// Replaces the cells in the cavity by cells that join the vertex to the boundary.
    pub(super) fn fill(&mut self, vertex: u32) {
        self.rim.vertices.clear();
        self.rim.new_cells.clear();
        for at in 0..self.boundary.len() {
            let place = match self.cavity.get(at) {
                Some(&place) => place,
                None => self.cells.allocate(),
            };
            self.join(vertex, self.boundary[at], place);
        }
        for at in self.boundary.len()..self.cavity.len() {
            self.cells.release(self.cavity[at]);
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
        let outside = &mut self.cells.list[kept];
        // Seen from the other side, the facet turns the other way.
        let mut corners = Simplices::FACETS[side].map(|k| outside.corners[k]);
        corners.swap(D - 2, D - 1);
        corners[D] = vertex;
        let infinite = corners[..D].iter().position(|&corner| corner == INFINITE);
        let order = infinite.map_or_else(in_place, infinite_last);
        // Written as a whole: a list changed at one place could not be read at once.
        let mut at = [0; N];
        order.iter().zip(0..).for_each(|(&k, place)| at[usize::from(k)] = place);
        let apex = at[D];
        let cell = Cell {
            corners: order.map(|k| corners[usize::from(k)]),
            neighbours: std::array::from_fn(|k| if k == usize::from(apex) { facet } else { 0 }),
        };
        outside.neighbours[side] = place * 4 + u32::from(apex);
        self.cells.marks[kept] = Mark::Unseen;
        self.cells.list[place as usize] = cell;
        self.cells.marks[place as usize] = Mark::Unseen;
        corners[D] = corners[0]; // not a corner of the facet: any place will do
        let rim = corners.map(|corner| self.rim.place(&mut self.vertices, corner));
        self.rim.new_cells.push(NewCell { place, rim, corners: at });
    }

    /// Links the new cells: each ridge of the rim is met once from each side.
    fn link_by_table(&mut self) {
        let Rim { vertices, new_cells, table, .. } = &mut self.rim;
        let shift = vertices.len().next_power_of_two().trailing_zeros();
        let most = 2 << (shift * (D as u32 - 1));
        if table.len() < most {
            table.resize(most, 0);
        }
        for cell in new_cells.iter() {
            for ([here, _], facet) in cell.sides(shift) {
                table[here as usize] = facet;
            }
        }
        for cell in new_cells.iter() {
            for ([_, there], facet) in cell.sides(shift) {
                let other = table[there as usize];
                self.cells.list[cell.place as usize].neighbours[facet as usize & 3] = other;
            }
        }
    }

    /// Links the new cells of a rim too large for a table.
    fn link_by_sorting(&mut self) {
        let Rim { new_cells, ridges, .. } = &mut self.rim;
        ridges.clear();
        for ([here, there], facet) in new_cells.iter().flat_map(|cell| cell.sides(32)) {
            ridges.push((here.min(there), facet));
        }
        ridges.sort_unstable();
        for pair in ridges.chunks_exact(2) {
            let (one, other) = (pair[0].1, pair[1].1);
            self.cells.list[(one >> 2) as usize].neighbours[one as usize & 3] = other;
            self.cells.list[(other >> 2) as usize].neighbours[other as usize & 3] = one;
        }
    }
}

/// Corners in the order that they are in.
fn in_place<const N: usize>() -> [u8; N] {
    std::array::from_fn(|k| k as u8)
}

/// The order of corners that puts one of them, not the last, last, by two swaps: orientation stays.
#[cold]
fn infinite_last<const N: usize>(infinite: usize) -> [u8; N] {
    let mut order = in_place();
    order.swap(infinite, N - 1);
    order.swap(0, 1);
    order
}
