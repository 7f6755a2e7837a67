//! Exact signs in fixed-point arithmetic, for points that are near multiples of 2^-60.
//!
//! Where a determinant is exactly zero, as everywhere in a crystal, adaptive floating-point
//! arithmetic is at its slowest; integers of 320 bits are an order of magnitude faster. A double of
//! magnitude 2^-8 to 1 is a multiple of 2^-60, and so are all lattice points but odd ones.

use super::dimension::{Dimension, Simplices};
use crate::geometry::Point;
use std::cmp::Ordering;

/// 2^60: the multiples of its inverse are fixed-point numbers.
const SCALE: f64 = (1_u64 << 60) as f64;

/// An integer of 320 bits in two's complement, the lowest digit first.
pub(super) type Wide = [u64; 5];

/// The vectors from the last point to the others, in units of 2^-60; components below 2^61.
///
/// `None` if a coordinate is no multiple of the unit; none should be above 1 in magnitude.
fn vectors<const D: usize, const N: usize>(
    points: [&Point<D>; N],
    last: &Point<D>,
) -> Option<[[i64; D]; N]> {
    let last = fixed(last)?;
    let mut vectors = [[0; D]; N];
    for (vector, point) in vectors.iter_mut().zip(points) {
        let point = fixed(point)?;
        *vector = std::array::from_fn(|k| point[k] - last[k]);
    }
    Some(vectors)
}

#[inline]
fn fixed<const D: usize>(p: &Point<D>) -> Option<[i64; D]> {
    let units = p.map(|x| (x * SCALE) as i64);
    let exact = (0..D).all(|k| units[k] as f64 == p[k] * SCALE);
    exact.then_some(units)
}

/// The orientation of a cell's corners against zero, or `None` if it needs another arithmetic.
pub(super) fn orientation<const D: usize, const N: usize>(
    corners: [&Point<D>; N],
) -> Option<Ordering>
where
    Simplices: Dimension<D, N>,
{
    let others: [&Point<D>; D] = std::array::from_fn(|k| corners[k]);
    let sign = sign(Simplices::determinant(&vectors(others, corners[D])?));
    // With vectors towards the others and not from the first corner, the sign of a volume turns.
    Some(turned::<D>(sign))
}

/// The in-sphere determinant of a positive cell and `p` against zero, greater inside, or `None` if
/// it needs another arithmetic.
pub(super) fn in_sphere<const D: usize, const N: usize>(
    cell: [&Point<D>; N],
    p: &Point<D>,
) -> Option<Ordering>
where
    Simplices: Dimension<D, N>,
{
    let vectors = vectors(cell, p)?;
    let mut sum = [0; 5];
    for facet in Simplices::FACETS {
        let rows = std::array::from_fn(|k| vectors[facet[k]]);
        add_product(&mut sum, lift(&vectors[facet[D]]), Simplices::determinant(&rows));
    }
    Some(turned::<D>(sign(sum)))
}

/// The opposite sign in an odd dimension.
fn turned<const D: usize>(sign: Ordering) -> Ordering {
    if D % 2 == 1 { sign.reverse() } else { sign }
}

/// The squared length, below 2^124.
fn lift<const D: usize>(v: &[i64; D]) -> Wide {
    let sum: i128 = v.iter().map(|&x| i128::from(x) * i128::from(x)).sum();
    [sum as u64, (sum >> 64) as u64, 0, 0, 0]
}

/// The determinant of two vectors, below 2^124.
pub(super) fn minor(u: [i64; 2], v: [i64; 2]) -> i128 {
    i128::from(u[0]) * i128::from(v[1]) - i128::from(v[0]) * i128::from(u[1])
}

/// The same number with more digits.
pub(super) fn widened(x: i128) -> Wide {
    let fill = (x >> 127) as u64;
    [x as u64, (x >> 64) as u64, fill, fill, fill]
}

/// The determinant of three vectors, below 2^186.
pub(super) fn triple(a: &[i64; 3], b: &[i64; 3], c: &[i64; 3]) -> Wide {
    let minor = |u: &[i64; 3], v: &[i64; 3]| minor([u[0], u[1]], [v[0], v[1]]);
    let (mut low, mut high) = (0_i128, 0_i128);
    for (minor, factor) in [(minor(b, c), a[2]), (minor(c, a), b[2]), (minor(a, b), c[2])] {
        low += i128::from(minor as u64) * i128::from(factor);
        high += (minor >> 64) * i128::from(factor);
    }
    let [middle, upper, fill, ..] = widened(high + (low >> 64));
    [low as u64, middle, upper, fill, fill]
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

    fn near_lattice<const D: usize>() -> impl Strategy<Value = Point<D>> {
        // Coordinates on a coarse lattice, so that zeros are common, some off by one rounding.
        let coordinate = (-4_i8..=4, 0_i8..4).prop_map(|(site, off)| {
            let x = f64::from(site) * 0.1;
            if off == 0 { x + f64::EPSILON / 8.0 } else { x }
        });
        prop::collection::vec(coordinate, D).prop_map(|p| std::array::from_fn(|k| p[k]))
    }

    fn signs_are_those_of_adaptive_arithmetic<const D: usize, const N: usize>(
        corners: [&Point<D>; N],
        p: &Point<D>,
    ) where
        Simplices: Dimension<D, N>,
    {
        let simplex =
            Simplex::<D> { first: *corners[0], others: std::array::from_fn(|k| *corners[k + 1]) };
        if let Some(found) = orientation(corners) {
            assert_eq!(Some(found), simplex.orientation().partial_cmp(&0.0), "{corners:?}");
        }
        if let Some(found) = in_sphere(corners, p) {
            assert_eq!(Some(found), simplex.in_sphere(p).partial_cmp(&0.0), "{corners:?} {p:?}");
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2000))]

        #[test]
        fn signs_in_the_plane_are_those_of_adaptive_arithmetic(
            points in prop::collection::vec(near_lattice::<2>(), 4)
        ) {
            signs_are_those_of_adaptive_arithmetic([0, 1, 2].map(|k| &points[k]), &points[3]);
        }

        #[test]
        fn signs_in_space_are_those_of_adaptive_arithmetic(
            points in prop::collection::vec(near_lattice::<3>(), 5)
        ) {
            signs_are_those_of_adaptive_arithmetic([0, 1, 2, 3].map(|k| &points[k]), &points[4]);
        }
    }

    #[test]
    fn the_largest_coordinates_do_not_overflow() {
        let cell = [[-1.0, -1.0, -1.0], [1.0, 1.0, -1.0], [1.0, -1.0, 1.0], [-1.0, 1.0, 1.0]];
        for p in [[1.0; 3], [-1.0, -1.0, 1.0], [1.0, 1.0, 1.0 - f64::EPSILON], [0.0; 3]] {
            assert!(in_sphere(cell.each_ref(), &p).is_some());
            signs_are_those_of_adaptive_arithmetic(cell.each_ref(), &p);
        }
        let cell = [[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0]];
        for p in [[1.0; 2], [1.0, 1.0 - f64::EPSILON], [0.0; 2]] {
            assert!(in_sphere(cell.each_ref(), &p).is_some());
            signs_are_those_of_adaptive_arithmetic(cell.each_ref(), &p);
        }
    }

    #[test]
    fn what_is_no_multiple_of_the_unit_is_left_to_others() {
        let tiny = [2.0_f64.powi(-61), 0.0, 0.0];
        let points = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        assert_eq!(orientation([&points[0], &points[1], &points[2], &tiny]), None);
    }
}
