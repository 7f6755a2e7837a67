//! Signs of determinants: filtered, exact, and perturbed where exactly zero.
//!
//! Two filters come first, both from the error analysis of Shewchuk (1997), whose order of operations
//! is kept: one bound on the rounding error for the whole box of points, then one for the box of the
//! points at hand. What passes neither is exact where coordinates have few digits, as in a perfect
//! crystal; else it is decided in fixed point or, where that is too coarse, by adaptive arithmetic.

use super::dimension::{Dimension, Simplices};
use super::fixed;
use crate::geometry::{Bounds, Point, Simplex, difference, lexicographic};
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

/// Of integers up to this size, the in-sphere determinant of cell and point is exact: in space, it sums up to 72
/// products of five, which are below 2^53.
const EXACT_REACH: f64 = 512.0;

impl Predicates {
    /// For points that lie in a box.
    pub fn of<const D: usize, const N: usize>(points: &[Point<D>]) -> Self
    where
        Simplices: Dimension<D, N>,
    {
        let extent = Bounds::of(points).map_or([0.0; D], |bounds| bounds.extent());
        Self { exact_reach: EXACT_REACH * unit_of(points), ..Self::new(&extent) }
    }

    /// For points in a box of these lengths.
    fn new<const D: usize, const N: usize>(extent: &Point<D>) -> Self
    where
        Simplices: Dimension<D, N>,
    {
        let [orientation, in_sphere] = Simplices::error_bounds(extent);
        Self {
            orientation_bound: ROUNDING * orientation,
            in_sphere_bound: ROUNDING * in_sphere,
            exact_reach: 0.0,
        }
    }

    /// Has the sign of the measure of a cell with these corners.
    #[inline]
    pub fn orientation<const D: usize, const N: usize>(&self, corners: [&Point<D>; N]) -> f64
    where
        Simplices: Dimension<D, N>,
    {
        let rounded = Simplices::rounded_orientation(corners);
        if rounded.abs() > self.orientation_bound {
            return rounded;
        }
        self.exact_orientation(corners)
    }

    /// What the rounded in-sphere determinant of a positive cell tells, if it tells.
    #[inline]
    pub fn in_sphere_if_clear(&self, rounded: f64) -> Option<bool> {
        (rounded.abs() > self.in_sphere_bound).then_some(rounded > 0.0)
    }

    /// Whether `p`, no corner of the cell, is inside the circumsphere of a positive cell.
    #[inline]
    pub fn in_sphere<const D: usize, const N: usize>(
        &self,
        cell: [&Point<D>; N],
        p: &Point<D>,
    ) -> bool
    where
        Simplices: Dimension<D, N>,
    {
        let rounded = Simplices::rounded_in_sphere(cell, p);
        self.in_sphere_if_clear(rounded).unwrap_or_else(|| self.exact_in_sphere(cell, p))
    }

    #[cold]
    fn exact_orientation<const D: usize, const N: usize>(&self, corners: [&Point<D>; N]) -> f64
    where
        Simplices: Dimension<D, N>,
    {
        let rounded = Simplices::rounded_orientation(corners);
        let reach = reach(&corners, corners[D]);
        if reach.iter().all(|&x| x <= self.exact_reach)
            || rounded.abs() > Self::new(&reach).orientation_bound
        {
            return rounded;
        }
        exact_orientation(corners)
    }

    #[cold]
    fn exact_in_sphere<const D: usize, const N: usize>(
        &self,
        cell: [&Point<D>; N],
        p: &Point<D>,
    ) -> bool
    where
        Simplices: Dimension<D, N>,
    {
        let rounded = Simplices::rounded_in_sphere(cell, p);
        let reach = reach(&cell, p);
        let sign = if reach.iter().all(|&x| x <= self.exact_reach)
            || rounded.abs() > Self::new(&reach).in_sphere_bound
        {
            // Adding 0 turns −0 into 0.
            (rounded + 0.0).total_cmp(&0.0)
        } else {
            exact_in_sphere(cell, p)
        };
        if sign.is_eq() { self.perturbed_in_sphere(cell, p) } else { sign.is_gt() }
    }

    /// Whether `p` is inside the circumsphere of the cell, all of them on one sphere, after the lift of each
    /// point is raised by an infinitesimal amount, larger by orders for lexicographically later points
    /// (Devillers & Teillaud 2011).
    ///
    /// The lifted sphere through the cell is a hyperplane. Raising `p` puts it above, outside. Raising
    /// corner k raises the hyperplane at `p` by the corner's barycentric weight there, which has the sign
    /// of the orientation of the cell with `p` in place of the corner. The latest point whose raise
    /// matters decides; that of `p` does, so the search ends.
    fn perturbed_in_sphere<const D: usize, const N: usize>(
        &self,
        cell: [&Point<D>; N],
        p: &Point<D>,
    ) -> bool
    where
        Simplices: Dimension<D, N>,
    {
        let mut latest_first: [usize; N] = std::array::from_fn(|k| k);
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
fn unit_of<const D: usize>(points: &[Point<D>]) -> f64 {
    const LEAST: f64 = 1.0 / (1_u64 << 40) as f64;
    let mut unit = 1.0;
    for x in points.iter().flatten() {
        while unit >= LEAST && (x / unit).fract() != 0.0 {
            unit *= 0.5;
        }
    }
    if unit >= LEAST { unit } else { 0.0 }
}

/// How far some points are from another, along each axis.
fn reach<const D: usize>(points: &[&Point<D>], other: &Point<D>) -> Point<D> {
    let mut reach = [0.0_f64; D];
    for point in points {
        let v = difference(point, other);
        reach = std::array::from_fn(|k| reach[k].max(v[k].abs()));
    }
    reach
}

/// Has the sign of the measure of a cell with these corners.
#[cold]
pub(super) fn exact_orientation<const D: usize, const N: usize>(corners: [&Point<D>; N]) -> f64
where
    Simplices: Dimension<D, N>,
{
    match fixed::orientation(corners) {
        Some(sign) => f64::from(sign as i8),
        None => simplex(corners).orientation(),
    }
}

/// The in-sphere determinant of a positive cell and `p` against zero, greater inside.
fn exact_in_sphere<const D: usize, const N: usize>(cell: [&Point<D>; N], p: &Point<D>) -> Ordering
where
    Simplices: Dimension<D, N>,
{
    fixed::in_sphere(cell, p).unwrap_or_else(|| (simplex(cell).in_sphere(p) + 0.0).total_cmp(&0.0))
}

pub(super) fn simplex<const D: usize, const N: usize>(corners: [&Point<D>; N]) -> Simplex<D> {
    Simplex { first: *corners[0], others: std::array::from_fn(|k| *corners[k + 1]) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::delaunay::tests::scatter;

    #[test]
    fn the_unit_is_the_last_digit_of_all_coordinates() {
        assert_eq!(unit_of(&[[0.5, -0.75, 0.0], [1.0, 0.25, 0.5]]), 0.25);
        assert_eq!(unit_of(&[[1.0, 0.0, -1.0]]), 1.0);
        assert_eq!(unit_of(&[[0.5, 0.1, 0.0]]), 0.0);
    }

    fn determinants_of_few_digits_are_exact<const D: usize, const N: usize>()
    where
        Simplices: Dimension<D, N>,
    {
        // Integers as far apart as is allowed, and near ones, which are often on one sphere.
        for side in [EXACT_REACH, 2.0] {
            let integers = |p: &Point<D>| p.map(|x| (x * side).round());
            let points: Vec<Point<D>> = scatter::<D>(5000, 1).iter().map(integers).collect();
            assert_eq!(Predicates::of(&points).exact_reach, EXACT_REACH);
            for some in points.chunks_exact(N + 1) {
                let (cell, p) = (std::array::from_fn(|k| &some[k]), &some[N]);
                let simplex = simplex(cell);
                let measure = Simplices::rounded_orientation(cell);
                assert_eq!(measure.partial_cmp(&0.0), simplex.orientation().partial_cmp(&0.0));
                let lifted = Simplices::rounded_in_sphere(cell, p);
                assert_eq!(lifted.partial_cmp(&0.0), simplex.in_sphere(p).partial_cmp(&0.0));
            }
        }
    }

    #[test]
    fn determinants_of_few_digits_are_exact_in_2_d_and_3_d() {
        determinants_of_few_digits_are_exact::<2, 3>();
        determinants_of_few_digits_are_exact::<3, 4>();
    }
}
