//! From a caller's points to points fit for exact arithmetic, along a Hilbert curve.

use super::{ConnectError, MOST_POINTS};
use crate::geometry::{Point, hilbert_order, lexicographic};
use crate::parallel::prelude::*;
use std::cmp::Ordering;

/// Products of five coordinates of this magnitude, and their rounding errors, do not underflow.
const LEAST_MAGNITUDE: f64 = 1.0 / (1_u128 << 70) as f64 / (1_u128 << 70) as f64;

/// Distinct, finite points of magnitude 1 in Hilbert order.
pub(super) struct Prepared<const D: usize> {
    /// The points scaled by a power of two, the largest coordinate between 1/2 and 1.
    pub points: Vec<Point<D>>,
    /// The caller's index of each.
    pub order: Vec<u32>,
}

impl<const D: usize> Prepared<D> {
    /// Checks, scales and orders the points.
    pub fn new(points: &[Point<D>]) -> Result<Self, ConnectError> {
        let count = points.len();
        if count <= D {
            return Err(ConnectError::TooFew { count, least: D + 1 });
        }
        if count > MOST_POINTS {
            return Err(ConnectError::TooMany { count, most: MOST_POINTS });
        }
        let scaled = scale(points)?;
        let order = hilbert_order(&scaled);
        let points: Vec<Point<D>> = order.par_iter().map(|&i| scaled[i as usize]).collect();
        let pairs = points.par_iter().zip(&points[1..]);
        let equal_pair = pairs.position_first(|(one, next)| equal(one, next));
        if let Some(at) = equal_pair {
            let pair = [order[at] as usize, order[at + 1] as usize];
            return Err(ConnectError::Duplicate { first: pair[0], second: pair[1] });
        }
        Ok(Self { points, order })
    }
}

/// Divides by the power of two next above the largest magnitude, which is exact.
fn scale<const D: usize>(points: &[Point<D>]) -> Result<Vec<Point<D>>, ConnectError> {
    if let Some(point) = points.par_iter().position_first(|p| !p.iter().all(|x| x.is_finite())) {
        let axis = points[point].iter().position(|x| !x.is_finite()).unwrap_or(0);
        return Err(ConnectError::Coordinate { point, axis, value: points[point][axis] });
    }
    let largest = |p: &Point<D>| p.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    let (up, down) = power_of_two_near(points.par_iter().map(largest).reduce(|| 0.0, f64::max));
    let scaled: Vec<Point<D>> = points.par_iter().map(|p| p.map(|x| x * up * down)).collect();
    let is_tiny = |(x, scaled): (&f64, &f64)| *x != 0.0 && scaled.abs() < LEAST_MAGNITUDE;
    let tiny = |(p, q): (&Point<D>, &Point<D>)| p.iter().zip(q).position(is_tiny);
    let found =
        points.par_iter().zip(&scaled).map(tiny).enumerate().find_first(|at| at.1.is_some());
    match found {
        Some((point, Some(axis))) => {
            let least = LEAST_MAGNITUDE / up / down;
            Err(ConnectError::TooSmall { point, axis, value: points[point][axis], least })
        }
        _ => Ok(scaled),
    }
}

/// Two powers of two whose product brings `most` to between 1/2 and 2; one alone could overflow.
fn power_of_two_near(most: f64) -> (f64, f64) {
    let (mut up, mut down) = (1.0, 1.0);
    if most == 0.0 {
        return (up, down);
    }
    // f64 spans 2^-1074 to 2^1024: less than 1100 halvings or doublings.
    while most * up * down < 0.5 {
        if up < 1e300 { up *= 2.0 } else { down *= 2.0 }
    }
    while most * up * down >= 1.0 {
        if up > 1e-300 { up *= 0.5 } else { down *= 0.5 }
    }
    (up, down)
}

fn equal<const D: usize>(a: &Point<D>, b: &Point<D>) -> bool {
    lexicographic(a, b) == Ordering::Equal
}

/// The distinct points, each where it first occurs, and for every given point the index of its equal
/// among them. 0 and −0 are equal; coordinates should be finite.
///
/// ```
/// let (unique, map) =
///     atomesh::mesh::merge_duplicates(&[[1.0, 2.0], [0.0, 0.0], [1.0, 2.0]]);
/// assert_eq!(unique, [[1.0, 2.0], [0.0, 0.0]]);
/// assert_eq!(map, [0, 1, 0]);
/// ```
pub fn merge_duplicates<const D: usize>(points: &[Point<D>]) -> (Vec<Point<D>>, Vec<u32>) {
    let order = hilbert_order(points);
    // Equal points follow each other by index: the first of each run stands for it.
    let mut first = vec![0_u32; points.len()];
    for (at, &index) in order.iter().enumerate() {
        let before = at.checked_sub(1).map(|at| order[at] as usize);
        first[index as usize] = match before {
            Some(b) if equal(&points[b], &points[index as usize]) => first[b],
            _ => index,
        };
    }
    let mut unique = Vec::new();
    let mut map = vec![0_u32; points.len()];
    for index in 0..points.len() {
        if first[index] as usize == index {
            map[index] = unique.len() as u32;
            unique.push(points[index]);
        } else {
            map[index] = map[first[index] as usize];
        }
    }
    (unique, map)
}
