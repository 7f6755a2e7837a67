//! What differs between the cells of two meshes.

/// Cells that are no more and cells that are new, each ascending by corners but for the last two, which
/// are swapped where the orientation needs it; cells in lexicographic order.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct CellChanges {
    pub removed: Vec<u32>,
    pub added: Vec<u32>,
}

impl CellChanges {
    /// The difference of two sets of cells, which have `corner_count` corners each.
    pub fn between(mut before: Vec<u32>, mut after: Vec<u32>, corner_count: usize) -> Self {
        let (before, after) =
            (in_order(&mut before, corner_count), in_order(&mut after, corner_count));
        Self { removed: without(&before, &after), added: without(&after, &before) }
    }
}

/// The cells of one sorted list that are not in another, one after the other.
fn without(cells: &[&[u32]], others: &[&[u32]]) -> Vec<u32> {
    let mut rest = Vec::new();
    let mut others = others.iter().peekable();
    for cell in cells {
        while others.next_if(|other| *other < cell).is_some() {}
        if others.peek() != Some(&cell) {
            rest.extend_from_slice(cell);
        }
    }
    rest
}

/// Cells in the order of [`CellChanges`].
pub(crate) fn in_order(corners: &mut [u32], corner_count: usize) -> Vec<&[u32]> {
    for cell in corners.chunks_exact_mut(corner_count) {
        if sort_by_swaps(cell) {
            cell.swap(corner_count - 2, corner_count - 1);
        }
    }
    let mut cells: Vec<&[u32]> = corners.chunks_exact(corner_count).collect();
    cells.sort_unstable();
    cells
}

/// Sorts a few numbers by swaps of neighbours; whether their number was odd.
pub(crate) fn sort_by_swaps(numbers: &mut [u32]) -> bool {
    let mut odd = false;
    for end in (1..numbers.len()).rev() {
        for k in 0..end {
            if numbers[k] > numbers[k + 1] {
                numbers.swap(k, k + 1);
                odd = !odd;
            }
        }
    }
    odd
}
