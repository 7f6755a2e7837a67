//! The short lines between the places of curves, by where they are, so that those near a place are found at once.

use crate::geometry::{Bins, Bounds, Point, distance_squared};

use super::trace::Curve;

/// A line between two places of a curve that follow each other.
#[derive(Clone, Copy, Debug)]
pub(super) struct Segment<const D: usize> {
    /// Its curve, and its number along that.
    pub curve: usize,
    pub index: usize,
    pub ends: [Point<D>; 2],
}

/// All segments of all curves. Long ones are divided into parts of a step at most, each known by its middle.
pub(super) struct Segments<const D: usize> {
    segments: Vec<Segment<D>>,
    /// The segment of each part.
    of_parts: Vec<u32>,
    bins: Bins<D>,
    step: f64,
}

impl<const D: usize> Segments<D> {
    /// The segments of curves, in their order.
    pub fn of(curves: &[Curve<D>], bounds: &Bounds<D>, step: f64) -> Self {
        let count = curves.iter().map(|curve| curve.places.len()).sum();
        let bins = Bins::new(bounds, step, count);
        let mut all =
            Self { segments: Vec::with_capacity(count), of_parts: Vec::new(), bins, step };
        for (curve, places) in curves.iter().map(|curve| &curve.places).enumerate() {
            for (index, pair) in places.windows(2).enumerate() {
                all.push(Segment { curve, index, ends: [pair[0], pair[1]] });
            }
        }
        all
    }

    /// Adds a segment.
    pub fn push(&mut self, segment: Segment<D>) {
        let number = self.segments.len() as u32;
        let Self { bins, of_parts, step, .. } = self;
        middles(&segment.ends, *step).for_each(|middle| {
            bins.push(&middle);
            of_parts.push(number);
        });
        self.segments.push(segment);
    }

    /// All of them, in the order in which they were added.
    pub fn all(&self) -> &[Segment<D>] {
        &self.segments
    }

    /// Visits the numbers of all segments that come within `reach` of a place, and some more; some more than once.
    pub fn near(&self, p: &Point<D>, reach: f64, mut visit: impl FnMut(usize)) {
        self.bins.near(p, reach + 0.5 * self.step, |part| visit(self.of_parts[part] as usize));
    }

    /// The numbers of the segments of later curves that come within `gap` of a segment along every axis, and some more,
    /// ascending.
    pub fn later_near(&self, number: usize, gap: f64) -> Vec<usize> {
        let Segment { curve, ends, .. } = self.segments[number];
        let mut found = Vec::new();
        for middle in middles(&ends, self.step) {
            self.near(&middle, gap + 0.5 * self.step, |other| {
                if self.segments[other].curve > curve {
                    found.push(other);
                }
            });
        }
        found.sort_unstable();
        found.dedup();
        found
    }
}

/// The middles of as many equal parts of a line as make each at most a step long.
fn middles<const D: usize>(
    [from, to]: &[Point<D>; 2],
    step: f64,
) -> impl Iterator<Item = Point<D>> {
    let parts = (distance_squared(from, to).sqrt() / step).ceil().max(1.0);
    (0..parts as usize).map(move |part| {
        let share = (part as f64 + 0.5) / parts;
        std::array::from_fn(|k| from[k] + share * (to[k] - from[k]))
    })
}
