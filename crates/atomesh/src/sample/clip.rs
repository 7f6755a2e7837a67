//! Flat facets cut by the sides of the samples' boxes.
//!
//! A facet is a convex polygon with its corners in order. Only planes at right angles to an axis cut it.

use crate::geometry::Point;

/// The boxes of the samples along one axis: box i reaches from side i to side i + 1.
///
/// A box is one wide and centred at its sample, cut where it would leave the image: the first and the last
/// are half as wide.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Axis {
    /// How many boxes there are.
    pub count: usize,
    /// Where the last box ends; the first begins at 0.
    pub end: f64,
}

impl Axis {
    /// The boxes of samples 0 to `count − 1`.
    pub fn of_samples(count: usize) -> Self {
        Self { count, end: (count - 1) as f64 }
    }

    /// One box from 0 to 1.
    pub fn single() -> Self {
        Self { count: 1, end: 1.0 }
    }

    /// Where box `i` begins, and the one before it ends.
    #[inline]
    pub fn side(&self, i: usize) -> f64 {
        match i {
            0 => 0.0,
            _ if i == self.count => self.end,
            _ => i as f64 - 0.5,
        }
    }

    /// How wide box `i` is.
    #[inline]
    pub fn width(&self, i: usize) -> f64 {
        self.side(i + 1) - self.side(i)
    }

    /// The box that holds `x`, or the nearest.
    #[inline]
    pub fn holding(&self, x: f64) -> usize {
        ((x + 0.5).max(0.0) as usize).min(self.count - 1)
    }
}

/// Room for the parts of a polygon.
#[derive(Default)]
pub(super) struct Parts {
    below: Vec<Point<3>>,
    rest: Vec<Point<3>>,
    above: Vec<Point<3>>,
}

/// Calls `visit` with the part of a convex polygon within each box along `axis`, ascending, and last, as box
/// `count`, with the part beyond the last. What lies before the first is left out.
pub(super) fn each_part(
    polygon: &[Point<3>],
    axis: usize,
    boxes: &Axis,
    parts: &mut Parts,
    mut visit: impl FnMut(usize, &[Point<3>]),
) {
    let (mut min, mut max) = (f64::INFINITY, f64::NEG_INFINITY);
    for p in polygon {
        (min, max) = (min.min(p[axis]), max.max(p[axis]));
    }
    if max <= 0.0 {
        return;
    }
    let first = boxes.holding(min);
    if min >= 0.0 && max <= boxes.side(first + 1) {
        visit(first, polygon);
        return;
    }
    parts.rest.clear();
    if min < 0.0 {
        split(polygon, axis, 0.0, &mut parts.below, &mut parts.rest);
    } else {
        parts.rest.extend_from_slice(polygon);
    }
    for i in first..boxes.count {
        let side = boxes.side(i + 1);
        if max <= side {
            visit(i, &parts.rest);
            return;
        }
        split(&parts.rest, axis, side, &mut parts.below, &mut parts.above);
        visit(i, &parts.below);
        std::mem::swap(&mut parts.rest, &mut parts.above);
    }
    visit(boxes.count, &parts.rest);
}

/// The parts of a convex polygon on both sides of a plane, each empty or closed by a side in the plane.
///
/// An edge crosses the plane at the same point from whichever end it is followed, so that facets that share
/// the edge stay joined.
pub(super) fn split(
    polygon: &[Point<3>],
    axis: usize,
    at: f64,
    below: &mut Vec<Point<3>>,
    above: &mut Vec<Point<3>>,
) {
    below.clear();
    above.clear();
    let Some(mut a) = polygon.last() else { return };
    for b in polygon {
        let (from, to) = (a[axis], b[axis]);
        if (from < at && to > at) || (from > at && to < at) {
            let (low, high) = if from < to { (a, b) } else { (b, a) };
            let share = (at - low[axis]) / (high[axis] - low[axis]);
            let mut crossing: Point<3> =
                std::array::from_fn(|k| low[k] + share * (high[k] - low[k]));
            crossing[axis] = at;
            below.push(crossing);
            above.push(crossing);
        }
        if to <= at {
            below.push(*b);
        }
        if to >= at {
            above.push(*b);
        }
        a = b;
    }
}

/// The area of a polygon seen along axis 0, positive if its normal points up that axis, and the integral of
/// coordinate 0 over that area.
#[inline]
pub(super) fn shadow(polygon: &[Point<3>]) -> (f64, f64) {
    let [first, rest @ ..] = polygon else { return (0.0, 0.0) };
    let (mut area, mut moment) = (0.0, 0.0);
    for pair in rest.windows(2) {
        let [[x1, y1, z1], [x2, y2, z2]] = [pair[0], pair[1]];
        let part = 0.5 * ((y1 - first[1]) * (z2 - first[2]) - (y2 - first[1]) * (z1 - first[2]));
        area += part;
        moment += part * (first[0] + x1 + x2) / 3.0;
    }
    (area, moment)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boxes_tile_the_axis_and_hold_their_samples() {
        let axis = Axis::of_samples(4);
        let sides: Vec<f64> = (0..=4).map(|i| axis.side(i)).collect();
        assert_eq!(sides, [0.0, 0.5, 1.5, 2.5, 3.0]);
        assert_eq!((0..4).map(|i| axis.width(i)).sum::<f64>(), 3.0);
        for (x, i) in [(-9.0, 0), (0.0, 0), (0.49, 0), (0.5, 1), (2.0, 2), (2.51, 3), (77.0, 3)] {
            assert_eq!(axis.holding(x), i, "{x}");
        }
        let single = Axis::single();
        assert_eq!((single.side(0), single.side(1), single.holding(1.0)), (0.0, 1.0, 0));
    }

    #[test]
    fn parts_of_a_triangle_have_its_area_and_its_moment() {
        let triangle = [[-0.7, 0.1, 0.2], [2.2, 1.9, 0.4], [4.0, 0.3, 2.7]];
        let axis = Axis::of_samples(4);
        let (mut area, mut moment, mut beyond) = (0.0, 0.0, 0.0);
        let mut parts = Parts::default();
        let mut seen = Vec::new();
        each_part(&triangle, 0, &axis, &mut parts, |i, part| {
            let (a, m) = shadow(part);
            if i < 4 {
                assert!(part.iter().all(|p| axis.side(i) <= p[0] && p[0] <= axis.side(i + 1)));
                moment += m;
                area += a;
            } else {
                beyond += a;
            }
            seen.push(i);
        });
        assert_eq!(seen, [0, 1, 2, 3, 4]);
        // the corner before 0 is similar to the triangle: shares 0.7/2.9 and 0.7/4.7 of its sides
        let (whole, _) = shadow(&triangle);
        let before = whole * 0.7 / 2.9 * 0.7 / 4.7;
        let after = whole * 1.0 / 1.8 * 1.0 / 4.7;
        assert!((area - (whole - before - after)).abs() < 1e-14 && (beyond - after).abs() < 1e-14);
        assert!(moment > 0.0 && moment < 3.0 * area);
    }

    #[test]
    fn a_polygon_in_the_plane_of_a_side_is_in_one_box_alone() {
        let square = [[0.5, 0.0, 0.0], [0.5, 1.0, 0.0], [0.5, 1.0, 1.0], [0.5, 0.0, 1.0]];
        let mut parts = Parts::default();
        let mut total = 0.0;
        let axis = Axis::of_samples(3);
        each_part(&square, 0, &axis, &mut parts, |_, part| total += shadow(part).0);
        assert_eq!((total, shadow(&square)), (1.0, (1.0, 0.5)));
    }
}
