//! The shape of one tetrahedron: its least dihedral angle, as a cosine, and its quality.
//!
//! The cross products of its edges are normal to its facets and as long as twice their areas; angles, inradius and
//! circumradius follow from them without a matrix or an arc cosine. [`crate::measure`] computes the same more
//! slowly for reports; a test compares them.

use crate::geometry::{Point, cross, difference, dot};

/// The shape of a tetrahedron.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Shape {
    /// The cosine of the least dihedral angle: 1/3 if equilateral, 1 if flat, [`INVERTED`] unless the orientation is
    /// positive for sure.
    pub cosine: f64,
    /// 3 · inradius / circumradius, 0 (flat) to 1 (equilateral).
    pub quality: f64,
}

/// The cosine of an inverted cell: worse than that of any other.
pub(super) const INVERTED: f64 = 2.0;

/// A bound of the determinant's rounding error, over the product of the edges' lengths; a determinant above it has
/// the sign of the exact one. Differences of coordinates are rounded by half an ulp each, products and sums some ten
/// times more; 10⁻¹³ is a hundred times as much.
const ROUNDING: f64 = 1e-13;

/// The shape of the tetrahedron with these corners.
#[inline(always)]
pub(super) fn shape(p: &Point<3>, q: &Point<3>, r: &Point<3>, s: &Point<3>) -> Shape {
    let (u, v, w) = (difference(q, p), difference(r, p), difference(s, p));
    let (a, b, c) = (cross(&v, &w), cross(&w, &u), cross(&u, &v));
    let determinant = dot(&u, &a);
    let (uu, vv, ww) = (dot(&u, &u), dot(&v, &v), dot(&w, &w));
    // false for a NaN too
    let sound = determinant > 0.0 && determinant * determinant > ROUNDING * ROUNDING * uu * vv * ww;
    if !sound {
        return Shape { cosine: INVERTED, quality: 0.0 };
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
    use crate::geometry::linear::invert;
    use proptest::prelude::*;

    /// The same from the gradients of barycentric coordinates, and angles from arc cosines.
    fn twin(p: &[Point<3>; 4]) -> Option<(f64, Shape)> {
        let edges = [1, 2, 3].map(|n| difference(&p[n], &p[0]));
        let (inverse, determinant) = invert(&edges)?;
        let mut gradients = [[0.0; 3]; 4];
        let mut centre = [0.0; 3];
        for n in 0..3 {
            for r in 0..3 {
                gradients[n + 1][r] = inverse[r][n];
                gradients[0][r] -= inverse[r][n];
                centre[r] += 0.5 * dot(&edges[n], &edges[n]) * inverse[r][n];
            }
        }
        let length = |v: &Point<3>| dot(v, v).sqrt();
        let inradius = 1.0 / gradients.iter().map(length).sum::<f64>();
        let mut least = f64::INFINITY;
        for i in 0..4 {
            for j in 0..i {
                let (g, h) = (&gradients[i], &gradients[j]);
                least = least.min((-dot(g, h) / (length(g) * length(h))).clamp(-1.0, 1.0).acos());
            }
        }
        let quality = 3.0 * inradius / length(&centre);
        Some((determinant, Shape { cosine: least.cos(), quality }))
    }

    proptest! {
        #[test]
        fn shape_is_that_of_the_gradients(x in prop::array::uniform12(-1.0..1.0f64)) {
            let p: [Point<3>; 4] = std::array::from_fn(|i| std::array::from_fn(|k| x[3 * i + k]));
            let found = shape(&p[0], &p[1], &p[2], &p[3]);
            let Some((determinant, expected)) = twin(&p) else { return Ok(()) };
            if determinant < 0.0 {
                prop_assert_eq!(found.cosine, INVERTED);
            } else if determinant > 1e-4 {
                // digits are lost as the determinant gets small, four to six of sixteen here
                prop_assert!((found.quality - expected.quality).abs() < 1e-9);
                prop_assert!((found.cosine - expected.cosine).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn flat_and_inverted_cells_are_told() {
        let p = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        assert_eq!(shape(&p[0], &p[1], &p[2], &p[3]).cosine, INVERTED);
        assert_eq!(shape(&p[1], &p[0], &p[2], &p[4]).cosine, INVERTED);
        assert!(shape(&p[0], &p[1], &p[2], &p[4]).cosine < 1.0);
        assert_eq!(shape(&[f64::NAN; 3], &p[1], &p[2], &p[4]).cosine, INVERTED);
    }
}
