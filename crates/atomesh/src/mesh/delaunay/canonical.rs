//! One order for the same cells, whatever made them.

/// Sorts each cell's corners, keeping its orientation, and then the cells.
///
/// `each` corners make a cell; they name points below `point_count`. Corners ascend but for the last
/// two, which are swapped if the orientation needs it. Cost: O(n) for cells spread over the points.
pub(super) fn arrange(mut corners: Vec<u32>, each: usize, point_count: usize) -> Vec<u32> {
    let mut starts = vec![0_usize; point_count + 1];
    for cell in corners.chunks_exact_mut(each) {
        sort_evenly(cell);
        starts[cell[0] as usize + 1] += each;
    }
    for point in 0..point_count {
        starts[point + 1] += starts[point];
    }
    let mut arranged = vec![0; corners.len()];
    let mut next = starts.clone();
    for cell in corners.chunks_exact(each) {
        let at = &mut next[cell[0] as usize];
        arranged[*at..*at + each].copy_from_slice(cell);
        *at += each;
    }
    drop(corners);
    for range in starts.windows(2) {
        sort_rows(&mut arranged[range[0]..range[1]], each);
    }
    arranged
}

/// Sorts by an even number of swaps: the last two corners end out of order if need be.
fn sort_evenly(cell: &mut [u32]) {
    let mut odd = false;
    for end in (1..cell.len()).rev() {
        for k in 0..end {
            if cell[k] > cell[k + 1] {
                cell.swap(k, k + 1);
                odd = !odd;
            }
        }
    }
    if odd {
        let last = cell.len() - 1;
        cell.swap(last - 1, last);
    }
}

/// Sorts short rows; the few that share a first corner.
fn sort_rows(rows: &mut [u32], each: usize) {
    /// Up to this many rows, insertion is faster than a sort that allocates.
    const FEW: usize = 48;
    if rows.len() > FEW * each {
        let mut sorted: Vec<&[u32]> = rows.chunks_exact(each).collect();
        sorted.sort_unstable();
        let sorted = sorted.concat();
        rows.copy_from_slice(&sorted);
        return;
    }
    for end in (each..rows.len()).step_by(each) {
        let mut at = end;
        while at > 0 && rows[at - each..at] > rows[at..at + each] {
            let (left, right) = rows.split_at_mut(at);
            left[at - each..].swap_with_slice(&mut right[..each]);
            at -= each;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn even_sorting_keeps_the_orientation() {
        let mut cell = [3, 1, 2];
        sort_evenly(&mut cell);
        assert_eq!(cell, [1, 2, 3]);
        let mut cell = [3, 2, 1, 0];
        sort_evenly(&mut cell);
        assert_eq!(cell, [0, 1, 2, 3]);
        let mut cell = [1, 0, 2, 3];
        sort_evenly(&mut cell);
        assert_eq!(cell, [0, 1, 3, 2]);
    }

    #[test]
    fn many_rows_and_few_rows_sort_alike() {
        for count in [1_u32, 5, 200] {
            let rows: Vec<u32> = (0..count).flat_map(|i| [0, 7919 * i % 1009, i]).collect();
            let mut expected: Vec<Vec<u32>> = rows.chunks(3).map(<[u32]>::to_vec).collect();
            expected.sort();
            let mut sorted = rows;
            sort_rows(&mut sorted, 3);
            assert_eq!(sorted, expected.concat());
        }
    }
}
