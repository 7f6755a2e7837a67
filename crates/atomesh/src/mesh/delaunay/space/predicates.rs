//! Signs of determinants: filtered, exact, and perturbed where exactly zero.
//!
//! Two filters come first, both from the error analysis of Shewchuk (1997), whose order of operations
//! is kept: one bound on the rounding error for the whole box of points, then one for the box of the
//! points at hand. What passes neither is exact where coordinates have few digits, as in a perfect
//! crystal; else it is decided in fixed point or, where that is too coarse, by adaptive arithmetic.

use super::fixed;
use crate::geometry::{Bounds, Point, lexicographic};
use robust::{Coord3D, insphere, orient3d};
use std::cmp::Ordering;

/// Half a unit in the last place of 1.
const ROUNDING: f64 = f64::EPSILON / 2.0;

/// The error bounds for points in one box, or no further apart than its sides.
#[derive(Clone, Copy, Debug)]
pub(super) struct Predicates {
    orientation_bound: f64,
    in_sphere_bound: f64,
    /// Determinants of points no further apart along any axis are exact.
    exact_reach: f64,
}

/// Of integers up to this size, the in-sphere determinant of cell and point is exact: it sums up to 72
/// products of five, which are below 2^53.
const EXACT_REACH: f64 = 512.0;

impl Predicates {
    /// For points that lie in a box.
    pub fn of(points: &[Point<3>]) -> Self {
        let extent = Bounds::of(points).map_or([0.0; 3], |bounds| bounds.extent());
        Self { exact_reach: EXACT_REACH * unit_of(points), ..Self::new(extent) }
    }

    /// For points in a box of these lengths.
    fn new(extent: Point<3>) -> Self {
        let volume = extent[0] * extent[1] * extent[2];
        let lift = extent[0] * extent[0] + extent[1] * extent[1] + extent[2] * extent[2];
        // Shewchuk's bounds are (7 + 56ε)ε and (16 + 224ε)ε times the permanent: with every
        // difference as large as the box, 6 products of three, and 24 of these times a lift.
        Self {
            orientation_bound: 8.0 * ROUNDING * 6.0 * volume,
            in_sphere_bound: 17.0 * ROUNDING * 24.0 * volume * lift,
            exact_reach: 0.0,
        }
    }

    /// Has the sign of the volume of a, b, c, d.
    #[inline]
    pub fn orientation(&self, [a, b, c, d]: [&Point<3>; 4]) -> f64 {
        let rounded = rounded_orientation([a, b, c, d]);
        if rounded.abs() > self.orientation_bound {
            return rounded;
        }
        self.exact_orientation([a, b, c, d])
    }

    /// What the rounded in-sphere determinant of a positive cell tells, if it tells.
    #[inline]
    pub fn in_sphere_if_clear(&self, rounded: f64) -> Option<bool> {
        (rounded.abs() > self.in_sphere_bound).then_some(rounded > 0.0)
    }

    /// Whether `p`, no corner of the cell, is inside the circumsphere of a positive cell.
    #[inline]
    pub fn in_sphere(&self, cell: [&Point<3>; 4], p: &Point<3>) -> bool {
        let rounded = rounded_in_sphere(cell, p);
        if rounded.abs() > self.in_sphere_bound {
            rounded > 0.0
        } else {
            self.exact_in_sphere(cell, p)
        }
    }

    /// Has the sign of the volume of a, b, c, d.
    #[cold]
    fn exact_orientation(&self, corners: [&Point<3>; 4]) -> f64 {
        let [a, b, c, d] = corners;
        let rounded = rounded_orientation(corners);
        let reach = reach([a, b, c], d);
        if reach.iter().all(|&x| x <= self.exact_reach)
            || rounded.abs() > Self::new(reach).orientation_bound
        {
            return rounded;
        }
        exact_orientation(corners)
    }

    #[cold]
    fn exact_in_sphere(&self, cell: [&Point<3>; 4], p: &Point<3>) -> bool {
        let rounded = rounded_in_sphere(cell, p);
        let reach = reach(cell, p);
        let sign = if reach.iter().all(|&x| x <= self.exact_reach)
            || rounded.abs() > Self::new(reach).in_sphere_bound
        {
            // Adding 0 turns −0 into 0.
            (rounded + 0.0).total_cmp(&0.0)
        } else {
            exact_in_sphere(cell, p)
        };
        if sign.is_eq() { self.perturbed_in_sphere(cell, p) } else { sign.is_gt() }
    }

    /// Whether `p` is inside the circumsphere of the cell, all five on one sphere, after the lift of each
    /// point is raised by an infinitesimal amount, larger by orders for lexicographically later points
    /// (Devillers & Teillaud 2011).
    ///
    /// The lifted sphere through the cell is a hyperplane. Raising `p` puts it above, outside. Raising
    /// corner k raises the hyperplane at `p` by the corner's barycentric weight there, which has the sign
    /// of the orientation of the cell with `p` in place of the corner. The latest point whose raise
    /// matters decides; that of `p` does, so the search ends.
    fn perturbed_in_sphere(&self, cell: [&Point<3>; 4], p: &Point<3>) -> bool {
        let mut latest_first = [0, 1, 2, 3];
        latest_first.sort_unstable_by(|&i, &j| lexicographic(cell[j], cell[i]));
        for corner in latest_first {
            if lexicographic(p, cell[corner]).is_gt() {
                return false;
            }
            let mut replaced = cell;
            replaced[corner] = p;
            let weight = self.exact_orientation(replaced);
            if weight != 0.0 {
                return weight > 0.0;
            }
        }
        false
    }
}

/// The largest power of two of which all coordinates are multiples, up to 1; 0 if it is below 2^-40.
fn unit_of(points: &[Point<3>]) -> f64 {
    const LEAST: f64 = 1.0 / (1_u64 << 40) as f64;
    let mut unit = 1.0;
    for x in points.iter().flatten() {
        while unit >= LEAST && (x / unit).fract() != 0.0 {
            unit *= 0.5;
        }
    }
    if unit >= LEAST { unit } else { 0.0 }
}

#[inline(always)]
fn minus(a: &Point<3>, b: &Point<3>) -> Point<3> {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
fn rounded_orientation([a, b, c, d]: [&Point<3>; 4]) -> f64 {
    let (a, b, c) = (minus(a, d), minus(b, d), minus(c, d));
    a[2] * (c[0] * b[1] - b[0] * c[1])
        + b[2] * (a[0] * c[1] - c[0] * a[1])
        + c[2] * (b[0] * a[1] - a[0] * b[1])
}

#[inline(always)]
pub(super) fn rounded_in_sphere(cell: [&Point<3>; 4], p: &Point<3>) -> f64 {
    let [a, b, c, d] = cell.map(|corner| minus(corner, p));
    let minor = |u: &Point<3>, v: &Point<3>| u[0] * v[1] - v[0] * u[1];
    let (ab, bc, cd) = (minor(&a, &b), minor(&b, &c), minor(&c, &d));
    let (da, ac, bd) = (minor(&d, &a), minor(&a, &c), minor(&b, &d));
    let abc = a[2] * bc - b[2] * ac + c[2] * ab;
    let bcd = b[2] * cd - c[2] * bd + d[2] * bc;
    let cda = c[2] * da + d[2] * ac + a[2] * cd;
    let dab = d[2] * ab + a[2] * bd + b[2] * da;
    let lift = |u: &Point<3>| u[0] * u[0] + u[1] * u[1] + u[2] * u[2];
    // The negative of Shewchuk's: his positive tetrahedra are left-handed.
    (lift(&c) * dab - lift(&d) * abc) + (lift(&a) * bcd - lift(&b) * cda)
}

/// How far the points are from the last, along each axis.
fn reach<const N: usize>(points: [&Point<3>; N], last: &Point<3>) -> Point<3> {
    let mut reach = [0.0_f64; 3];
    for point in points {
        let v = minus(point, last);
        reach = std::array::from_fn(|k| reach[k].max(v[k].abs()));
    }
    reach
}

fn coordinates(p: &Point<3>) -> Coord3D<f64> {
    Coord3D { x: p[0], y: p[1], z: p[2] }
}

/// Has the sign of the volume of a, b, c, d.
#[cold]
pub(super) fn exact_orientation(corners: [&Point<3>; 4]) -> f64 {
    if let Some(sign) = fixed::orientation(corners) {
        return f64::from(sign as i8);
    }
    let [a, b, c, d] = corners.map(coordinates);
    -orient3d(a, b, c, d)
}

/// The in-sphere determinant of a positive cell and `p` against zero, greater inside.
fn exact_in_sphere(cell: [&Point<3>; 4], p: &Point<3>) -> Ordering {
    fixed::in_sphere(cell, p).unwrap_or_else(|| {
        let [a, b, c, d] = cell.map(coordinates);
        0.0_f64.total_cmp(&(insphere(a, b, c, d, coordinates(p)) + 0.0))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Simplex;
    use crate::mesh::delaunay::tests::scatter;

    #[test]
    fn the_unit_is_the_last_digit_of_all_coordinates() {
        assert_eq!(unit_of(&[[0.5, -0.75, 0.0], [1.0, 0.25, 0.5]]), 0.25);
        assert_eq!(unit_of(&[[1.0, 0.0, -1.0]]), 1.0);
        assert_eq!(unit_of(&[[0.5, 0.1, 0.0]]), 0.0);
    }

    #[test]
    fn determinants_of_few_digits_are_exact() {
        // Integers as far apart as is allowed, and near ones, which are often on one sphere.
        for side in [EXACT_REACH, 2.0] {
            let integers = |p: &Point<3>| p.map(|x| (x * side).round());
            let points: Vec<Point<3>> = scatter::<3>(5000, 1).iter().map(integers).collect();
            let predicates = Predicates::of(&points);
            assert_eq!(predicates.exact_reach, EXACT_REACH);
            for five in points.as_chunks::<5>().0 {
                let [a, b, c, d, p] = five;
                let simplex = Simplex { first: *a, others: [*b, *c, *d] };
                let volume = rounded_orientation([a, b, c, d]);
                assert_eq!(volume.partial_cmp(&0.0), simplex.orientation().partial_cmp(&0.0));
                let lifted = rounded_in_sphere([a, b, c, d], p);
                assert_eq!(lifted.partial_cmp(&0.0), simplex.in_sphere(p).partial_cmp(&0.0));
            }
        }
    }
}
