//! Where a part meets others: the cells whose circumspheres may hold points of other parts.
//!
//! Cells in conflict with a point outside the hull are connected, through facets, with the infinite
//! cells that see it. So a search from one such cell, through cells that may hold points of the
//! other parts' boxes, finds all that must go; a cell that it does not reach is a cell of the whole,
//! even if its own circumsphere is too ill-conditioned to tell. This costs no more than the seam.

use super::Triangulation;
use super::dimension::{Dimension, Simplices};
use super::storage::Cell;
use crate::geometry::{Bounds, Point, difference, dot};

/// Half a unit in the last place of 1.
const ROUNDING: f64 = f64::EPSILON / 2.0;

impl<const D: usize, const N: usize> Triangulation<D, N>
where
    Simplices: Dimension<D, N>,
{
    /// Finds the cells that points in the boxes may be in conflict with, as a cavity, and their
    /// boundary. The boxes must not meet the box of the vertices.
    pub(super) fn loosen(&mut self, boxes: &[Bounds<D>]) {
        let seen: Vec<u32> = boxes.iter().map(|bounds| self.locate(&bounds.min)).collect();
        self.spread(seen, |triangulation, cell| {
            boxes.iter().any(|bounds| triangulation.may_conflict(cell, bounds))
        });
    }

    /// Whether a point in the box may be in conflict with the cell; see [`Self::conflicts`].
    fn may_conflict(&self, cell: &Cell<N>, bounds: &Bounds<D>) -> bool {
        let corners = cell.corners.map(|vertex| &self.vertices[vertex as usize].at);
        if !cell.is_infinite() {
            return !Ball::around(corners).is_clear_of(bounds);
        }
        let sides = (0..1 << D).map(|corner: usize| {
            let ends = [&bounds.min, &bounds.max];
            let p = std::array::from_fn(|k| ends[corner >> k & 1][k]);
            let mut facet = corners;
            facet[D] = &p;
            self.predicates.orientation(facet)
        });
        let highest = sides.fold(f64::NEG_INFINITY, f64::max);
        let behind = cell.behind() as usize;
        highest > 0.0 || highest == 0.0 && self.may_conflict(&self.cells.list[behind], bounds)
    }
}

/// A ball that holds the circumsphere of a cell.
struct Ball<const D: usize> {
    centre: Point<D>,
    radius: f64,
}

impl<const D: usize> Ball<D> {
    /// The radius is large enough for all rounding; not finite if rounding leaves the centre open.
    ///
    /// With u, v, w the edges from a corner to the others, the centre is at
    /// (|u|² v × w + |v|² w × u + |w|² u × v) / (2 u · v × w) from it; in the plane, where a vector turned by a right
    /// angle is what a product of two is in space, at (|v|² u − |u|² v) turned, over 2 u × v.
    fn around<const N: usize>(corners: [&Point<D>; N]) -> Self
    where
        Simplices: Dimension<D, N>,
    {
        let corner = corners[0];
        let edges: [Point<D>; D] = std::array::from_fn(|k| difference(corners[k + 1], corner));
        let (numerator, twice_measure) = Simplices::centre(&edges);
        let to_centre = numerator.map(|x| x / twice_measure);
        let measure = 0.5 * twice_measure;
        // With all components of the edges up to `reach`, a component of the numerator sums up to 18
        // products of four and the volume 6 of three; in the plane 4 of three and 2 of two. No product
        // passes more than 16 roundings.
        let reach = edges.iter().flatten().fold(0.0_f64, |reach, x| reach.max(x.abs()));
        let power = reach.powi(D as i32);
        let [numerator_terms, measure_terms] = Simplices::CENTRE_TERMS;
        let numerator_error = 16.0 * ROUNDING * numerator_terms * power * reach;
        let measure_error = 16.0 * ROUNDING * measure_terms * power;
        let length = dot(&to_centre, &to_centre).sqrt();
        if measure.abs() <= 2.0 * measure_error {
            return Self { centre: *corner, radius: f64::INFINITY };
        }
        // The quotient's error for a measure off by less than a half, along all axes, with room for
        // the roundings of the quotient, of the sums and of the distance to a box.
        let error = (numerator_error + 4.0 * length * measure_error) / measure.abs();
        Self {
            centre: std::array::from_fn(|k| corner[k] + to_centre[k]),
            radius: length + 4.0 * error + 32.0 * ROUNDING * (length + 1.0),
        }
    }

    /// Whether the box is outside, strictly.
    fn is_clear_of(&self, bounds: &Bounds<D>) -> bool {
        let gap: Point<D> = std::array::from_fn(|k| {
            (bounds.min[k] - self.centre[k]).max(self.centre[k] - bounds.max[k]).max(0.0)
        });
        dot(&gap, &gap).sqrt() > self.radius
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::delaunay::insertion::predicates::simplex;
    use crate::mesh::delaunay::tests::{jittered, scatter};

    /// Checks that no point of which a ball is clear lies in the exact circumsphere, and counts
    /// those that lie outside and are not seen to.
    fn unseen<const D: usize, const N: usize>(cell: [&Point<D>; N], points: &[Point<D>]) -> usize
    where
        Simplices: Dimension<D, N>,
    {
        let ball = Ball::around(cell);
        let mut simplex = simplex(cell);
        if simplex.orientation() < 0.0 {
            simplex.others.swap(0, 1);
        }
        let outside = |p: &&Point<D>| {
            let bounds = Bounds { min: **p, max: **p };
            let clear = ball.is_clear_of(&bounds);
            assert!(!clear || simplex.in_sphere(p) < 0.0, "{cell:?} {p:?}");
            !clear && simplex.in_sphere(p) < 0.0
        };
        points.iter().filter(outside).count()
    }

    fn a_ball_that_is_clear_of_a_point_has_it_outside<const D: usize, const N: usize>(
        on_one_sphere: [Point<D>; N],
    ) where
        Simplices: Dimension<D, N>,
    {
        let mut points = scatter::<D>(200, 1);
        points.extend(jittered(&on_one_sphere, 1e-15));
        for cell in scatter::<D>(400, 2).as_chunks::<N>().0 {
            // Rounding leaves nothing open at this size.
            assert_eq!(unseen(cell.each_ref(), &points), 0, "{cell:?}");
        }
        // Flat cells, in which rounding plays the larger part.
        for exponent in 1..17 {
            let flat = jittered(&on_one_sphere, 10.0_f64.powi(-exponent));
            unseen(std::array::from_fn(|k| &flat[k]), &points);
        }
        assert!(Ball::around(on_one_sphere.each_ref()).radius.is_infinite());
    }

    #[test]
    fn a_ball_that_is_clear_of_a_point_has_it_outside_in_2_d_and_3_d() {
        a_ball_that_is_clear_of_a_point_has_it_outside([[0.25, 0.25], [0.5, 0.5], [0.75, 0.75]]);
        a_ball_that_is_clear_of_a_point_has_it_outside([
            [0.25, 0.25, 0.5],
            [0.75, 0.25, 0.5],
            [0.75, 0.75, 0.5],
            [0.25, 0.75, 0.5],
        ]);
    }
}
