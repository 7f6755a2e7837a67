//! The leading eigenvector of a structure tensor: the normal of what is layered.

use crate::geometry::linear::{Matrix, largest_eigenpair};
use crate::geometry::{cross, dot};

/// The leading eigenvector of a tensor, and how much it leads; see [`StructureTensor::normal`](super::StructureTensor).
pub(super) fn normal<const D: usize>(tensor: &Matrix<D>) -> ([f32; D], f32) {
    let (mut trace, mut squares) = (0.0, 0.0);
    for a in 0..D {
        trace += tensor[a][a];
        for b in 0..D {
            squares += tensor[a][b] * tensor[a][b];
        }
    }
    if trace <= 0.0 {
        return (std::array::from_fn(|k| if k == D - 1 { 1.0 } else { 0.0 }), 0.0);
    }
    let (largest, normal) = leading(tensor, trace);
    // the others are known by their sum and the sum of their squares
    let (sum, squares) = (trace - largest, (squares - largest * largest).max(0.0));
    let second = match D {
        2 => sum,
        _ => 0.5 * (sum + (2.0 * squares - sum * sum).max(0.0).sqrt()),
    };
    let planar = (1.0 - second / largest).clamp(0.0, 1.0);
    let last = normal.iter().rev().find(|&&n| n as f32 != 0.0);
    let sign = if last.is_some_and(|&n| n < 0.0) { -1.0 } else { 1.0 };
    (normal.map(|n| (sign * n) as f32 + 0.0), planar as f32) // no −0
}

/// The least length of a cross product of rows that gives the direction of an eigenvector, over the squared trace.
const LEAST_CROSS: f64 = 1e-4;

/// The most Newton steps for the largest eigenvalue; six are enough where it is not nearly equal to the next.
const STEPS: usize = 12;

/// The largest eigenvalue of a positive semidefinite matrix and its unit eigenvector.
///
/// In closed form for D = 2, from the characteristic polynomial for D = 3, several times faster than by rotations. These
/// are used where eigenvalues are nearly equal.
fn leading<const D: usize>(a: &Matrix<D>, trace: f64) -> (f64, [f64; D]) {
    let mut vector = [0.0; D];
    let largest = if D == 2 {
        let half = 0.5 * (a[0][0] - a[1][1]);
        let root = half.hypot(a[0][1]);
        // of two equal vectors the one that does not cancel
        (vector[0], vector[1]) =
            if half > 0.0 { (half + root, a[0][1]) } else { (a[0][1], root - half) };
        0.5 * trace + root
    } else if D == 3 {
        let largest = largest_root(a, trace);
        let minus = |r: usize| [0, 1, 2].map(|c| a[r][c] - if r == c { largest } else { 0.0 });
        let rows = [minus(0), minus(1), minus(2)];
        let crosses = [(0, 1), (0, 2), (1, 2)].map(|(r, s)| cross(&rows[r], &rows[s]));
        let longest = crosses
            .iter()
            .fold(&crosses[0], |best, c| if dot(c, c) > dot(best, best) { c } else { best });
        if dot(longest, longest).sqrt() > LEAST_CROSS * trace * trace {
            vector.copy_from_slice(longest);
        }
        largest
    } else {
        0.0
    };
    let norm = dot(&vector, &vector).sqrt();
    if norm > 0.0 { (largest, vector.map(|v| v / norm)) } else { largest_eigenpair(*a) }
}

/// The largest root of the characteristic polynomial of a positive semidefinite 3 × 3 matrix, by Newton's method from
/// above, where the polynomial is convex, so that steps never pass the root.
fn largest_root<const D: usize>(a: &Matrix<D>, trace: f64) -> f64 {
    let minor = |r: usize, s: usize| a[r][r] * a[s][s] - a[r][s] * a[r][s];
    let minors = minor(0, 1) + minor(0, 2) + minor(1, 2);
    let determinant = a[0][0] * minor(1, 2) - a[0][1] * (a[0][1] * a[2][2] - a[1][2] * a[0][2])
        + a[0][2] * (a[0][1] * a[1][2] - a[1][1] * a[0][2]);
    // the norm is no less than the root, and near it for one large eigenvalue
    let mut root = (trace * trace - 2.0 * minors).max(0.0).sqrt();
    for _ in 0..STEPS {
        let value = ((root - trace) * root + minors) * root - determinant;
        let slope = (3.0 * root - 2.0 * trace) * root + minors;
        let step = if slope > 0.0 { value / slope } else { 0.0 };
        root -= step;
        if step <= 1e-15 * trace {
            break;
        }
    }
    root
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    fn leads_as_rotations_say<const D: usize>() {
        let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(3);
        for flat in [1.0, 0.1, 1e-3, 1e-9, 0.0] {
            for _ in 0..200 {
                // a sum of products of vectors, ever nearer to one direction
                let vectors: [[f64; D]; D] = std::array::from_fn(|v| {
                    let scale = if v == 0 { 1.0 } else { flat };
                    std::array::from_fn(|_| scale * (random.random::<f64>() - 0.5))
                });
                let a: Matrix<D> = std::array::from_fn(|r| {
                    std::array::from_fn(|c| vectors.iter().map(|v| v[r] * v[c]).sum())
                });
                let trace = (0..D).map(|k| a[k][k]).sum();
                let (fast, slow) = (leading(&a, trace), largest_eigenpair(a));
                assert!((fast.0 - slow.0).abs() < 1e-10 * trace, "{} {}", fast.0, slow.0);
                let cosine = dot(&fast.1, &slow.1).abs();
                // rounding over the least gap that cross products are taken for
                assert!(cosine > 1.0 - 1e-9, "{cosine} of {a:?}");
            }
        }
    }

    #[test]
    fn closed_forms_of_eigenvectors_are_those_of_rotations() {
        leads_as_rotations_say::<2>();
        leads_as_rotations_say::<3>();
    }

    #[test]
    fn equal_eigenvalues_have_some_unit_vector() {
        for diagonal in [[1.0, 1.0, 1.0], [2.0, 2.0, 1.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0]] {
            let a = std::array::from_fn(|r| {
                std::array::from_fn(|c| if r == c { diagonal[r] } else { 0.0 })
            });
            let (value, vector) = leading::<3>(&a, diagonal.iter().sum());
            assert!(
                (value - diagonal[0]).abs() < 1e-6 && (dot(&vector, &vector) - 1.0).abs() < 1e-12
            );
        }
        let (value, vector) = leading::<2>(&[[1.0, 0.0], [0.0, 1.0]], 2.0);
        assert!((value - 1.0).abs() < 1e-12 && (dot(&vector, &vector) - 1.0).abs() < 1e-12);
    }
}
