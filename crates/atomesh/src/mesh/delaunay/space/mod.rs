//! Tetrahedra by incremental insertion (Bowyer 1981, Watson 1981).
//!
//! 1. Points come in rounds, each about eight times the one before, along a Hilbert curve within a
//!    round: a biased randomized insertion order (Amenta, Choi & Rote 2003).
//! 2. A walk from the last cell made finds the cell that holds the point ([`locate`]).
//! 3. Cells whose circumsphere holds the point are removed; they are connected ([`cavity`]).
//! 4. New cells join the point to the facets around the hole ([`fill`]).
//!
//! An *infinite vertex* closes the hull: beyond each hull facet lies an infinite cell, so every
//! facet has two cells and points outside the hull are no special case. An infinite cell is in
//! conflict with a point that sees its facet from outside, or lies in its plane and in the
//! circumsphere of the cell behind it, so that a hull facet is never split into flat cells.
//!
//! Signs are exact: a filter decides most, adaptive arithmetic the rest, and a symbolic perturbation
//! of the in-sphere test what is truly zero ([`predicates`]). Orientation is never perturbed.

mod cavity;
mod fill;
mod fixed;
mod locate;
mod predicates;
mod start;
mod storage;

use super::{STRIDE, rounds};
use crate::geometry::{Bounds, Point};
use crate::watch::{Cancelled, Phase, Watch, check};
use fill::Rim;
use predicates::Predicates;
use storage::{Tetrahedra, Vertex};

/// See [`super::Connector`].
pub(super) fn connect(
    points: &[Point<3>],
    watch: &mut dyn Watch,
) -> Result<Option<Vec<u32>>, Cancelled> {
    connect_in_order(points, rounds::order(points.len()), watch)
}

/// Inserts the points in the given order of their ranks.
pub(super) fn connect_in_order(
    points: &[Point<3>],
    mut order: Vec<u32>,
    watch: &mut dyn Watch,
) -> Result<Option<Vec<u32>>, Cancelled> {
    if !start::bring_simplex_first(points, &mut order) {
        return Ok(None);
    }
    let mut triangulation = Triangulation::new(points, [order[0], order[1], order[2], order[3]]);
    let mut done = 0;
    for ranks in order[4..].chunks(STRIDE) {
        check(watch, Phase::Connect, done as f64 / order.len() as f64, None)?;
        for &rank in ranks {
            triangulation.insert(rank + 1);
        }
        done += ranks.len();
    }
    Ok(Some(triangulation.tetrahedra.finite_corners()))
}

/// The Delaunay tetrahedra of the points inserted so far.
struct Triangulation {
    /// The infinite vertex, then the points in prepared order: vertex = rank + 1.
    vertices: Vec<Vertex>,
    tetrahedra: Tetrahedra,
    predicates: Predicates,
    /// Where the next walk starts.
    hint: u32,
    /// Cells in conflict with the point being inserted.
    cavity: Vec<u32>,
    /// The facets around them, as seen from the cells that stay.
    boundary: Vec<u32>,
    rim: Rim,
}

impl Triangulation {
    fn new(points: &[Point<3>], first: [u32; 4]) -> Self {
        let extent = Bounds::of(points).map_or([0.0; 3], |bounds| bounds.extent());
        let vertices: Vec<Vertex> =
            std::iter::once(&[0.0; 3]).chain(points).map(|&at| Vertex { at, label: 0 }).collect();
        let tetrahedra = start::first_cells(first.map(|rank| rank + 1), points.len());
        Self {
            vertices,
            tetrahedra,
            predicates: Predicates::new(extent),
            hint: 0,
            cavity: Vec::new(),
            boundary: Vec::new(),
            rim: Rim::default(),
        }
    }

    fn insert(&mut self, vertex: u32) {
        let holder = self.locate(vertex);
        self.dig(vertex, holder);
        self.fill(vertex);
    }
}
