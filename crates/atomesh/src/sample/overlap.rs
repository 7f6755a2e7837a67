//! How much of each sample's box lies in a cell, exactly.
//!
//! No solid is ever cut, only the cell's facets. A cell's part in a row of boxes along axis 0 lies between the facets
//! that the row passes through: a piece of facet whose normal points up the axis fills the row before it, and one whose
//! normal points down empties it again. So each facet is cut into slabs across axis 2, those into strips across axis 1,
//! those into pieces across axis 0. A piece adds its share to its own box, and its *shadow*, its area seen along the row,
//! to all boxes before. One sum along the row then gives every overlap, and boxes wholly inside cost one addition. The
//! overlaps of a cell sum to its measure, and those of all cells with a sample's box to the box, since neighbours share
//! the pieces between them with opposite sign.
//!
//! A triangle of the plane is handled as the prism of height one over it. Cost: O(boxes in the cell's bounds).

use super::clip::{Axis, Parts, each_part, shadow, split};
use crate::geometry::Point;

/// A cell's facets by their corners, counter-clockwise as seen from outside, or all of them clockwise.
#[derive(Default)]
pub(super) struct Surface {
    corners: Vec<Point<3>>,
    ends: Vec<usize>,
}

impl Surface {
    /// Removes all facets.
    pub fn clear(&mut self) {
        self.corners.clear();
        self.ends.clear();
    }

    /// Adds a facet.
    pub fn push(&mut self, facet: impl IntoIterator<Item = Point<3>>) {
        self.corners.extend(facet);
        self.ends.push(self.corners.len());
    }

    fn facets(&self) -> impl Iterator<Item = &[Point<3>]> {
        let starts = [0].into_iter().chain(self.ends.iter().copied());
        starts.zip(&self.ends).map(|(start, &end)| &self.corners[start..end])
    }

    /// The volume inside, negative if the facets look inward.
    pub fn measure(&self) -> f64 {
        self.facets().map(|facet| shadow(facet).1).sum()
    }
}

/// Finds overlaps of cells with the boxes of an image's samples.
pub(super) struct Overlaps {
    axes: [Axis; 3],
    /// The part of each facet beyond the current slab.
    rests: Vec<Vec<Point<3>>>,
    slab: Vec<Point<3>>,
    spare: Vec<Point<3>>,
    strips: Parts,
    pieces: Parts,
    rows: Rows,
}

impl Overlaps {
    /// Overlaps with boxes along the given axes.
    pub fn new(axes: [Axis; 3]) -> Self {
        Self {
            axes,
            rests: Vec::new(),
            slab: Vec::new(),
            spare: Vec::new(),
            strips: Parts::default(),
            pieces: Parts::default(),
            rows: Rows::default(),
        }
    }

    /// Calls `visit` for each row of boxes that the cell reaches, with the first sample (its index along each axis) and
    /// the overlaps from there to the last box that the cell reaches. Overlaps are negative if facets look inward. Boxes
    /// that the cell just misses may have roundings for overlaps.
    pub fn each_row(&mut self, surface: &Surface, mut visit: impl FnMut([usize; 3], &[f64])) {
        let Some((first, last)) = self.reach(surface) else { return };
        self.rows.cut = surface.corners.iter().any(|p| p[0] <= 0.0);
        self.rests.resize_with(surface.ends.len(), Vec::new);
        for (rest, facet) in self.rests.iter_mut().zip(surface.facets()) {
            rest.clear();
            rest.extend_from_slice(facet);
            if facet.iter().any(|p| p[2] < 0.0) {
                split(facet, 2, 0.0, &mut self.slab, rest);
            }
        }
        for z in first[2]..=last[2] {
            self.rows.reset(first, last);
            let side = self.axes[2].side(z + 1);
            for facet in 0..surface.ends.len() {
                let rest = &mut self.rests[facet];
                if rest.iter().all(|p| p[2] >= side) {
                    continue;
                }
                if rest.iter().all(|p| p[2] <= side) {
                    std::mem::swap(&mut self.slab, rest);
                    rest.clear();
                } else {
                    split(rest, 2, side, &mut self.slab, &mut self.spare);
                    std::mem::swap(&mut self.spare, rest);
                }
                self.cut_slab();
            }
            self.rows.each(&self.axes[0], |x, y, overlaps| visit([x, y, z], overlaps));
        }
    }

    /// The first and the last boxes along each axis that the surface may reach; `None` if it reaches none.
    fn reach(&self, surface: &Surface) -> Option<([usize; 3], [usize; 3])> {
        let (mut first, mut last) = ([0; 3], [0; 3]);
        for k in 0..3 {
            let (mut min, mut max) = (f64::INFINITY, f64::NEG_INFINITY);
            for p in &surface.corners {
                (min, max) = (min.min(p[k]), max.max(p[k]));
            }
            if !(max > 0.0 && min < self.axes[k].end) {
                return None;
            }
            (first[k], last[k]) = (self.axes[k].holding(min), self.axes[k].holding(max));
        }
        Some((first, last))
    }

    /// Cuts the part of a facet in a slab into strips and pieces, and adds them to the rows.
    fn cut_slab(&mut self) {
        let Self { axes: [x_axis, y_axis, _], slab, strips, pieces, rows, .. } = self;
        each_part(slab, 1, y_axis, strips, |y, strip| {
            if y == y_axis.count {
                return;
            }
            each_part(strip, 0, x_axis, pieces, |x, piece| rows.add(x_axis, [x, y], piece));
        });
    }
}

/// The rows of boxes in one slab, within the bounds of a cell.
#[derive(Default)]
struct Rows {
    first: [usize; 2],
    shape: [usize; 2],
    /// Whether the cell may begin in box 0 or before, where no pieces are kept: then rows are filled from box 0.
    cut: bool,
    /// The first and the last box of each row that has a piece.
    reached: Vec<[usize; 2]>,
    /// For each box, the volume between its pieces and its lower side.
    own: Vec<f64>,
    /// The shadows of the pieces in each box, and after the last box those of all pieces beyond.
    shadows: Vec<f64>,
    overlaps: Vec<f64>,
}

impl Rows {
    fn reset(&mut self, first: [usize; 3], last: [usize; 3]) {
        self.first = [first[0], first[1]];
        self.shape = [last[0] - first[0] + 1, last[1] - first[1] + 1];
        let count = (self.shape[0] + 1) * self.shape[1];
        for values in [&mut self.own, &mut self.shadows] {
            values.clear();
            values.resize(count, 0.0);
        }
        self.reached.clear();
        self.reached.resize(self.shape[1], [usize::MAX, 0]);
    }

    /// Adds a piece of facet in box `x` of row `y`.
    #[inline]
    fn add(&mut self, axis: &Axis, [x, y]: [usize; 2], piece: &[Point<3>]) {
        let (area, moment) = shadow(piece);
        let (column, row) = (x - self.first[0], y - self.first[1]);
        let [low, high] = &mut self.reached[row];
        (*low, *high) = ((*low).min(column), (*high).max(column));
        let at = row * (self.shape[0] + 1) + column;
        self.shadows[at] += area;
        if x < axis.count {
            self.own[at] += moment - area * axis.side(x);
        }
    }

    /// Calls `visit` with the first box, the row and the overlaps of each row.
    fn each(&mut self, axis: &Axis, mut visit: impl FnMut(usize, usize, &[f64])) {
        let count = self.shape[0];
        self.overlaps.resize(count, 0.0);
        for row in 0..self.shape[1] {
            let [low, high] = self.reached[row];
            if low == usize::MAX {
                continue;
            }
            let (low, high) = (if self.cut { 0 } else { low }, high.min(count - 1));
            let at = row * (count + 1);
            let mut filled = self.shadows[at + count];
            for x in (low..=high).rev() {
                self.overlaps[x] = self.own[at + x] + filled * axis.width(self.first[0] + x);
                filled += self.shadows[at + x];
            }
            if low <= high {
                visit(self.first[0] + low, self.first[1] + row, &self.overlaps[low..=high]);
            }
        }
    }
}
