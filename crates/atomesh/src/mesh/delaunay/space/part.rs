//! A part of the points, with the cells of those inserted so far.

use super::predicates::Predicates;
use super::storage::Vertex;
use super::{STRIDE, Triangulation, start};
use crate::geometry::{Bounds, Point};
use crate::watch::{Cancelled, Phase, Watch, check};
use rayon::prelude::*;

/// Points inserted in each of several parts between two looks at the watch: some 0.1 s. All wait for
/// the slowest before each look, so it is longer than [`STRIDE`].
const LONG_STRIDE: usize = 8 * STRIDE;

/// Some of the points, their triangulation, and what is left to insert.
pub(super) struct Part {
    pub triangulation: Triangulation,
    /// The box of all its points.
    pub bounds: Bounds<3>,
    /// The vertices in order of insertion.
    order: Vec<u32>,
    /// How many of them are inserted.
    inserted: usize,
}

impl Part {
    /// Of the points with these ranks, ascending, to be inserted in the given order of their places
    /// among them; `None` if they lie on one plane.
    pub fn new(
        points: &[Point<3>],
        ranks: &[u32],
        mut order: Vec<u32>,
        predicates: Predicates,
    ) -> Option<Self> {
        order.iter_mut().for_each(|place| *place += 1);
        let mut vertices = Vec::with_capacity(ranks.len() + 1);
        vertices.push(Vertex { at: [0.0; 3], rank: 0, label: 0 });
        let vertex = |&rank: &u32| Vertex { at: points[rank as usize], rank, label: 0 };
        vertices.extend(ranks.iter().map(vertex));
        if !start::bring_simplex_first(&vertices, &mut order) {
            return None;
        }
        let mut bounds = Bounds { min: vertices[1].at, max: vertices[1].at };
        vertices[2..].iter().for_each(|vertex| bounds.include(&vertex.at));
        let first = [order[0], order[1], order[2], order[3]];
        let triangulation = Triangulation::new(vertices, first, predicates);
        Some(Self { triangulation, bounds, order, inserted: 4 })
    }

    /// Inserts the next points, so many at most.
    pub fn insert(&mut self, most: usize) {
        let end = self.order.len().min(self.inserted + most);
        for &vertex in &self.order[self.inserted..end] {
            self.triangulation.insert(vertex);
        }
        self.inserted = end;
    }
}

/// Inserts all points in all parts, in parallel. `share` is that of the whole work.
pub(super) fn grow(parts: &mut [Part], share: f64, watch: &mut dyn Watch) -> Result<(), Cancelled> {
    let count: usize = parts.iter().map(|part| part.order.len()).sum();
    loop {
        let inserted: usize = parts.iter().map(|part| part.inserted).sum();
        if inserted == count {
            return Ok(());
        }
        check(watch, Phase::Connect, share * inserted as f64 / count as f64, None)?;
        match &mut *parts {
            [one] => one.insert(STRIDE),
            several => several.par_iter_mut().for_each(|part| part.insert(LONG_STRIDE)),
        }
    }
}
