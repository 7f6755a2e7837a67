//! Linear equations and eigenvectors of a size that fits in registers.

use super::{cross, dot};

/// A square matrix, row by row; only the leading part is used where a function says so.
pub(crate) type Matrix<const D: usize> = [[f64; D]; D];

/// Solves `matrix · x = right` for several right sides by elimination with row pivots.
///
/// Uses the leading `size` rows and columns of `matrix` and rows of `right`; the solution replaces
/// `right`. Returns the determinant of the leading part; if it is zero `right` is left unsolved.
pub(crate) fn solve<const D: usize, const N: usize>(
    size: usize,
    mut matrix: Matrix<D>,
    right: &mut [[f64; N]; D],
) -> f64 {
    let mut determinant = 1.0;
    for c in 0..size {
        let mut pivot = c;
        for r in c + 1..size {
            if matrix[r][c].abs() > matrix[pivot][c].abs() {
                pivot = r;
            }
        }
        if pivot != c {
            matrix.swap(pivot, c);
            right.swap(pivot, c);
            determinant = -determinant;
        }
        determinant *= matrix[c][c];
        if determinant == 0.0 {
            return 0.0;
        }
        for r in c + 1..size {
            let factor = matrix[r][c] / matrix[c][c];
            for k in c + 1..size {
                matrix[r][k] -= factor * matrix[c][k];
            }
            for k in 0..N {
                right[r][k] -= factor * right[c][k];
            }
        }
    }
    for c in (0..size).rev() {
        for k in 0..N {
            let mut sum = right[c][k];
            for j in c + 1..size {
                sum -= matrix[c][j] * right[j][k];
            }
            right[c][k] = sum / matrix[c][c];
        }
    }
    determinant
}

/// The inverse and the determinant; `None` if the determinant is zero.
pub(crate) fn invert<const D: usize>(matrix: &Matrix<D>) -> Option<(Matrix<D>, f64)> {
    let mut inverse = identity();
    let determinant = solve(D, *matrix, &mut inverse);
    (determinant != 0.0).then_some((inverse, determinant))
}

/// Ones on the diagonal, zeros elsewhere.
fn identity<const D: usize>() -> Matrix<D> {
    std::array::from_fn(|r| std::array::from_fn(|c| if r == c { 1.0 } else { 0.0 }))
}

/// The largest eigenvalue of a symmetric matrix and its unit eigenvector, by cyclic Jacobi rotations.
///
/// Converges quadratically: three or four sweeps for D = 3, one for D = 2. Accurate for equal and
/// for tiny eigenvalues, where closed forms are not.
pub(crate) fn largest_eigenpair<const D: usize>(mut a: Matrix<D>) -> (f64, [f64; D]) {
    const SWEEP_LIMIT: usize = 16;
    let mut v = identity::<D>();
    for _ in 0..SWEEP_LIMIT {
        let (mut off, mut diagonal) = (0.0, 0.0);
        for r in 0..D {
            diagonal += a[r][r] * a[r][r];
            for c in r + 1..D {
                off += a[r][c] * a[r][c];
            }
        }
        // below this the next rotation would change nothing in double precision
        if off <= 1e-32 * diagonal || off == 0.0 {
            break;
        }
        for p in 0..D {
            for q in p + 1..D {
                rotate(&mut a, &mut v, p, q);
            }
        }
    }
    let largest = (1..D).fold(0, |best, k| if a[k][k] > a[best][best] { k } else { best });
    (a[largest][largest], std::array::from_fn(|r| v[r][largest]))
}

/// The unit eigenvector of the largest eigenvalue, to single precision: in space in closed form (Smith 1961), in a third of
/// the time, unless two eigenvalues are so near each other that this loses digits.
pub(crate) fn largest_eigenvector<const D: usize>(a: Matrix<D>) -> [f64; D] {
    let in_closed_form = if D == 3 { separate_eigenvector(&a) } else { None };
    in_closed_form.unwrap_or_else(|| largest_eigenpair(a).1)
}

/// See [`largest_eigenvector`]; of a matrix of three rows. `None` where the eigenvalue is nearly double.
fn separate_eigenvector<const D: usize>(a: &Matrix<D>) -> Option<[f64; D]> {
    /// The least product of the largest eigenvalue's distances from the others, over that of the spread of all.
    const SEPARATE: f64 = 1e-3;
    let mean = (a[0][0] + a[1][1] + a[2][2]) / 3.0;
    let [x, y, z] = [a[0][0] - mean, a[1][1] - mean, a[2][2] - mean];
    let [xy, xz, yz] = [a[0][1], a[0][2], a[1][2]];
    let squares = x * x + y * y + z * z + 2.0 * (xy * xy + xz * xz + yz * yz);
    let spread = (squares / 6.0).sqrt();
    let determinant = x * (y * z - yz * yz) - xy * (xy * z - yz * xz) + xz * (xy * yz - y * xz);
    let cosine = 0.5 * determinant / (spread * squares / 6.0);
    let largest = 2.0 * spread * (cosine.clamp(-1.0, 1.0).acos() / 3.0).cos();
    let rows = [[x - largest, xy, xz], [xy, y - largest, yz], [xz, yz, z - largest]];
    let mut best = ([0.0; 3], 0.0);
    for (r, s) in [(0, 1), (0, 2), (1, 2)] {
        let product = cross(&rows[r], &rows[s]);
        let squared = dot(&product, &product);
        best = if squared > best.1 { (product, squared) } else { best };
    }
    let length = best.1.sqrt();
    // false for a multiple of the identity, of which all is 0 or not a number
    let is_separate = length > SEPARATE * squares;
    is_separate.then(|| std::array::from_fn(|k| best.0[k] / length))
}

/// One Jacobi rotation: makes `a[p][q]` zero and turns the columns of `v` along.
fn rotate<const D: usize>(a: &mut Matrix<D>, v: &mut Matrix<D>, p: usize, q: usize) {
    if a[p][q] == 0.0 {
        return;
    }
    let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
    let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
    let c = 1.0 / (t * t + 1.0).sqrt();
    let s = t * c;
    for k in 0..D {
        (a[k][p], a[k][q]) = (c * a[k][p] - s * a[k][q], s * a[k][p] + c * a[k][q]);
    }
    for k in 0..D {
        (a[p][k], a[q][k]) = (c * a[p][k] - s * a[q][k], s * a[p][k] + c * a[q][k]);
        (v[k][p], v[k][q]) = (c * v[k][p] - s * v[k][q], s * v[k][p] + c * v[k][q]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn inverse_times_matrix_is_identity<const D: usize>(rows: Matrix<D>) {
        let Some((inverse, determinant)) = invert(&rows) else { return };
        // the error of elimination grows with the condition number; skip what is nearly singular
        if determinant.abs() < 1e-3 {
            return;
        }
        for r in 0..D {
            for c in 0..D {
                let sum: f64 = (0..D).map(|k| inverse[r][k] * rows[k][c]).sum();
                let expected = if r == c { 1.0 } else { 0.0 };
                assert!((sum - expected).abs() < 1e-9, "{rows:?}: {sum} at {r}, {c}");
            }
        }
    }

    /// A v = λ v, |v| = 1, and λ is not below the Rayleigh quotient of any axis.
    fn eigenpair_is_the_largest<const D: usize>(rows: Matrix<D>) {
        let a: Matrix<D> =
            std::array::from_fn(|r| std::array::from_fn(|c| rows[r.min(c)][r.max(c)]));
        let (value, vector) = largest_eigenpair(a);
        let norm: f64 = vector.iter().map(|x| x * x).sum();
        assert!((norm - 1.0).abs() < 1e-14);
        for r in 0..D {
            let product: f64 = (0..D).map(|c| a[r][c] * vector[c]).sum();
            // entries are at most 2, and Jacobi is backward stable to a few units in the last place
            assert!((product - value * vector[r]).abs() < 1e-13, "{a:?}");
            assert!(value >= a[r][r] - 1e-13, "{a:?}: {value}");
        }
    }

    proptest! {
        #[test]
        fn the_quick_eigenvector_is_the_same_to_single_precision(
            rows in prop::array::uniform3(prop::array::uniform3(-2.0..2.0f64)),
            squeeze in 0.0..1.0f64,
        ) {
            // from a general matrix to one of which two axes are nearly alike
            let factor = 10f64.powf(-6.0 * squeeze);
            let a: Matrix<3> = std::array::from_fn(|r| {
                std::array::from_fn(|c| {
                    let own = if r == c { 1.0 } else { 0.0 };
                    own + factor * rows[r.min(c)][r.max(c)]
                })
            });
            let (quick, exact) = (largest_eigenvector(a), largest_eigenpair(a).1);
            let along: f64 = (0..3).map(|k| quick[k] * exact[k]).sum();
            // an error e of a unit vector takes e²/2 of the cosine
            prop_assert!(1.0 - along.abs() < 1e-13, "{} {:?} {:?}", along, quick, exact);
        }

        #[test]
        fn solves_and_diagonalises(
            two in prop::array::uniform2(prop::array::uniform2(-2.0..2.0f64)),
            three in prop::array::uniform3(prop::array::uniform3(-2.0..2.0f64)),
        ) {
            inverse_times_matrix_is_identity(two);
            inverse_times_matrix_is_identity(three);
            eigenpair_is_the_largest(two);
            eigenpair_is_the_largest(three);
        }
    }

    #[test]
    fn a_singular_matrix_has_no_inverse() {
        assert!(invert(&[[1.0, 2.0], [2.0, 4.0]]).is_none());
        assert!(invert(&[[0.0; 3]; 3]).is_none());
    }

    #[test]
    fn equal_and_zero_eigenvalues_are_no_trouble() {
        assert_eq!(largest_eigenpair([[0.0; 3]; 3]).0, 0.0);
        assert_eq!(largest_eigenvector([[0.0; 3]; 3]), [1.0, 0.0, 0.0]);
        assert_eq!(largest_eigenpair([[2.0, 0.0], [0.0, 2.0]]).0, 2.0);
        // n nᵀ has the eigenvalue 1 along n and 0 twice
        let n = [1.0 / 3.0, -2.0 / 3.0, 2.0 / 3.0];
        let (value, vector) =
            largest_eigenpair::<3>(std::array::from_fn(|r| std::array::from_fn(|c| n[r] * n[c])));
        assert!((value - 1.0).abs() < 1e-15);
        let along: f64 = (0..3).map(|k| n[k] * vector[k]).sum();
        assert!((along.abs() - 1.0).abs() < 1e-15);
    }
}
