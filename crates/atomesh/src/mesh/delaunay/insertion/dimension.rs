//! What triangles and tetrahedra do not share: short formulas, and who is opposite to whom.

use super::fixed::{Wide, minor, triple, widened};
use crate::geometry::{Point, cross, difference, dot};

/// Simplices of `N = D + 1` corners. A name for [`Dimension`]'s two forms, as `D + 1` cannot be written in a type.
pub struct Simplices;

/// Cells in `D` dimensions, of `N = D + 1` corners.
pub trait Dimension<const D: usize, const N: usize> {
    /// For each corner, the corners of the opposite facet and then itself, in an order that is positive.
    const FACETS: [[usize; N]; N];

    /// Cells for each point, finite and infinite, at random; arrays grow if there are more.
    const CELLS_A_POINT: usize;

    /// Bounds on the errors of [`Self::rounded_orientation`] and [`Self::rounded_in_sphere`] in a box of these lengths,
    /// from the error analysis of Shewchuk (1997), in units of half a last place of 1.
    fn error_bounds(extent: &Point<D>) -> [f64; 2];

    /// Has the sign of the cell's measure, but for rounding.
    fn rounded_orientation(corners: [&Point<D>; N]) -> f64;

    /// Above zero inside the circumsphere of a positive cell, but for rounding.
    fn rounded_in_sphere(cell: [&Point<D>; N], p: &Point<D>) -> f64;

    /// The determinant of vectors of integers below 2^61.
    fn determinant(vectors: &[[i64; D]; D]) -> Wide;

    /// For each corner of a facet, of which the corners' places in a rim are given: what the facet's other corners are in
    /// the rim, and what they are as seen from the new cell beyond them. Places are below 2^`shift`, the numbers below
    /// 2^(`D − 1`) `shift`, or twice that.
    fn ridges(facet: &[u32; N], shift: u32) -> [[u64; 2]; N];

    /// The circumcentre of a cell as seen from its first corner, times a number, and the number: twice the determinant of
    /// the edges from there, and their greatest component to bound errors by.
    fn centre(edges: &[Point<D>; D]) -> (Point<D>, f64);

    /// How many products a component of [`Self::centre`]'s vector sums up, and half its number.
    const CENTRE_TERMS: [f64; 2];
}

impl Dimension<2, 3> for Simplices {
    const FACETS: [[usize; 3]; 3] = [[1, 2, 0], [2, 0, 1], [0, 1, 2]];
    const CELLS_A_POINT: usize = 2;
    const CENTRE_TERMS: [f64; 2] = [4.0, 2.0];

    fn error_bounds(extent: &Point<2>) -> [f64; 2] {
        // Shewchuk's bounds are (3 + 16ε)ε and (10 + 96ε)ε times the permanent: with every difference as large as the box,
        // 2 products of two, and 6 of these times a lift.
        let area = extent[0] * extent[1];
        [4.0 * 2.0 * area, 11.0 * 6.0 * area * dot(extent, extent)]
    }

    #[inline(always)]
    fn rounded_orientation([a, b, c]: [&Point<2>; 3]) -> f64 {
        let (a, b) = (difference(a, c), difference(b, c));
        a[0] * b[1] - a[1] * b[0]
    }

    #[inline(always)]
    fn rounded_in_sphere(cell: [&Point<2>; 3], p: &Point<2>) -> f64 {
        let [a, b, c] = cell.map(|corner| difference(corner, p));
        let minor = |u: &Point<2>, v: &Point<2>| u[0] * v[1] - v[0] * u[1];
        dot(&a, &a) * minor(&b, &c) + dot(&b, &b) * minor(&c, &a) + dot(&c, &c) * minor(&a, &b)
    }

    fn determinant([a, b]: &[[i64; 2]; 2]) -> Wide {
        widened(minor([a[0], a[1]], [b[0], b[1]]))
    }

    #[inline(always)]
    fn ridges(&[a, b, _]: &[u32; 3], _: u32) -> [[u64; 2]; 3] {
        // at each vertex of the rim one new cell ends and the next begins
        let (end, start) = (2 * u64::from(b), 2 * u64::from(a) + 1);
        [[end, end + 1], [start, start - 1], [0; 2]]
    }

    fn centre([u, v]: &[Point<2>; 2]) -> (Point<2>, f64) {
        let (uu, vv) = (dot(u, u), dot(v, v));
        let across = [uu * v[1] - vv * u[1], vv * u[0] - uu * v[0]];
        (across, 2.0 * (u[0] * v[1] - u[1] * v[0]))
    }
}

impl Dimension<3, 4> for Simplices {
    const FACETS: [[usize; 4]; 4] = [[1, 3, 2, 0], [0, 2, 3, 1], [0, 3, 1, 2], [0, 1, 2, 3]];
    const CELLS_A_POINT: usize = 7;
    const CENTRE_TERMS: [f64; 2] = [18.0, 6.0];

    fn error_bounds(extent: &Point<3>) -> [f64; 2] {
        // Shewchuk's bounds are (7 + 56ε)ε and (16 + 224ε)ε times the permanent: with every difference as large as the box,
        // 6 products of three, and 24 of these times a lift.
        let volume = extent[0] * extent[1] * extent[2];
        [8.0 * 6.0 * volume, 17.0 * 24.0 * volume * dot(extent, extent)]
    }

    #[inline(always)]
    fn rounded_orientation([a, b, c, d]: [&Point<3>; 4]) -> f64 {
        let (a, b, c) = (difference(a, d), difference(b, d), difference(c, d));
        a[2] * (c[0] * b[1] - b[0] * c[1])
            + b[2] * (a[0] * c[1] - c[0] * a[1])
            + c[2] * (b[0] * a[1] - a[0] * b[1])
    }

    #[inline(always)]
    fn rounded_in_sphere(cell: [&Point<3>; 4], p: &Point<3>) -> f64 {
        let [a, b, c, d] = cell.map(|corner| difference(corner, p));
        let minor = |u: &Point<3>, v: &Point<3>| u[0] * v[1] - v[0] * u[1];
        let (ab, bc, cd) = (minor(&a, &b), minor(&b, &c), minor(&c, &d));
        let (da, ac, bd) = (minor(&d, &a), minor(&a, &c), minor(&b, &d));
        let abc = a[2] * bc - b[2] * ac + c[2] * ab;
        let bcd = b[2] * cd - c[2] * bd + d[2] * bc;
        let cda = c[2] * da + d[2] * ac + a[2] * cd;
        let dab = d[2] * ab + a[2] * bd + b[2] * da;
        // The negative of Shewchuk's: his positive tetrahedra are left-handed.
        (dot(&c, &c) * dab - dot(&d, &d) * abc) + (dot(&a, &a) * bcd - dot(&b, &b) * cda)
    }

    fn determinant([a, b, c]: &[[i64; 3]; 3]) -> Wide {
        triple(a, b, c)
    }

    #[inline(always)]
    fn ridges(&[a, b, c, _]: &[u32; 4], shift: u32) -> [[u64; 2]; 4] {
        // each edge of the rim is met once in each direction
        let edge = |from: u32, to: u32| {
            let (from, to) = (u64::from(from), u64::from(to));
            [from << shift | to, to << shift | from]
        };
        [edge(b, c), edge(c, a), edge(a, b), [0; 2]]
    }

    fn centre([u, v, w]: &[Point<3>; 3]) -> (Point<3>, f64) {
        let (vw, wu, uv) = (cross(v, w), cross(w, u), cross(u, v));
        let [uu, vv, ww] = [u, v, w].map(|edge| dot(edge, edge));
        (std::array::from_fn(|k| uu * vw[k] + vv * wu[k] + ww * uv[k]), 2.0 * dot(u, &vw))
    }
}
