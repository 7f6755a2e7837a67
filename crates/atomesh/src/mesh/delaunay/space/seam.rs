//! Where a part meets others: the cells whose circumspheres may hold points of other parts.
//!
//! Cells in conflict with a point outside the hull are connected, through facets, with the infinite
//! cells that see it. So a search from one such cell, through cells that may hold points of the
//! other parts' boxes, finds all that must go; a cell that it does not reach is a cell of the whole,
//! even if its own circumsphere is too ill-conditioned to tell. This costs no more than the seam.

use super::Triangulation;
use super::storage::Tetrahedron;
use crate::geometry::{Bounds, Point, cross, difference, dot};

/// Half a unit in the last place of 1.
const ROUNDING: f64 = f64::EPSILON / 2.0;

impl Triangulation {
    /// Finds the cells that points in the boxes may be in conflict with, as a cavity, and their
    /// boundary. The boxes must not meet the box of the vertices.
    pub(super) fn loosen(&mut self, boxes: &[Bounds<3>]) {
        let seen: Vec<u32> = boxes.iter().map(|bounds| self.locate(&bounds.min)).collect();
        self.spread(seen, |triangulation, cell| {
            boxes.iter().any(|bounds| triangulation.may_conflict(cell, bounds))
        });
    }

    /// Whether a point in the box may be in conflict with the cell; see [`Self::conflicts`].
    fn may_conflict(&self, cell: &Tetrahedron, bounds: &Bounds<3>) -> bool {
        let at = |k: usize| &self.vertices[cell.corners[k] as usize].at;
        if !cell.is_infinite() {
            return !Ball::around([at(0), at(1), at(2), at(3)]).is_clear_of(bounds);
        }
        let sides = (0..8).map(|corner: usize| {
            let ends = [&bounds.min, &bounds.max];
            let p = std::array::from_fn(|k| ends[corner >> k & 1][k]);
            self.predicates.orientation([at(0), at(1), at(2), &p])
        });
        let highest = sides.fold(f64::NEG_INFINITY, f64::max);
        let behind = (cell.neighbours[3] >> 2) as usize;
        highest > 0.0 || highest == 0.0 && self.may_conflict(&self.tetrahedra.cells[behind], bounds)
    }
}

/// A ball that holds the circumsphere of a cell.
struct Ball {
    centre: Point<3>,
    radius: f64,
}

impl Ball {
    /// The radius is large enough for all rounding; not finite if rounding leaves the centre open.
    ///
    /// With u, v, w the vectors from a corner to the others, the centre is at
    /// (|u|² v × w + |v|² w × u + |w|² u × v) / (2 u · v × w) from it.
    fn around([a, b, c, d]: [&Point<3>; 4]) -> Self {
        let (u, v, w) = (difference(b, a), difference(c, a), difference(d, a));
        let (vw, wu, uv) = (cross(&v, &w), cross(&w, &u), cross(&u, &v));
        let lifts = [dot(&u, &u), dot(&v, &v), dot(&w, &w)];
        let volume = dot(&u, &vw);
        let to_centre: Point<3> = std::array::from_fn(|k| {
            (lifts[0] * vw[k] + lifts[1] * wu[k] + lifts[2] * uv[k]) / (2.0 * volume)
        });
        // With all components of u, v, w up to `reach`, a component of the numerator sums up to 18
        // products of four and the volume 6 of three. No product passes more than 16 roundings.
        let reach = [u, v, w].iter().flatten().fold(0.0_f64, |reach, x| reach.max(x.abs()));
        let numerator_error = 16.0 * ROUNDING * 18.0 * reach.powi(4);
        let volume_error = 16.0 * ROUNDING * 6.0 * reach.powi(3);
        let length = dot(&to_centre, &to_centre).sqrt();
        if volume.abs() <= 2.0 * volume_error {
            return Self { centre: *a, radius: f64::INFINITY };
        }
        // The quotient's error for a volume off by less than a half, along three axes, with room for
        // the roundings of the quotient, of the sums and of the distance to a box.
        let error = (numerator_error + 4.0 * length * volume_error) / volume.abs();
        Self {
            centre: std::array::from_fn(|k| a[k] + to_centre[k]),
            radius: length + 4.0 * error + 32.0 * ROUNDING * (length + 1.0),
        }
    }

    /// Whether the box is outside, strictly.
    fn is_clear_of(&self, bounds: &Bounds<3>) -> bool {
        let gap: Point<3> = std::array::from_fn(|k| {
            (bounds.min[k] - self.centre[k]).max(self.centre[k] - bounds.max[k]).max(0.0)
        });
        dot(&gap, &gap).sqrt() > self.radius
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Simplex;
    use crate::mesh::delaunay::tests::{jittered, scatter};

    /// Checks that no point of which a ball is clear lies in the exact circumsphere, and counts
    /// those that lie outside and are not seen to.
    fn unseen(cell: [Point<3>; 4], points: &[Point<3>]) -> usize {
        let ball = Ball::around([&cell[0], &cell[1], &cell[2], &cell[3]]);
        let mut simplex = Simplex { first: cell[0], others: [cell[1], cell[2], cell[3]] };
        if simplex.orientation() < 0.0 {
            simplex.others.swap(0, 1);
        }
        let outside = |p: &&Point<3>| {
            let bounds = Bounds { min: **p, max: **p };
            let clear = ball.is_clear_of(&bounds);
            assert!(!clear || simplex.in_sphere(p) < 0.0, "{cell:?} {p:?}");
            !clear && simplex.in_sphere(p) < 0.0
        };
        points.iter().filter(outside).count()
    }

    #[test]
    fn a_ball_that_is_clear_of_a_point_has_it_outside() {
        let square = [[0.25, 0.25, 0.5], [0.75, 0.25, 0.5], [0.75, 0.75, 0.5], [0.25, 0.75, 0.5]];
        let mut points = scatter::<3>(200, 1);
        points.extend(jittered(&square, 1e-15));
        for cell in scatter::<3>(400, 2).as_chunks::<4>().0 {
            // Rounding leaves nothing open at this size.
            assert_eq!(unseen(*cell, &points), 0, "{cell:?}");
        }
        // Flat cells, in which rounding plays the larger part.
        for exponent in 1..17 {
            let flat = jittered(&square, 10.0_f64.powi(-exponent));
            unseen([flat[0], flat[1], flat[2], flat[3]], &points);
        }
        assert!(
            Ball::around([&square[0], &square[1], &square[2], &square[3]]).radius.is_infinite()
        );
    }
}
