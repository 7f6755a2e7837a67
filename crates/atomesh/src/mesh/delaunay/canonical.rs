//! One order for the same cells, whatever made them.

/// Sorts each cell's corners, keeping its orientation, and then the cells.
///
/// `N` corners make a cell; they are below `point_count`. Corners ascend but for the last two, which
/// are swapped if the orientation needs it. Cost: O(n) for cells spread over the points.
pub(super) fn arrange<const N: usize>(mut corners: Vec<u32>, point_count: usize) -> Vec<u32> {
    let mut starts = vec![0_usize; point_count + 1];
    for cell in corners.as_chunks_mut::<N>().0 {
        sort_evenly(cell);
        starts[cell[0] as usize + 1] += 1;
    }
    for point in 0..point_count {
        starts[point + 1] += starts[point];
    }
    let mut arranged = vec![0; corners.len()];
    let cells = arranged.as_chunks_mut::<N>().0;
    let mut next = starts.clone();
    for cell in corners.as_chunks::<N>().0 {
        let at = &mut next[cell[0] as usize];
        cells[*at] = *cell;
        *at += 1;
    }
    for range in starts.windows(2) {
        cells[range[0]..range[1]].sort_unstable();
    }
    arranged
}

/// Sorts by an even number of swaps: the last two corners end out of order if need be.
fn sort_evenly<const N: usize>(cell: &mut [u32; N]) {
    let mut odd = false;
    for end in (1..N).rev() {
        for k in 0..end {
            // Without a branch: which corner is lower is anyone's guess.
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
    fn cells_come_out_in_order() {
        let cells = vec![5, 2, 3, 0, 4, 1, 3, 2, 4, 1, 0, 2];
        assert_eq!(arrange::<3>(cells, 6), [0, 2, 1, 0, 4, 1, 2, 3, 5, 2, 4, 3]);
    }
}
