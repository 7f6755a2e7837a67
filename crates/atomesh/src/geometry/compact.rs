//! Points in blocks that are near each other: an order for searches by boxes.

use super::{Bounds, Point};
use crate::parallel::prelude::*;

/// The indices of `points` in an order in which any [`BLOCK`] that follow each other from a multiple of
/// it on are near each other, and so are eight such blocks, and eight of those: the set is halved across
/// its longest side, at a power of two of blocks, and the halves again.
///
/// Blocks are more compact than those of [`super::hilbert_order`]: a search by boxes is faster.
/// Points equal along an axis go by index. Coordinates are compared in single precision, in units of the
/// points' extent. Cost: O(n log n).
pub fn compact_order<const D: usize>(points: &[Point<D>]) -> Vec<u32> {
    let Some(bounds) = Bounds::of(points) else { return Vec::new() };
    let longest = bounds.longest_edge();
    let scale = if longest > 0.0 { 1.0 / longest } else { 1.0 };
    let mut entries: Vec<Entry<D>> = points
        .par_iter()
        .enumerate()
        .map(|(index, p)| Entry {
            at: std::array::from_fn(|k| ((p[k] - bounds.min[k]) * scale) as f32),
            index: index as u32,
        })
        .collect();
    halve(&mut entries);
    entries.iter().map(|e| e.index).collect()
}

/// Points that [`compact_order`] keeps together.
pub const BLOCK: usize = 8;
/// Fewer points than this are halved on one thread.
const ALONE: usize = 4096;

#[derive(Clone, Copy)]
struct Entry<const D: usize> {
    at: [f32; D],
    index: u32,
}

/// Halves across the longest side until blocks are left.
fn halve<const D: usize>(entries: &mut [Entry<D>]) {
    let blocks = entries.len().div_ceil(BLOCK);
    if blocks <= 1 {
        entries.sort_unstable_by_key(|e| e.index);
        return;
    }
    let (mut low, mut high) = ([f32::INFINITY; D], [f32::NEG_INFINITY; D]);
    for e in entries.iter() {
        for k in 0..D {
            (low[k], high[k]) = (low[k].min(e.at[k]), high[k].max(e.at[k]));
        }
    }
    let side = |k: usize| high[k] - low[k];
    let axis = (1..D).fold(0, |best, k| if side(k) > side(best) { k } else { best });
    let middle = BLOCK * blocks.next_power_of_two() / 2;
    entries.select_nth_unstable_by(middle, |a, b| {
        a.at[axis].total_cmp(&b.at[axis]).then(a.index.cmp(&b.index))
    });
    let (left, right) = entries.split_at_mut(middle);
    if left.len() > ALONE {
        rayon::join(|| halve(left), || halve(right));
    } else {
        halve(left);
        halve(right);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A square lattice of 2ᵏ points a side, column by column.
    fn lattice(side: usize) -> Vec<Point<2>> {
        (0..side * side).map(|i| [(i / side) as f64, (i % side) as f64]).collect()
    }

    #[test]
    fn blocks_of_a_lattice_are_two_by_four() {
        let points = lattice(32);
        let order = compact_order(&points);
        for block in order.chunks(BLOCK) {
            let members: Vec<Point<2>> = block.iter().map(|&i| points[i as usize]).collect();
            let mut sides = Bounds::of(&members).unwrap().extent();
            sides.sort_by(f64::total_cmp);
            assert_eq!(sides, [1.0, 3.0]);
        }
    }

    #[test]
    fn order_is_a_permutation_whatever_the_points() {
        let strange = [[f64::NAN, 1.0], [2.0, f64::INFINITY], [0.0, -0.0]];
        for points in [Vec::new(), vec![[3.0, 4.0]; 21], lattice(9), strange.to_vec()] {
            let mut order = compact_order(&points);
            order.sort_unstable();
            assert!(order.iter().enumerate().all(|(k, &i)| k == i as usize));
            assert_eq!(order.len(), points.len());
        }
    }

    #[test]
    fn order_is_the_same_at_any_number_of_threads() {
        let points = lattice(160);
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        assert_eq!(compact_order(&points), pool.install(|| compact_order(&points)));
    }
}
