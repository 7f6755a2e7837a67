//! The shape of one tetrahedron: its least dihedral angle, as a cosine, and its quality.
//!
//! The cross products of its edges are normal to its facets and as long as twice their areas; angles, inradius and
//! circumradius follow from them without a matrix or an arc cosine. [`crate::measure`] computes the same more
//! slowly for reports; a test compares them.

use crate::geometry::{Point, difference, dot};

/// The shape of a tetrahedron.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Shape {
    /// The cosine of the least dihedral angle: 1/3 if equilateral, 1 if flat, [`UPSIDE_DOWN`] if not of positive
    /// orientation for sure.
    pub cosine: f64,
    /// 3 · inradius / circumradius, 0 (flat) to 1 (equilateral).
    pub quality: f64,
}

/// The cosine of a cell that has no positive orientation: worse than that of any that has.
pub(super) const UPSIDE_DOWN: f64 = 2.0;

/// The determinant's rounding error, as a share of the product of the edges' lengths: differences of coordinates
/// are rounded by half an ulp each, products and sums some ten times more; 10⁻¹³ is a hundred times as much.
/// A determinant above it has the sign of the exact one.
const ROUNDING: f64 = 1e-13;

/// The vector product.
#[inline(always)]
pub(super) fn cross(a: &Point<3>, b: &Point<3>) -> Point<3> {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// The shape of the tetrahedron with these corners.
#[inline(always)]
pub(super) fn shape(p: &Point<3>, q: &Point<3>, r: &Point<3>, s: &Point<3>) -> Shape {
    let (u, v, w) = (difference(q, p), difference(r, p), difference(s, p));
    let (a, b, c) = (cross(&v, &w), cross(&w, &u), cross(&u, &v));
    let determinant = dot(&u, &a);
    let (uu, vv, ww) = (dot(&u, &u), dot(&v, &v), dot(&w, &w));
    // not `<=`: a NaN is no positive orientation either
    let sound = determinant > 0.0 && determinant * determinant > ROUNDING * ROUNDING * uu * vv * ww;
    if !sound {
        return Shape { cosine: UPSIDE_DOWN, quality: 0.0 };
    }
    let o: Point<3> = std::array::from_fn(|k| -(a[k] + b[k] + c[k]));
    let length = |n: &Point<3>| dot(n, n).sqrt();
    let (la, lb, lc, lo) = (length(&a), length(&b), length(&c), length(&o));
    let (ia, ib, ic, io) = (1.0 / la, 1.0 / lb, 1.0 / lc, 1.0 / lo);
    let cosine = (-dot(&a, &b) * (ia * ib))
        .max(-dot(&a, &c) * (ia * ic))
        .max(-dot(&b, &c) * (ib * ic))
        .max(-dot(&a, &o) * (ia * io))
        .max(-dot(&b, &o) * (ib * io))
        .max(-dot(&c, &o) * (ic * io));
    // circumcentre − p = (uu a + vv b + ww c) / 2 det; inradius = det / (la + lb + lc + lo)
    let centre: Point<3> = std::array::from_fn(|k| uu * a[k] + vv * b[k] + ww * c[k]);
    let quality = 6.0 * determinant * determinant / ((la + lb + lc + lo) * length(&centre));
    Shape { cosine, quality }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::cell_shape;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn shape_is_what_reports_say(x in prop::array::uniform12(-1.0..1.0f64)) {
            let p: [Point<3>; 4] = std::array::from_fn(|i| std::array::from_fn(|k| x[3 * i + k]));
            let expected = cell_shape(&[
                difference(&p[1], &p[0]),
                difference(&p[2], &p[0]),
                difference(&p[3], &p[0]),
            ]);
            let found = shape(&p[0], &p[1], &p[2], &p[3]);
            if expected.measure < 0.0 {
                prop_assert_eq!(found.cosine, UPSIDE_DOWN);
            } else if expected.measure > 1e-6 {
                // both lose digits as the measure does, six of sixteen at the most
                prop_assert!((found.quality - expected.quality).abs() < 1e-8);
                prop_assert!((found.cosine - expected.least_angle.to_radians().cos()).abs() < 1e-8);
            }
        }
    }

    #[test]
    fn flat_and_turned_cells_are_no_cells() {
        let p = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        assert_eq!(shape(&p[0], &p[1], &p[2], &p[3]).cosine, UPSIDE_DOWN);
        assert_eq!(shape(&p[1], &p[0], &p[2], &p[4]).cosine, UPSIDE_DOWN);
        assert!(shape(&p[0], &p[1], &p[2], &p[4]).cosine < 1.0);
        assert_eq!(shape(&[f64::NAN; 3], &p[1], &p[2], &p[4]).cosine, UPSIDE_DOWN);
    }
}
