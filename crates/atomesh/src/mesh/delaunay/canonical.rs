//! One order for the same cells, whatever made them.
//!
//! 1. Each cell's corners are sorted, its orientation kept, and the cells put into blocks by their
//!    lowest corner, so that what follows stays in a processor's cache.
//! 2. Within a block the cells are counted by their lowest corner, and those that share it sorted.

use crate::geometry::shares;
use crate::parallel::prelude::*;
use std::ops::Range;

/// Points whose cells make one block.
const BLOCK: usize = 2048;

/// Pieces of the cells for each thread, so that threads end at about the same time.
const PIECES_A_THREAD: usize = 4;

/// A list of cells of `N` corners, with gaps.
pub(super) trait CellSource<const N: usize>: Sync {
    /// The number of places in the list; some may be empty.
    fn place_count(&self) -> usize;

    /// The corners of the cell at a place, as ranks in the prepared order.
    fn corners(&self, place: usize) -> Option<[u32; N]>;
}

impl<const N: usize> CellSource<N> for Vec<[u32; N]> {
    fn place_count(&self) -> usize {
        self.len()
    }

    fn corners(&self, place: usize) -> Option<[u32; N]> {
        Some(self[place])
    }
}

/// The corners of all cells, `N` a cell, in canonical order, each corner as its place in `order`.
///
/// Within a cell corners ascend but for the last two, which are swapped if the orientation needs it;
/// cells are in lexicographic order. Cost: O(n) for cells spread over the points.
pub(super) fn arrange<const N: usize>(sources: &[impl CellSource<N>], order: &[u32]) -> Vec<u32> {
    let pieces = pieces(sources);
    let cells = |(source, places): &(usize, Range<usize>)| {
        let source = &sources[*source];
        places.clone().filter_map(|place| source.corners(place))
    };
    let block_count = order.len().div_ceil(BLOCK);
    let counts: Vec<Vec<u32>> = pieces
        .par_iter()
        .map(|piece| {
            let mut counts = vec![0; block_count];
            cells(piece).for_each(|corners| counts[block_of(&corners)] += 1);
            counts
        })
        .collect();
    let cell_count: usize = counts.iter().flatten().map(|&count| count as usize).sum();
    let mut arranged = vec![0; N * cell_count];
    let shares = shares(arranged.as_chunks_mut::<N>().0, &counts);
    pieces.par_iter().zip(shares).for_each(|(piece, mut share)| {
        for mut corners in cells(piece) {
            sort_evenly(&mut corners);
            share.put(block_of(&corners), corners);
        }
    });
    let mut blocks = Vec::with_capacity(block_count);
    let mut rest = arranged.as_chunks_mut::<N>().0;
    for block in 0..block_count {
        let count: usize = counts.iter().map(|counts| counts[block] as usize).sum();
        blocks.push(rest.split_off_mut(..count).expect("they are counted"));
    }
    blocks.into_par_iter().enumerate().for_each_init(Vec::new, |sorted, (block, cells)| {
        arrange_block(cells, (block * BLOCK) as u32, order, sorted);
    });
    arranged
}

/// The block of a cell: that of its lowest corner.
#[inline]
fn block_of<const N: usize>(corners: &[u32; N]) -> usize {
    corners.iter().fold(u32::MAX, |least, &corner| least.min(corner)) as usize / BLOCK
}

/// Divides the places of each source into ranges of about one length.
fn pieces<const N: usize>(sources: &[impl CellSource<N>]) -> Vec<(usize, Range<usize>)> {
    let place_count: usize = sources.iter().map(CellSource::place_count).sum();
    let length = place_count.div_ceil(PIECES_A_THREAD * rayon::current_num_threads()).max(1);
    let of_source = |source: usize| {
        let end = sources[source].place_count();
        (0..end).step_by(length).map(move |start| (source, start..end.min(start + length)))
    };
    (0..sources.len()).flat_map(of_source).collect()
}

/// Sorts cells of which the lowest corners are in one block, from `first` on, and gives all corners
/// their places in `order`. `sorted` is overwritten.
fn arrange_block<const N: usize>(
    cells: &mut [[u32; N]],
    first: u32,
    order: &[u32],
    sorted: &mut Vec<u128>,
) {
    let mut starts = [0_u32; BLOCK + 1];
    for corners in cells.iter() {
        starts[(corners[0] - first) as usize + 1] += 1;
    }
    for k in 0..BLOCK {
        starts[k + 1] += starts[k];
    }
    let mut next = starts;
    sorted.clear();
    sorted.resize(cells.len(), 0);
    for corners in cells.iter() {
        let at = &mut next[(corners[0] - first) as usize];
        // One number compares faster than a list.
        sorted[*at as usize] = corners.iter().fold(0, |key, &c| key << 32 | u128::from(c));
        *at += 1;
    }
    for range in starts.windows(2) {
        sorted[range[0] as usize..range[1] as usize].sort_unstable();
    }
    for (corners, key) in cells.iter_mut().zip(sorted) {
        for (k, corner) in corners.iter_mut().rev().enumerate() {
            *corner = order[(*key >> (32 * k)) as u32 as usize];
        }
    }
}
/// Sorts by an even number of swaps: the last two corners end out of order if need be.
fn sort_evenly<const N: usize>(cell: &mut [u32; N]) {
    let mut odd = false;
    for end in (1..N).rev() {
        for k in 0..end {
            // Without a branch: which corner is lower cannot be predicted.
            let (a, b) = (cell[k], cell[k + 1]);
            (cell[k], cell[k + 1]) = (a.min(b), a.max(b));
            odd ^= a > b;
        }
    }
    if odd {
        cell.swap(N - 2, N - 1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    fn evenly_sorted<const N: usize>(mut cell: [u32; N]) -> [u32; N] {
        sort_evenly(&mut cell);
        cell
    }

    #[test]
    fn even_sorting_keeps_the_orientation() {
        assert_eq!(evenly_sorted([3, 1, 2]), [1, 2, 3]);
        assert_eq!(evenly_sorted([3, 2, 1, 0]), [0, 1, 2, 3]);
        assert_eq!(evenly_sorted([1, 0, 2, 3]), [0, 1, 3, 2]);
    }

    #[test]
    fn cells_come_out_in_order_with_corners_renamed() {
        let cells = vec![[5, 2, 3], [0, 4, 1], [3, 2, 4], [1, 0, 2]];
        let expected = [0, 2, 1, 0, 4, 1, 2, 3, 5, 2, 4, 3];
        let sources = [cells];
        assert_eq!(arrange(&sources, &[0, 1, 2, 3, 4, 5]), expected);
        let order = [7, 3, 9, 5, 8, 4];
        assert_eq!(arrange(&sources, &order), expected.map(|c| order[c as usize]));
    }

    #[test]
    fn blocks_and_pieces_change_nothing() {
        let count = 3 * BLOCK as u32 / 2;
        let mut random = Pcg64Mcg::seed_from_u64(1);
        let cells: Vec<[u32; 4]> =
            (0..20_000).map(|_| std::array::from_fn(|_| random.random_range(0..count))).collect();
        let order: Vec<u32> = (0..count).rev().collect();
        let mut expected: Vec<[u32; 4]> = cells.iter().map(|&cell| evenly_sorted(cell)).collect();
        expected.sort_unstable();
        let expected: Vec<u32> =
            expected.into_iter().flatten().map(|c| order[c as usize]).collect();
        for at in [0, 1, 7000, 20_000] {
            let (one, other) = cells.split_at(at);
            assert_eq!(arrange(&[one.to_vec(), other.to_vec()], &order), expected, "{at}");
        }
    }
}
