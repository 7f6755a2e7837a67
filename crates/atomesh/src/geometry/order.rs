//! Points along a Hilbert curve: those near in memory are then near each other.
//!
//! The bounding cube of the points is cut into 2^b cells a side and the cells are numbered along the
//! curve (Hamilton 2006). Points of one cell follow each other in order of their coordinates, equal
//! points in order of their indices, so the order is total and depends on no thread count.
//! Cost: O(n log n).

use super::{Bounds, Point};
use crate::parallel::prelude::*;
use std::cmp::Ordering;

/// The bits of a whole key: 30 a coordinate in the plane, 20 in space.
const KEY_BITS: usize = 60;

/// The indices of `points` in the order in which a Hilbert curve through their bounding cube meets
/// them; points of one cell of the curve in [`lexicographic`] order, equal points by index.
///
/// Coordinates should be finite; the place of a point with one that is not is unspecified. The
/// order of distinct points does not depend on the order in which they are given.
pub fn hilbert_order<const D: usize>(points: &[Point<D>]) -> Vec<u32> {
    let Some(bounds) = Bounds::of(points) else { return Vec::new() };
    let bits = KEY_BITS / D;
    let side = bounds.longest_edge();
    let cells = (1_u64 << bits) as f64;
    let curve = HilbertCurve::<D>::new();
    let keyed: Vec<(u64, u32)> = points
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
    let before = |a: &(u64, u32), b: &(u64, u32)| {
        a.0.cmp(&b.0)
            .then_with(|| lexicographic(&points[a.1 as usize], &points[b.1 as usize]))
            .then(a.1.cmp(&b.1))
    };
    let (mut dealt, ends) = deal(&keyed, bits * D);
    let mut hands = Vec::with_capacity(ends.len());
    let (mut rest, mut start) = (&mut dealt[..], 0);
    for end in ends {
        let (hand, after) = rest.split_at_mut(end - start);
        hands.push(hand);
        (rest, start) = (after, end);
    }
    hands.into_par_iter().with_min_len(64).for_each(|hand| hand.sort_unstable_by(before));
    dealt.into_par_iter().map(|(_, index)| index).collect()
}

/// The leading bits of a key by which points are dealt before they are sorted.
const DEALT_BITS: usize = 12;

/// The keyed indices by the leading bits of their keys of `bits` bits, and where each hand ends.
fn deal(keyed: &[(u64, u32)], bits: usize) -> (Vec<(u64, u32)>, Vec<usize>) {
    let shift = bits.saturating_sub(DEALT_BITS);
    let hand = |key: u64| (key >> shift) as usize;
    let hand_count = 1 << bits.min(DEALT_BITS);
    let pieces = keyed.par_chunks(keyed.len().div_ceil(4 * rayon::current_num_threads()).max(1));
    let count = |piece: &[(u64, u32)]| {
        let mut counts = vec![0; hand_count];
        piece.iter().for_each(|(key, _)| counts[hand(*key)] += 1);
        counts
    };
    let counts: Vec<Vec<u32>> = pieces.clone().map(count).collect();
    let mut dealt = vec![(0, 0); keyed.len()];
    let shares = shares(&mut dealt, &counts);
    pieces.zip(shares).for_each(|(piece, mut share)| {
        piece.iter().for_each(|entry| share.put(hand(entry.0), *entry));
    });
    let mut end = 0;
    let ends = (0..hand_count).map(|hand| {
        end += counts.iter().map(|counts| counts[hand] as usize).sum::<usize>();
        end
    });
    (dealt, ends.collect())
}

/// Places for the items that one piece of work deals out, in a row for each group.
pub(crate) struct Share<'a, T> {
    rows: Vec<&'a mut [T]>,
}

impl<T> Share<'_, T> {
    /// Puts an item at the next place of its group.
    ///
    /// # Panics
    /// If the group's row is full.
    #[inline]
    pub fn put(&mut self, group: usize, item: T) {
        let row = &mut self.rows[group];
        let (first, rest) = std::mem::take(row).split_first_mut().expect("items are counted");
        *first = item;
        *row = rest;
    }
}

/// For each piece of work its share of the places for all items: groups follow each other, in each the
/// pieces. `counts` are each piece's items of each group.
pub(crate) fn shares<'a, T>(mut places: &'a mut [T], counts: &[Vec<u32>]) -> Vec<Share<'a, T>> {
    let group_count = counts.first().map_or(0, Vec::len);
    let empty = |_| Share { rows: Vec::with_capacity(group_count) };
    let mut shares: Vec<Share<T>> = counts.iter().map(empty).collect();
    for group in 0..group_count {
        for (share, counts) in shares.iter_mut().zip(counts) {
            let row = places.split_off_mut(..counts[group] as usize).expect("items are counted");
            share.rows.push(row);
        }
    }
    shares
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
    /// The same for [`Self::LEVELS`] steps at a time.
    strides: Vec<u16>,
    /// Numbers below 2^[`Self::LEVELS`] with their bits D apart.
    apart: Vec<u8>,
}

impl<const D: usize> HilbertCurve<D> {
    /// 2^D, the halves along all axes.
    const HALVES: usize = 1 << D;

    /// The halvings that one stride goes down: six bits of a key.
    const LEVELS: usize = if D < 6 { 6 / D } else { 1 };

    /// A stride's places, 2^(D · levels).
    const PLACES: usize = 1 << (D * Self::LEVELS);

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
        let apart = (0..1_usize << Self::LEVELS)
            .map(|n| (0..Self::LEVELS).map(|b| (n >> b & 1) << (D * b)).sum::<usize>() as u8)
            .collect();
        let mut curve = Self { steps, strides: Vec::new(), apart };
        for state in 0..Self::HALVES * D {
            for place in 0..Self::PLACES {
                let (mut key, mut state) = (0, state * Self::HALVES);
                for level in (0..Self::LEVELS).rev() {
                    curve.step(&mut key, &mut state, place >> (D * level) & (Self::HALVES - 1));
                }
                let next = state / Self::HALVES * Self::PLACES;
                curve.strides.push((next + key as usize) as u16);
            }
        }
        curve
    }

    /// Goes down to a half.
    #[inline(always)]
    fn step(&self, key: &mut u64, state: &mut usize, half: usize) {
        let step = usize::from(self.steps[*state + half]);
        *key = *key << D | (step % Self::HALVES) as u64;
        *state = step / Self::HALVES;
    }

    /// The number of a cell among the `2^bits` a side.
    fn key(&self, cell: [u32; D], bits: usize) -> u64 {
        let (mut key, mut state) = (0, 0);
        let odd = bits % Self::LEVELS;
        for b in (bits - odd..bits).rev() {
            let half = (0..D).map(|k| (cell[k] as usize >> b & 1) << k).sum();
            self.step(&mut key, &mut state, half);
        }
        state = state / Self::HALVES * Self::PLACES;
        for b in (0..bits - odd).step_by(Self::LEVELS).rev() {
            let mut place = 0;
            for k in 0..D {
                let part = cell[k] as usize >> b & ((1 << Self::LEVELS) - 1);
                place |= usize::from(self.apart[part]) << k;
            }
            let stride = usize::from(self.strides[state + place]);
            key = key << (D * Self::LEVELS) | (stride % Self::PLACES) as u64;
            state = stride - stride % Self::PLACES;
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

    fn strides_follow_steps<const D: usize>() {
        let curve = HilbertCurve::<D>::new();
        let bits = KEY_BITS / D;
        let mut random = 1_u64;
        for _ in 0..1000 {
            let cell: [u32; D] = std::array::from_fn(|_| {
                random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                (random >> (64 - bits)) as u32
            });
            let (mut key, mut state) = (0, 0);
            for b in (0..bits).rev() {
                let half = (0..D).map(|k| (cell[k] as usize >> b & 1) << k).sum();
                curve.step(&mut key, &mut state, half);
            }
            assert_eq!(curve.key(cell, bits), key, "{cell:?}");
        }
    }

    #[test]
    fn a_stride_is_some_steps() {
        strides_follow_steps::<2>();
        strides_follow_steps::<3>();
    }

    #[test]
    fn points_come_in_the_order_of_a_plain_sort() {
        let mut random = 1_u64;
        let mut next = || {
            random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (random >> 40) as f64
        };
        let points: Vec<Point<3>> = (0..5000).map(|_| [next(), next() * 0.1, 3.0]).collect();
        let bounds = Bounds::of(&points).unwrap();
        let side = bounds.longest_edge();
        let cells = (1_u64 << (KEY_BITS / 3)) as f64;
        let curve = HilbertCurve::<3>::new();
        let key = |i: &u32| {
            let p = points[*i as usize];
            let cell = std::array::from_fn(|k| {
                ((p[k] - bounds.min[k]) / side * cells).min(cells - 1.0) as u32
            });
            curve.key(cell, KEY_BITS / 3)
        };
        let mut plain: Vec<u32> = (0..5000).collect();
        plain.sort_by(|a, b| {
            let places = (points[*a as usize], points[*b as usize]);
            key(a).cmp(&key(b)).then_with(|| lexicographic(&places.0, &places.1)).then(a.cmp(b))
        });
        assert_eq!(hilbert_order(&points), plain);
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
