//! The shape of cells: how near they are to equilateral, and their least angle.
//!
//! Everything follows from the gradients g_i of a cell's barycentric coordinates, which are normal to
//! the facets, point inward and have the length 1/(height over facet i):
//!
//! - inradius: r = 1 / Σ|g_i|, since a point at distance r from every facet has λ_i = r |g_i|;
//! - circumcentre, seen from corner 0: c = ½ Σ |e_i|² g_i, since c · e_i = ½ |e_i|² for each edge e_i;
//! - angle between facets i and j: the angle between g_i and −g_j.
//!
//! So one inverse of a D × D matrix per cell gives all, in any dimension.

use crate::geometry::linear::invert;
use crate::geometry::{Point, dot};

/// The shape of one cell.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CellShape {
    /// Area (2-D) or volume (3-D), negative if the cell is turned over.
    pub measure: f64,
    /// D · inradius / circumradius: 1 if equilateral, 0 if flat.
    pub quality: f64,
    /// The least interior angle (2-D) or dihedral angle (3-D), in degrees; 0 if flat.
    pub least_angle: f64,
}

/// The shape of the simplex with the given edges from its corner 0 to its corners 1…D.
///
/// A simplex without measure, or one so thin that its shape is lost to rounding, has quality 0 and
/// angle 0.
///
/// ```
/// let triangle = atomesh::measure::cell_shape(&[[1.0, 0.0], [0.5, 0.75f64.sqrt()]]);
/// assert!((triangle.quality - 1.0).abs() < 1e-14);
/// assert!((triangle.least_angle - 60.0).abs() < 1e-12);
/// ```
pub fn cell_shape<const D: usize>(edges: &[Point<D>; D]) -> CellShape {
    let Some((inverse, determinant)) = invert(edges) else {
        return CellShape::default();
    };
    let factorial: usize = (1..=D).product();
    let measure = determinant / factorial as f64;

    // column k of the inverse is the gradient of the barycentric coordinate of corner k + 1
    let mut center = [0.0; D];
    let mut first = [0.0; D];
    let mut height_inverse_sum = 0.0;
    let mut normals = [[0.0; D]; D];
    for k in 0..D {
        let gradient: Point<D> = std::array::from_fn(|r| inverse[r][k]);
        let half_squared = 0.5 * dot(&edges[k], &edges[k]);
        for r in 0..D {
            center[r] += half_squared * gradient[r];
            first[r] -= gradient[r];
        }
        let length = dot(&gradient, &gradient).sqrt();
        height_inverse_sum += length;
        normals[k] = gradient.map(|x| x / length);
    }
    let length = dot(&first, &first).sqrt();
    height_inverse_sum += length;
    let first = first.map(|x| x / length);

    let quality = D as f64 / (height_inverse_sum * dot(&center, &center).sqrt());
    let least_angle = least_angle(&first, &normals);
    if quality.is_finite() && least_angle.is_finite() {
        CellShape { measure, quality, least_angle }
    } else {
        CellShape { measure, ..CellShape::default() }
    }
}

/// The least angle between two facets, in degrees, from their unit normals.
fn least_angle<const D: usize>(first: &Point<D>, others: &[Point<D>; D]) -> f64 {
    // two facets meet at the least angle where their inward normals are most opposed
    let (mut a, mut b, mut least_cosine) = (first, first, f64::INFINITY);
    for j in 0..D {
        for i in 0..=j {
            let n = if i == 0 { first } else { &others[i - 1] };
            let cosine = dot(n, &others[j]);
            if cosine < least_cosine {
                (a, b, least_cosine) = (n, &others[j], cosine);
            }
        }
    }
    angle_between(a, b)
}

/// The angle between two facets, in degrees, from their unit normals, both inward.
///
/// The half-angle form (Kahan) keeps its digits near 0°, where the arc cosine loses half of them.
pub(super) fn angle_between<const D: usize>(a: &Point<D>, b: &Point<D>) -> f64 {
    let (mut plus, mut minus) = (0.0, 0.0);
    for k in 0..D {
        plus += (a[k] + b[k]).powi(2);
        minus += (a[k] - b[k]).powi(2);
    }
    2.0 * plus.sqrt().atan2(minus.sqrt()).to_degrees()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{cross, difference};
    use proptest::prelude::*;

    /// Quality and least angle of a triangle from its side lengths alone: Heron and the law of cosines.
    fn triangle_by_sides(p: &[Point<2>; 3]) -> (f64, f64) {
        let side =
            |i: usize, j: usize| dot(&difference(&p[i], &p[j]), &difference(&p[i], &p[j])).sqrt();
        let (a, b, c) = (side(1, 2), side(0, 2), side(0, 1));
        let s = (a + b + c) / 2.0;
        let area = (s * (s - a) * (s - b) * (s - c)).max(0.0).sqrt();
        let angle = |x: f64, y: f64, z: f64| {
            ((y * y + z * z - x * x) / (2.0 * y * z)).clamp(-1.0, 1.0).acos().to_degrees()
        };
        let least = angle(a, b, c).min(angle(b, a, c)).min(angle(c, a, b));
        (2.0 * (area / s) / (a * b * c / (4.0 * area)), least)
    }

    /// The same of a tetrahedron from cross products and the product of opposite edges.
    fn tetrahedron_by_faces(p: &[Point<3>; 4]) -> (f64, f64) {
        let edge = |i: usize, j: usize| difference(&p[j], &p[i]);
        let length = |v: Point<3>| dot(&v, &v).sqrt();
        let normals = [(1, 2, 3), (0, 3, 2), (0, 1, 3), (0, 2, 1)]
            .map(|(i, j, k)| cross(&edge(i, j), &edge(i, k)));
        let volume = dot(&cross(&edge(0, 1), &edge(0, 2)), &edge(0, 3)).abs() / 6.0;
        let area: f64 = normals.iter().map(|&n| length(n) / 2.0).sum();
        let [x, y, z] = [[0, 1, 2, 3], [0, 2, 1, 3], [0, 3, 1, 2]]
            .map(|[i, j, k, l]| length(edge(i, j)) * length(edge(k, l)));
        let s = (x + y + z) / 2.0;
        let radius = (s * (s - x) * (s - y) * (s - z)).max(0.0).sqrt() / (6.0 * volume);
        let mut least = f64::INFINITY;
        for i in 0..4 {
            for j in i + 1..4 {
                let cosine =
                    dot(&normals[i], &normals[j]) / (length(normals[i]) * length(normals[j]));
                least = least.min(180.0 - cosine.clamp(-1.0, 1.0).acos().to_degrees());
            }
        }
        (3.0 * (3.0 * volume / area) / radius, least)
    }

    fn edges<const D: usize>(corners: &[Point<D>]) -> [Point<D>; D] {
        std::array::from_fn(|k| difference(&corners[k + 1], &corners[0]))
    }

    fn agrees(shape: CellShape, expected: (f64, f64)) {
        let (quality, angle) = expected;
        // the twins subtract nearly equal lengths and lose half the digits of thin cells
        if shape.quality > 1e-3 {
            assert!((shape.quality / quality - 1.0).abs() < 1e-7, "{shape:?} {quality}");
            assert!((shape.least_angle - angle).abs() < 1e-5, "{shape:?} {angle}");
        }
    }

    proptest! {
        #[test]
        fn gradients_agree_with_lengths_and_cross_products(
            two in prop::array::uniform3(prop::array::uniform2(-1.0..1.0f64)),
            three in prop::array::uniform4(prop::array::uniform3(-1.0..1.0f64)),
        ) {
            agrees(cell_shape(&edges(&two)), triangle_by_sides(&two));
            agrees(cell_shape(&edges(&three)), tetrahedron_by_faces(&three));
        }

        #[test]
        fn shape_does_not_depend_on_scale_or_corner(
            p in prop::array::uniform4(prop::array::uniform3(-1.0..1.0f64)),
            power in -30i32..30,
        ) {
            let shape = cell_shape(&edges(&p));
            prop_assume!(shape.quality > 1e-3);
            // powers of two scale without rounding
            let scaled = cell_shape(&edges(&p.map(|x| x.map(|x| x * 2f64.powi(power)))));
            prop_assert!((shape.quality - scaled.quality).abs() < 1e-14);
            let turned = cell_shape(&edges(&[p[1], p[2], p[3], p[0]]));
            prop_assert!((shape.quality / turned.quality - 1.0).abs() < 1e-9);
            prop_assert!((shape.least_angle - turned.least_angle).abs() < 1e-7);
            prop_assert!((shape.measure + turned.measure).abs() < 1e-14);
        }
    }

    #[test]
    fn regular_simplices_are_perfect() {
        let t = cell_shape(&[[1.0, 1.0, 0.0], [0.0, 1.0, 1.0], [1.0, 0.0, 1.0]]);
        assert!((t.quality - 1.0).abs() < 1e-14);
        assert!((t.least_angle - (1.0f64 / 3.0).acos().to_degrees()).abs() < 1e-12);
        assert!((t.measure.abs() - 1.0 / 3.0).abs() < 1e-15);
    }

    #[test]
    fn a_right_corner_has_known_angles_and_quality() {
        // corner of a cube: r = 1/(3 + √3), R = √3/2, least dihedral angle acos(1/√3)
        let t = cell_shape(&[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
        let root = 3f64.sqrt();
        assert!((t.quality - 3.0 / (3.0 + root) / (root / 2.0)).abs() < 1e-14);
        assert!((t.least_angle - (1.0 / root).acos().to_degrees()).abs() < 1e-12);
        assert!((t.measure - 1.0 / 6.0).abs() < 1e-16);
    }

    #[test]
    fn small_angles_keep_their_digits() {
        let angle = 1e-6f64;
        let t = cell_shape(&[[1.0, 0.0], [angle.cos(), angle.sin()]]);
        assert!((t.least_angle / angle.to_degrees() - 1.0).abs() < 1e-9);
    }
}
