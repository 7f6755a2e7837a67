//! Parts triangulated alone become the triangulation of all points.
//!
//! 1. In each part but the first, the cells that other parts' points may be in conflict with are
//!    loosened ([`super::seam`]); the others are final, being Delaunay cells of all points.
//! 2. The first part takes the vertices of the loose cells of the others as its own. A vertex that it
//!    does not take has final cells alone around it, the same as among all points. So every cell of
//!    the whole that is not final in another part has only vertices that the first now has, and is
//!    one of its cells.
//! 3. The facets between loose and final cells are found in the first part. What lies beyond them in
//!    it is the region of the final cells of others, and is removed ([`Triangulation::cut`]).
//!
//! The Delaunay triangulation is unique, its ties broken by coordinates alone, so the cells are those
//! of one triangulation, whatever the parts. Where everything is seam, as on a sphere, all points are
//! inserted in the first part in the end.

use super::dimension::{Dimension, Simplices};
use super::part::Part;
use super::storage::{INFINITE, Mark};
use super::{STRIDE, Triangulation, rounds};
use crate::geometry::Bounds;
use crate::parallel::prelude::*;
use crate::watch::{Cancelled, Phase, Watch, check};

/// A facet on the border between final cells of other parts and the rest.
struct Border<const D: usize> {
    /// Its vertices in the first part, ascending.
    vertices: [u32; D],
    /// Whether sorting them took an odd number of swaps, as seen from the final cell.
    odd: bool,
}

/// The triangulations of the parts, without the cells that are not of the whole. Work is reported
/// from `share` on.
pub(super) fn join<const D: usize, const N: usize>(
    mut parts: Vec<Part<D, N>>,
    share: f64,
    watch: &mut dyn Watch,
) -> Result<Vec<Triangulation<D, N>>, Cancelled>
where
    Simplices: Dimension<D, N>,
{
    if parts.len() == 1 {
        return Ok(parts.into_iter().map(|part| part.triangulation).collect());
    }
    let boxes: Vec<Bounds<D>> = parts.iter().map(|part| part.bounds).collect();
    parts[1..].par_iter_mut().enumerate().for_each(|(before, part)| {
        let index = before + 1;
        let others: Vec<Bounds<D>> = boxes
            .iter()
            .enumerate()
            .filter(|other| other.0 != index)
            .map(|other| *other.1)
            .collect();
        part.triangulation.loosen(&others);
    });
    let mut triangulations = parts.into_iter().map(|part| part.triangulation).collect::<Vec<_>>();
    let (first, others) = triangulations.split_first_mut().expect("there is a part");
    let base = first.vertices.len() as u32;
    let mut border = Vec::new();
    let mut added = Vec::new();
    for other in others {
        added.extend(first.take_seam(other, &mut border));
    }
    for (chunk, vertices) in added.chunks(STRIDE).enumerate() {
        let done = (chunk * STRIDE) as f64 / added.len() as f64;
        check(watch, Phase::Connect, share + (1.0 - share) * done, None)?;
        vertices.iter().for_each(|&vertex| first.insert(vertex));
    }
    first.cut(border, base);
    Ok(triangulations)
}

impl<const D: usize, const N: usize> Triangulation<D, N>
where
    Simplices: Dimension<D, N>,
{
    /// Takes the vertices of the other's loose cells and gives them in order of insertion; the loose
    /// cells are freed.
    fn take_seam(&mut self, other: &mut Self, border: &mut Vec<Border<D>>) -> Vec<u32> {
        let mut seam: Vec<u32> = Vec::new();
        for &cell in &other.cavity {
            for vertex in other.cells.list[cell as usize].corners {
                let label = &mut other.vertices[vertex as usize].label;
                // A label may be stale: the list decides.
                if vertex != INFINITE && seam.get(*label as usize) != Some(&vertex) {
                    *label = seam.len() as u32;
                    seam.push(vertex);
                }
            }
            other.cells.release(cell);
        }
        seam.sort_unstable();
        let base = self.vertices.len() as u32;
        for (place, &vertex) in seam.iter().enumerate() {
            let vertex = &mut other.vertices[vertex as usize];
            self.vertices.push(*vertex);
            vertex.label = base + place as u32;
        }
        other.vertices[INFINITE as usize].label = INFINITE;
        for &facet in &other.boundary {
            let corners = other.cells.list[(facet >> 2) as usize].corners;
            let facet = Simplices::FACETS[(facet & 3) as usize];
            let label = |k: usize| other.vertices[corners[facet[k]] as usize].label;
            let (vertices, odd) = sorted(std::array::from_fn(label));
            border.push(Border { vertices, odd });
        }
        rounds::order(seam.len()).into_iter().map(|place| base + place).collect()
    }

    /// Removes the cells beyond the border, on the side of its final cells. Vertices from `base` on
    /// are the seam's.
    fn cut(&mut self, mut border: Vec<Border<D>>, base: u32) {
        border.sort_unstable_by_key(|facet| facet.vertices);
        let beyond: Vec<u32> = (0..self.cells.list.len())
            .into_par_iter()
            .flat_map_iter(|cell| self.facets_beyond(cell, &border, base))
            .collect();
        assert_eq!(beyond.len(), border.len(), "every facet of the border is a facet of the seam");
        const NONE: u32 = u32::MAX;
        let mut cells = Vec::new();
        for facet in beyond {
            let (cell, corner) = (facet >> 2, facet & 3);
            self.cells.list[cell as usize].neighbours[corner as usize] = NONE;
            cells.push(cell);
        }
        while let Some(cell) = cells.pop() {
            if self.cells.marks[cell as usize] != Mark::Free {
                self.cells.release(cell);
                let facets = self.cells.list[cell as usize].neighbours;
                cells.extend(facets.iter().filter(|&&facet| facet != NONE).map(|facet| facet >> 2));
            }
        }
    }

    /// The facets of a cell that are on the border, if the cell is beyond it.
    fn facets_beyond(
        &self,
        cell: usize,
        border: &[Border<D>],
        base: u32,
    ) -> impl Iterator<Item = u32> {
        let corners = self.cells.list[cell].corners;
        let may_be = move |vertex: u32| vertex >= base || vertex == INFINITE;
        let count = corners.iter().filter(|&&vertex| may_be(vertex)).count();
        let is_near = count >= D && self.cells.marks[cell] != Mark::Free;
        let is_beyond = move |corner: &usize| {
            let facet = Simplices::FACETS[*corner];
            let (vertices, odd) = sorted(std::array::from_fn(|k| corners[facet[k]]));
            let found = || border.binary_search_by_key(&vertices, |facet| facet.vertices);
            vertices.into_iter().all(may_be) && found().is_ok_and(|at| border[at].odd == odd)
        };
        let corners = if is_near { 0..N } else { 0..0 };
        corners.filter(is_beyond).map(move |corner| (4 * cell + corner) as u32)
    }
}

/// Vertices in ascending order, and whether this took an odd number of swaps.
fn sorted<const D: usize>(mut vertices: [u32; D]) -> ([u32; D], bool) {
    let mut odd = false;
    for end in (1..D).rev() {
        for k in 0..end {
            if vertices[k] > vertices[k + 1] {
                vertices.swap(k, k + 1);
                odd = !odd;
            }
        }
    }
    (vertices, odd)
}
