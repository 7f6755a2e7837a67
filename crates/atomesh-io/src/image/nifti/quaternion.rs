//! Rotations as NIfTI keeps them: three parts of a unit quaternion, and the sign of the z axis.

use atomesh::geometry::dot;

use super::super::affine::wrong;
use super::super::error::ReadReason;
use super::FORMAT;

/// The rotation of the unit quaternion (√(1 − b² − c² − d²), b, c, d), as the format defines it.
///
/// # Errors
/// If b² + c² + d² is not finite or exceeds 1 by more than single precision explains.
pub(in super::super) fn rotation(quaternion: [f64; 3]) -> Result<[[f64; 3]; 3], ReadReason> {
    let squared = dot(&quaternion, &quaternion);
    if squared.is_nan() || squared > 1.0 + 1e-5 {
        let value = format!("{quaternion:?}");
        let expected = "numbers whose squares add up to at most 1";
        return Err(wrong(FORMAT, "quatern_b, c, d", value, expected));
    }
    let scale = if squared > 1.0 { squared.sqrt().recip() } else { 1.0 };
    let [b, c, d] = quaternion.map(|q| q * scale);
    let a = (1.0 - dot(&[b, c, d], &[b, c, d])).max(0.0).sqrt();
    Ok([
        [a * a + b * b - c * c - d * d, 2.0 * (b * c - a * d), 2.0 * (b * d + a * c)],
        [2.0 * (b * c + a * d), a * a + c * c - b * b - d * d, 2.0 * (c * d - a * b)],
        [2.0 * (b * d - a * c), 2.0 * (c * d + a * b), a * a + d * d - b * b - c * c],
    ])
}

/// The quaternion (b, c, d) of a frame's direction and qfac, −1 if its z axis is mirrored.
pub(super) fn quaternion(direction: [[f64; 3]; 3], is_mirrored: bool) -> ([f64; 3], f64) {
    let mut m = direction;
    let qfac = if is_mirrored { -1.0 } else { 1.0 };
    m.iter_mut().for_each(|row| row[2] *= qfac);

    // the largest of the four components is found first and divides the others
    let trace = m[0][0] + m[1][1] + m[2][2];
    let quarters = [trace, m[0][0], m[1][1], m[2][2]];
    let largest = (1..4).fold(0, |best, k| if quarters[k] > quarters[best] { k } else { best });
    let [a, b, c, d] = match largest {
        0 => [1.0 + trace, m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1]],
        1 => [m[2][1] - m[1][2], 1.0 + 2.0 * m[0][0] - trace, m[0][1] + m[1][0], m[0][2] + m[2][0]],
        2 => [m[0][2] - m[2][0], m[0][1] + m[1][0], 1.0 + 2.0 * m[1][1] - trace, m[1][2] + m[2][1]],
        _ => [m[1][0] - m[0][1], m[0][2] + m[2][0], m[1][2] + m[2][1], 1.0 + 2.0 * m[2][2] - trace],
    };
    let norm = (a * a + b * b + c * c + d * d).sqrt();
    let sign = if a < 0.0 { -1.0 } else { 1.0 }; // the format has no room for a negative a
    ([b, c, d].map(|q| sign * q / norm), qfac)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn quarter_turns_are_exact() {
        // about z: x goes to y
        let half = 0.5f64.sqrt();
        let r = rotation([0.0, 0.0, half]).unwrap();
        let expected = [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]];
        for (row, wanted) in r.iter().zip(expected) {
            for (x, w) in row.iter().zip(wanted) {
                assert!((x - w).abs() < 1e-15, "{r:?}");
            }
        }
    }

    #[test]
    fn impossible_quaternions_are_refused_and_rounded_ones_taken() {
        assert!(rotation([1.0, 0.1, 0.0]).is_err());
        assert!(rotation([f64::NAN, 0.0, 0.0]).is_err());
        assert!(rotation([f64::INFINITY, 0.0, 0.0]).is_err());
        let turned = rotation([1.000_001, 0.0, 0.0]).unwrap();
        assert_eq!(turned, [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]]);
    }

    proptest! {
        /// Any rotation or reflection goes through the quaternion and back. Tolerance: a few
        /// roundings; where a is small it is √ of a difference, whence √ε.
        #[test]
        fn directions_survive_the_quaternion(
            q in prop::array::uniform4(-1.0f64..1.0), mirrored: bool,
        ) {
            let norm = q.iter().map(|x| x * x).sum::<f64>().sqrt();
            prop_assume!(norm > 0.1);
            let sign = if q[3] < 0.0 { -1.0 } else { 1.0 };
            let mut direction =
                rotation([q[0], q[1], q[2]].map(|x| sign * x / norm)).unwrap();
            if mirrored {
                direction.iter_mut().for_each(|row| row[1] = -row[1]);
            }
            let (quaternion, qfac) = quaternion(direction, mirrored);
            let mut back = rotation(quaternion).unwrap();
            back.iter_mut().for_each(|row| row[2] *= qfac);
            for r in 0..3 {
                for c in 0..3 {
                    prop_assert!((back[r][c] - direction[r][c]).abs() < 1e-7);
                }
            }
        }
    }
}
