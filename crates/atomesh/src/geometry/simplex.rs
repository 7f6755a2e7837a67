//! Segments, triangles and tetrahedra: measure, exact orientation, exact circumsphere test.

use super::{Point, difference, predicates};

/// The simplex of `D + 1` points: a triangle in the plane, a tetrahedron in space.
///
/// One corner stands apart because `D + 1` cannot be written in a type.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Simplex<const D: usize> {
    /// The first corner.
    pub first: Point<D>,
    /// The other corners, in order.
    pub others: [Point<D>; D],
}

impl<const D: usize> Simplex<D> {
    /// The signed area (plane) or volume (space): the determinant of the edges from the first corner
    /// over D!, positive for positive orientation. Rounded: see [`Simplex::orientation`] for a sign
    /// to trust.
    pub fn measure(&self) -> f64 {
        let factorial: f64 = (1..=D).map(|k| k as f64).product();
        determinant(&self.edges()) / factorial
    }

    /// The edges from the first corner to the others.
    pub fn edges(&self) -> [Point<D>; D] {
        std::array::from_fn(|k| difference(&self.others[k], &self.first))
    }

    /// The exact orientation: above 0 if positive, below 0 if negative, 0 if the corners lie on one
    /// line (plane) or plane (space).
    pub fn orientation(&self) -> f64 {
        predicates::orientation(self)
    }

    /// The exact place of `p` against the circumsphere of a simplex of positive orientation: above
    /// 0 inside, 0 on the sphere, below 0 outside. The sign turns with the orientation.
    pub fn in_sphere(&self, p: &Point<D>) -> f64 {
        predicates::in_sphere(self, p)
    }
}

/// The determinant of the matrix with the given rows, by Laplace expansion in a fixed order, without
/// divisions: exact for small integers. D at most 4.
fn determinant<const D: usize>(rows: &[Point<D>; D]) -> f64 {
    const { assert!(D <= 4) };
    // minors[set]: the determinant of the first |set| rows and the columns in `set`.
    let mut minors = [0.0; 16];
    minors[0] = 1.0;
    for set in 1_usize..1 << D {
        let row = &rows[set.count_ones() as usize - 1];
        for k in (0..D).filter(|k| set >> k & 1 == 1) {
            let term = row[k] * minors[set & !(1 << k)];
            // The sign: how many columns of the set lie beyond k.
            let odd = (set >> (k + 1)).count_ones() % 2 == 1;
            minors[set] += if odd { -term } else { term };
        }
    }
    minors[(1 << D) - 1]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn corner<const D: usize>(scale: f64) -> Simplex<D> {
        let others =
            std::array::from_fn(|k| std::array::from_fn(|j| if j == k { scale } else { 0.0 }));
        Simplex { first: [0.0; D], others }
    }

    fn corner_of_a_cube_has_one_part_in_factorial<const D: usize>(parts: f64) {
        let mut simplex = corner::<D>(3.0);
        let expected = 3.0_f64.powi(D as i32) / parts;
        assert_eq!(simplex.measure(), expected);
        assert!(simplex.orientation() > 0.0);
        simplex.others.swap(0, 1);
        assert_eq!(simplex.measure(), -expected);
        assert!(simplex.orientation() < 0.0);
    }

    #[test]
    fn corner_of_a_cube_has_one_part_in_d_factorial() {
        corner_of_a_cube_has_one_part_in_factorial::<2>(2.0);
        corner_of_a_cube_has_one_part_in_factorial::<3>(6.0);
    }

    fn sphere_through_a_cube_corner<const D: usize>() {
        let simplex = corner::<D>(1.0);
        assert_eq!(simplex.in_sphere(&[1.0; D]), 0.0);
        assert!(simplex.in_sphere(&[0.999; D]) > 0.0);
        assert!(simplex.in_sphere(&[1.0 + f64::EPSILON; D]) < 0.0);
    }

    #[test]
    fn sphere_through_a_cube_corner_passes_the_opposite_corner() {
        sphere_through_a_cube_corner::<2>();
        sphere_through_a_cube_corner::<3>();
    }

    #[test]
    fn determinant_of_a_product_is_the_product_of_determinants() {
        let a = [[2.0, 1.0, 3.0], [0.0, -4.0, 5.0], [7.0, 1.0, -2.0]];
        let b = [[1.0, 0.0, 2.0], [3.0, 1.0, -1.0], [-2.0, 6.0, 4.0]];
        let product: [[f64; 3]; 3] = std::array::from_fn(|i| {
            std::array::from_fn(|j| (0..3).map(|k| a[i][k] * b[k][j]).sum())
        });
        // Small integers: every step is exact.
        assert_eq!(determinant(&product), determinant(&a) * determinant(&b));
        assert_eq!(determinant(&a), 125.0);
    }
}
