//! A part of the points, with the cells of those inserted so far.

use super::dimension::{Dimension, Simplices};
use super::predicates::Predicates;
use super::storage::Vertex;
use super::{STRIDE, Triangulation, start};
use crate::geometry::{Bounds, Point};
use crate::watch::{Cancelled, Phase, Watch, check};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// Some of the points, their triangulation, and what is left to insert.
pub(super) struct Part<const D: usize, const N: usize> {
    pub triangulation: Triangulation<D, N>,
    /// The box of all its points.
    pub bounds: Bounds<D>,
    /// The vertices in order of insertion.
    order: Vec<u32>,
    /// How many of them are inserted.
    inserted: usize,
}

impl<const D: usize, const N: usize> Part<D, N>
where
    Simplices: Dimension<D, N>,
{
    /// Of the points with these ranks, ascending, to be inserted in the given order of their places
    /// among them; `None` if they lie on one line (plane) or plane
    /// (space).
    pub fn new(
        points: &[Point<D>],
        ranks: &[u32],
        mut order: Vec<u32>,
        predicates: Predicates,
    ) -> Option<Self> {
        order.iter_mut().for_each(|place| *place += 1);
        let mut vertices = Vec::with_capacity(ranks.len() + 1);
        vertices.push(Vertex { at: [0.0; D], rank: 0, label: 0 });
        let vertex = |&rank: &u32| Vertex { at: points[rank as usize], rank, label: 0 };
        vertices.extend(ranks.iter().map(vertex));
        if !start::bring_simplex_first(&vertices, &mut order) {
            return None;
        }
        let mut bounds = Bounds { min: vertices[1].at, max: vertices[1].at };
        vertices[2..].iter().for_each(|vertex| bounds.include(&vertex.at));
        let first = std::array::from_fn(|k| order[k]);
        let triangulation = Triangulation::new(vertices, first, predicates);
        Some(Self { triangulation, bounds, order, inserted: N })
    }

    /// Inserts at most `most` of the next points; returns how many.
    pub fn insert(&mut self, most: usize) -> usize {
        let end = self.order.len().min(self.inserted + most);
        let next = &self.order[self.inserted..end];
        next.iter().for_each(|&vertex| self.triangulation.insert(vertex));
        let count = next.len();
        self.inserted = end;
        count
    }

    /// Whether all points are inserted.
    fn is_whole(&self) -> bool {
        self.inserted == self.order.len()
    }
}

/// Inserts all points in all parts, in parallel: the first on this thread, which looks at the watch, the
/// others on others, none waiting for another before its end. `share` is that of the whole work.
pub(super) fn grow<const D: usize, const N: usize>(
    parts: &mut [Part<D, N>],
    share: f64,
    watch: &mut dyn Watch,
) -> Result<(), Cancelled>
where
    Simplices: Dimension<D, N>,
{
    let count: usize = parts.iter().map(|part| part.order.len()).sum();
    let inserted = AtomicUsize::new(parts.iter().map(|part| part.inserted).sum());
    let is_cancelled = AtomicBool::new(false);
    let insert = |part: &mut Part<D, N>| inserted.fetch_add(part.insert(STRIDE), Ordering::Relaxed);
    let Some((first, others)) = parts.split_first_mut() else { return Ok(()) };
    rayon::in_place_scope(|scope| {
        for part in others {
            let goes_on =
                |part: &Part<D, N>| !part.is_whole() && !is_cancelled.load(Ordering::Relaxed);
            scope.spawn(move |_| {
                while goes_on(part) {
                    insert(part);
                }
            });
        }
        while !first.is_whole() {
            let done = inserted.load(Ordering::Relaxed) as f64 / count as f64;
            if let Err(cancelled) = check(watch, Phase::Connect, share * done, None) {
                is_cancelled.store(true, Ordering::Relaxed);
                return Err(cancelled);
            }
            insert(first);
        }
        Ok(())
    })
}
