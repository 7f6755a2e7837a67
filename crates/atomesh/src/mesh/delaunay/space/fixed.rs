//! Exact signs in fixed-point arithmetic, for points that are near multiples of 2^-60.
//!
//! Where a determinant is exactly zero, as everywhere in a crystal, adaptive floating-point
//! arithmetic is at its slowest; integers of 320 bits are an order of magnitude faster. A double of
//! magnitude 2^-8 to 1 is a multiple of 2^-60, and so are all lattice points but odd ones.

use crate::geometry::Point;
use std::cmp::Ordering;

/// 2^60: the multiples of its inverse are fixed-point numbers.
const SCALE: f64 = (1_u64 << 60) as f64;

/// An integer of 320 bits in two's complement, the lowest digit first.
type Wide = [u64; 5];

/// The vectors from the last point to the others, in units of 2^-60; components below 2^61.
///
/// `None` if a coordinate is no multiple of the unit; none should be above 1 in magnitude.
fn vectors<const N: usize>(points: [&Point<3>; N], last: &Point<3>) -> Option<[[i64; 3]; N]> {
    let last = fixed(last)?;
    let mut vectors = [[0; 3]; N];
    for (vector, point) in vectors.iter_mut().zip(points) {
        let point = fixed(point)?;
        *vector = [point[0] - last[0], point[1] - last[1], point[2] - last[2]];
    }
    Some(vectors)
}

#[inline]
fn fixed(p: &Point<3>) -> Option<[i64; 3]> {
    let units = p.map(|x| (x * SCALE) as i64);
    let exact = (0..3).all(|k| units[k] as f64 == p[k] * SCALE);
    exact.then_some(units)
}

/// The orientation of a, b, c, d against zero, or `None` if it needs another arithmetic.
pub(super) fn orientation([a, b, c, d]: [&Point<3>; 4]) -> Option<Ordering> {
    let [a, b, c] = vectors([a, b, c], d)?;
    // With vectors towards the others and not from the first corner, the sign turns.
    Some(sign(triple(&c, &b, &a)))
}

/// The in-sphere determinant of a positive cell and `p` against zero, greater inside, or `None` if
/// it needs another arithmetic.
pub(super) fn in_sphere(cell: [&Point<3>; 4], p: &Point<3>) -> Option<Ordering> {
    let [a, b, c, d] = vectors(cell, p)?;
    let mut sum = [0; 5];
    add_product(&mut sum, lift(&a), triple(&b, &c, &d));
    add_product(&mut sum, lift(&b), triple(&a, &d, &c));
    add_product(&mut sum, lift(&c), triple(&a, &b, &d));
    add_product(&mut sum, lift(&d), triple(&a, &c, &b));
    Some(sign(sum))
}

/// The squared length, below 2^124.
fn lift(v: &[i64; 3]) -> Wide {
    let square = |x: i64| i128::from(x) * i128::from(x);
    let sum = square(v[0]) + square(v[1]) + square(v[2]);
    [sum as u64, (sum >> 64) as u64, 0, 0, 0]
}

/// The determinant of three vectors, below 2^186.
fn triple(a: &[i64; 3], b: &[i64; 3], c: &[i64; 3]) -> Wide {
    let minor = |u: &[i64; 3], v: &[i64; 3]| {
        i128::from(u[0]) * i128::from(v[1]) - i128::from(v[0]) * i128::from(u[1])
    };
    let (mut low, mut high) = (0_i128, 0_i128);
    for (minor, factor) in [(minor(b, c), a[2]), (minor(c, a), b[2]), (minor(a, b), c[2])] {
        low += i128::from(minor as u64) * i128::from(factor);
        high += (minor >> 64) * i128::from(factor);
    }
    high += low >> 64;
    let fill = (high >> 127) as u64;
    [low as u64, high as u64, (high >> 64) as u64, fill, fill]
}

/// Adds the product, modulo 2^320: two's complement needs no signs.
fn add_product(sum: &mut Wide, a: Wide, b: Wide) {
    for i in 0..2 {
        let mut carry = 0;
        for j in 0..5 - i {
            let digit = u128::from(a[i]) * u128::from(b[j]) + u128::from(sum[i + j]) + carry;
            sum[i + j] = digit as u64;
            carry = digit >> 64;
        }
    }
}

fn sign(wide: Wide) -> Ordering {
    let any = wide.iter().fold(0, |any, digit| any | digit);
    if any == 0 { Ordering::Equal } else { (wide[4] as i64).cmp(&0).then(Ordering::Greater) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Simplex;
    use proptest::prelude::*;

    fn near_lattice() -> impl Strategy<Value = Point<3>> {
        // Coordinates on a coarse lattice, so that zeros are common, some off by one rounding.
        let coordinate = (-4_i8..=4, 0_i8..4).prop_map(|(site, off)| {
            let x = f64::from(site) * 0.1;
            if off == 0 { x + f64::EPSILON / 8.0 } else { x }
        });
        [coordinate.clone(), coordinate.clone(), coordinate]
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2000))]

        #[test]
        fn signs_are_those_of_adaptive_arithmetic(points in [
            near_lattice(), near_lattice(), near_lattice(), near_lattice(), near_lattice()
        ]) {
            let [a, b, c, d, p] = &points;
            let simplex = Simplex { first: *a, others: [*b, *c, *d] };
            if let Some(found) = orientation([a, b, c, d]) {
                prop_assert_eq!(Some(found), simplex.orientation().partial_cmp(&0.0));
            }
            if let Some(found) = in_sphere([a, b, c, d], p) {
                prop_assert_eq!(Some(found), simplex.in_sphere(p).partial_cmp(&0.0));
            }
        }
    }

    #[test]
    fn the_largest_coordinates_do_not_overflow() {
        let cell = [[-1.0, -1.0, -1.0], [1.0, 1.0, -1.0], [1.0, -1.0, 1.0], [-1.0, 1.0, 1.0]];
        let simplex = Simplex { first: cell[0], others: [cell[1], cell[2], cell[3]] };
        let [a, b, c, d] = &cell;
        for p in [[1.0; 3], [-1.0, -1.0, 1.0], [1.0, 1.0, 1.0 - f64::EPSILON], [0.0; 3]] {
            let expected = simplex.in_sphere(&p).partial_cmp(&0.0);
            assert_eq!(in_sphere([a, b, c, d], &p), expected, "{p:?}");
        }
        assert_eq!(orientation([a, b, c, d]), simplex.orientation().partial_cmp(&0.0));
    }

    #[test]
    fn what_is_no_multiple_of_the_unit_is_left_to_others() {
        let tiny = [2.0_f64.powi(-61), 0.0, 0.0];
        let points = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        assert_eq!(orientation([&points[0], &points[1], &points[2], &tiny]), None);
    }
}
