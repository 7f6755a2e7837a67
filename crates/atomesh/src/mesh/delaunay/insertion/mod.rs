//! Triangles and tetrahedra by incremental insertion (Bowyer 1981, Watson 1981): one source for both.
//!
//! In the plane read line for plane, edge for facet, circle for sphere.
//!
//! 1. Planes divide the points into a part for each thread ([`split`]); parts work alone ([`part`]).
//! 2. Points come in rounds, each about eight times the one before, along a Hilbert curve within a
//!    round: a biased randomized insertion order (Amenta, Choi & Rote 2003).
//! 3. A walk from the last cell made finds the cell that holds the point ([`locate`]).
//! 4. Cells whose circumsphere holds the point are removed; they make a connected cavity ([`cavity`]).
//! 5. New cells join the point to the facets around the hole ([`fill`]).
//! 6. Cells near other parts are found ([`seam`]), and their vertices inserted into the first part,
//!    so that final cells of all parts make up the whole ([`join`]).
//!
//! Ties are broken by coordinates, so the triangulation of the points is unique: the cells are the
//! same at any number of parts.
//!
//! An *infinite vertex* closes the hull: beyond each hull facet lies an infinite cell, so every
//! facet has two cells and points outside the hull are no special case. An infinite cell is in
//! conflict with a point that sees its facet from outside, or lies in its plane and in the
//! circumsphere of the cell behind it, so that a hull facet is never split into flat cells.
//!
//! Signs are exact: a filter decides most, adaptive arithmetic the rest, and a symbolic perturbation
//! of the in-sphere test what is truly zero ([`predicates`]). Orientation is never perturbed.

mod cavity;
mod dimension;
mod fill;
mod fixed;
mod join;
mod locate;
mod part;
mod predicates;
mod seam;
mod split;
mod start;
mod storage;
#[cfg(test)]
mod tests;

use super::prepare::Prepared;
use super::{STRIDE, canonical, rounds};
use crate::parallel::prelude::*;
use crate::watch::{Cancelled, Watch};
pub(super) use dimension::{Dimension, Simplices};
use fill::Rim;
use part::Part;
use predicates::Predicates;
use storage::{Cells, Mark, Vertex};

/// Least number of points in a part: smaller parts would be mostly seam.
const LEAST_PART: usize = 4096;

/// Most parts. More gain nothing, since one thread connects their seams.
const MOST_PARTS: usize = 16;

/// The approximate share of the work that parts do alone.
const GROWTH: f64 = 0.9;

/// See [`super::Connector`].
pub(super) fn connect<const D: usize, const N: usize>(
    prepared: &Prepared<D>,
    watch: &mut dyn Watch,
) -> Result<Option<Vec<u32>>, Cancelled>
where
    Simplices: Dimension<D, N>,
{
    let most = (prepared.points.len() / LEAST_PART).min(MOST_PARTS);
    connect_in_parts(prepared, rayon::current_num_threads().min(most), watch)
}

/// Connects points divided into at most `part_count` parts.
pub(super) fn connect_in_parts<const D: usize, const N: usize>(
    prepared: &Prepared<D>,
    part_count: usize,
    watch: &mut dyn Watch,
) -> Result<Option<Vec<u32>>, Cancelled>
where
    Simplices: Dimension<D, N>,
{
    let points = &prepared.points;
    let predicates = Predicates::of(points);
    let start = |ranks: &Vec<u32>| Part::new(points, ranks, rounds::order(ranks.len()), predicates);
    let whole = || (0..points.len() as u32).collect::<Vec<u32>>();
    let parts: Option<Vec<Part<D, N>>> =
        split::split(points, whole(), part_count).par_iter().map(start).collect();
    // Points of a part may lie on one plane when others do not.
    match parts.or_else(|| start(&whole()).map(|part| vec![part])) {
        Some(parts) => connect_parts(parts, &prepared.order, watch).map(Some),
        None => Ok(None),
    }
}

/// Inserts the points one by one in the given order: the reference for insertion by parts.
#[cfg(test)]
pub(super) fn connect_in_order<const D: usize, const N: usize>(
    points: &[crate::geometry::Point<D>],
    order: Vec<u32>,
    watch: &mut dyn Watch,
) -> Result<Option<Vec<u32>>, Cancelled>
where
    Simplices: Dimension<D, N>,
{
    let ranks: Vec<u32> = (0..points.len() as u32).collect();
    match Part::new(points, &ranks, order, Predicates::of(points)) {
        Some(part) => connect_parts(vec![part], &ranks, watch).map(Some),
        None => Ok(None),
    }
}

fn connect_parts<const D: usize, const N: usize>(
    mut parts: Vec<Part<D, N>>,
    order: &[u32],
    watch: &mut dyn Watch,
) -> Result<Vec<u32>, Cancelled>
where
    Simplices: Dimension<D, N>,
{
    let share = if parts.len() == 1 { 1.0 } else { GROWTH };
    part::grow(&mut parts, share, watch)?;
    let triangulations = join::join(parts, share, watch)?;
    let corners = canonical::arrange(&triangulations, order);
    // Memory is freed in parallel too.
    triangulations.into_par_iter().for_each(drop);
    Ok(corners)
}

/// The Delaunay cells of the points inserted so far.
struct Triangulation<const D: usize, const N: usize> {
    /// The infinite vertex, then the points: those of a part in prepared order.
    vertices: Vec<Vertex<D>>,
    cells: Cells<N>,
    predicates: Predicates,
    /// Where the next walk starts.
    hint: u32,
    /// Cells in conflict with the point being inserted.
    cavity: Vec<u32>,
    /// Cells to be tested for conflict with it, and their rounded in-sphere determinants.
    candidates: Vec<(u32, f64)>,
    /// The facets around the cavity, as seen from the cells that stay.
    boundary: Vec<u32>,
    rim: Rim<N>,
}

impl<const D: usize, const N: usize> Triangulation<D, N>
where
    Simplices: Dimension<D, N>,
{
    /// The triangulation of vertices that span a positive cell.
    fn new(vertices: Vec<Vertex<D>>, first: [u32; N], predicates: Predicates) -> Self {
        let cells = start::first_cells(first, vertices.len());
        Self {
            vertices,
            cells,
            predicates,
            hint: 0,
            cavity: Vec::new(),
            candidates: Vec::new(),
            boundary: Vec::new(),
            rim: Rim::default(),
        }
    }

    fn insert(&mut self, vertex: u32) {
        let p = self.vertices[vertex as usize].at;
        let holder = self.locate(&p);
        self.dig(&p, holder);
        self.fill(vertex);
    }
}

impl<const D: usize, const N: usize> canonical::CellSource<N> for Triangulation<D, N> {
    fn place_count(&self) -> usize {
        self.cells.list.len()
    }

    #[inline]
    fn corners(&self, place: usize) -> Option<[u32; N]> {
        let cell = &self.cells.list[place];
        let is_finite = self.cells.marks[place] != Mark::Free && !cell.is_infinite();
        is_finite.then(|| cell.corners.map(|vertex| self.vertices[vertex as usize].rank))
    }
}
