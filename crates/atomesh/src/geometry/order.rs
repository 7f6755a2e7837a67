//! Points along a Hilbert curve: what is near in memory is then near in space.
//!
//! The bounding cube of the points is cut into 2^b cells a side and the cells are numbered along the
//! curve (Hamilton 2006). Points of one cell follow each other in order of their coordinates, equal
//! points in order of their indices, so the order is total and depends on no thread count.
//! Cost: O(n log n).

use super::{Bounds, Point};
use rayon::prelude::*;
use std::cmp::Ordering;

/// The bits of a whole key: 30 a coordinate in 2-D, 20 in 3-D.
const KEY_BITS: usize = 60;

/// The indices of `points` in the order in which a Hilbert curve through their bounding cube meets
/// them; points of one cell of the curve in [`lexicographic`] order, equal points by index.
///
/// Coordinates should be finite; the place of a point with one that is not is unspecified. The
/// order of distinct points does not depend on the order in which they are given.
pub fn hilbert_order<const D: usize>(points: &[Point<D>]) -> Vec<u32> {
    let Some(bounds) = Bounds::of(points) else { return Vec::new() };
    let bits = KEY_BITS / D;
    let side = bounds.extent().into_iter().fold(0.0, f64::max);
    let cells = (1_u64 << bits) as f64;
    let curve = HilbertCurve::<D>::new();
    let mut keyed: Vec<(u64, u32)> = points
        .par_iter()
        .enumerate()
        .map(|(index, p)| {
            let cell: [u32; D] = std::array::from_fn(|k| {
                let place = if side > 0.0 { (p[k] - bounds.min[k]) / side } else { 0.0 };
                (place * cells).min(cells - 1.0) as u32
            });
            (curve.key(cell, bits), index as u32)
        })
        .collect();
    keyed.par_sort_unstable_by(|a, b| {
        a.0.cmp(&b.0)
            .then_with(|| lexicographic(&points[a.1 as usize], &points[b.1 as usize]))
            .then(a.1.cmp(&b.1))
    });
    keyed.par_iter().map(|&(_, index)| index).collect()
}

/// Compares by x, then y (then z); 0 and −0 are equal.
#[inline]
pub fn lexicographic<const D: usize>(a: &Point<D>, b: &Point<D>) -> Ordering {
    for k in 0..D {
        // Adding 0 turns −0 into 0, so that the total order agrees with the usual one.
        let ordering = (a[k] + 0.0).total_cmp(&(b[k] + 0.0));
        if ordering != Ordering::Equal {
            return ordering;
        }
    }
    Ordering::Equal
}

/// The Hilbert curve as an automaton. A state is how the curve runs through the present cube; it
/// tells where each of the 2^D halves along all axes comes, and in which state the curve is there.
///
/// Source: C. Hamilton, "Compact Hilbert indices" (2006), sections 2 and 3, whose names are kept.
struct HilbertCurve<const D: usize> {
    /// For each state and half: the next state's first place in this table, times 2^D, plus the
    /// place of the half along the curve.
    steps: Vec<u16>,
}

impl<const D: usize> HilbertCurve<D> {
    /// 2^D, the halves along all axes.
    const HALVES: usize = 1 << D;

    fn new() -> Self {
        let mut steps = Vec::with_capacity(Self::HALVES * Self::HALVES * D);
        // The state of entry e and direction d is number e · D + d.
        for e in 0..Self::HALVES {
            for d in 0..D {
                for half in 0..Self::HALVES {
                    let w = gray_inverse(rotate::<D>(half ^ e, 2 * D - d - 1));
                    let next_e = e ^ rotate::<D>(entry(w), d + 1);
                    let next_d = (d + direction(w) + 1) % D;
                    steps.push(((next_e * D + next_d) * Self::HALVES * Self::HALVES + w) as u16);
                }
            }
        }
        Self { steps }
    }

    /// The number of a cell among the `2^bits` a side.
    fn key(&self, cell: [u32; D], bits: usize) -> u64 {
        let (mut key, mut state) = (0, 0);
        for b in (0..bits).rev() {
            let mut half = 0;
            for k in 0..D {
                half |= (cell[k] as usize >> b & 1) << k;
            }
            let step = usize::from(self.steps[state + half]);
            key = key << D | (step % Self::HALVES) as u64;
            state = step / Self::HALVES;
        }
        key
    }
}

/// Rotates the lowest D bits to the left.
fn rotate<const D: usize>(bits: usize, by: usize) -> usize {
    let by = by % D;
    (bits << by | bits >> (D - by)) & ((1 << D) - 1)
}

/// The number whose Gray code this is, for up to 4 bits.
fn gray_inverse(code: usize) -> usize {
    code ^ code >> 1 ^ code >> 2 ^ code >> 3
}

/// Where the curve enters the half that it visits as number `w`.
fn entry(w: usize) -> usize {
    let even = w.saturating_sub(1) & !1;
    even ^ even >> 1
}

/// Along which axis the curve runs through the half that it visits as number `w`.
fn direction(w: usize) -> usize {
    match w {
        0 => 0,
        _ if w.is_multiple_of(2) => (w - 1).trailing_ones() as usize,
        _ => w.trailing_ones() as usize,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve_is_a_walk_through_all_cells<const D: usize>(bits: usize) {
        let curve = HilbertCurve::<D>::new();
        let side = 1_u32 << bits;
        let count = (side as usize).pow(D as u32);
        let mut cells = vec![None; count];
        for index in 0..count {
            let cell: [u32; D] =
                std::array::from_fn(|k| (index / (side as usize).pow(k as u32)) as u32 % side);
            cells[curve.key(cell, bits) as usize] = Some(cell);
        }
        let cells: Vec<[u32; D]> = cells.into_iter().map(Option::unwrap).collect();
        for pair in cells.windows(2) {
            let steps: u32 = (0..D).map(|k| pair[0][k].abs_diff(pair[1][k])).sum();
            assert_eq!(steps, 1, "{pair:?}");
        }
    }

    #[test]
    fn the_curve_visits_every_cell_once_and_only_steps_to_a_neighbour() {
        curve_is_a_walk_through_all_cells::<2>(5);
        curve_is_a_walk_through_all_cells::<3>(3);
    }

    #[test]
    fn order_is_a_permutation_whatever_the_points() {
        let none: [Point<2>; 0] = [];
        assert!(hilbert_order(&none).is_empty());
        assert_eq!(hilbert_order(&[[3.0, 4.0]]), [0]);
        assert_eq!(hilbert_order(&[[3.0, 4.0]; 3]), [0, 1, 2]);
        let mut order = hilbert_order(&[[f64::NAN, 1.0], [2.0, f64::INFINITY], [0.0, -0.0]]);
        order.sort_unstable();
        assert_eq!(order, [0, 1, 2]);
    }

    #[test]
    fn equal_points_are_neighbours_even_with_signed_zeros() {
        let order = hilbert_order(&[[0.0, 5.0], [0.0, 3.0], [-0.0, 5.0], [1e9, 0.0]]);
        let at = |index| order.iter().position(|&i| i == index).unwrap();
        assert_eq!(at(0) + 1, at(2));
    }
}
