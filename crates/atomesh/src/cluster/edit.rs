//! Parts changed by hand: two made one, one cut in two between marks.

use super::min_cut::min_cut;
use super::{CellGraph, ClusterError};

/// Gives the cells of the part `taken` the number `kept`; the two need not touch.
///
/// # Errors
/// [`ClusterError::Part`] if one of them has no cell.
pub fn merge_parts(parts: &mut [i32], kept: i32, taken: i32) -> Result<(), ClusterError> {
    for part in [kept, taken] {
        if !parts.contains(&part) {
            return Err(ClusterError::Part { part });
        }
    }
    parts.iter_mut().filter(|part| **part == taken).for_each(|part| *part = kept);
    Ok(())
}

/// Cuts a part in two between cells marked on its two sides, by a minimum cut: the sum of the weights across is the least.
/// The cells of the second side get the least number above all others, which is returned.
///
/// Walls are crossed first, and as few as can be. Where other cuts are as weak, cells between them go where there are
/// fewer. Cost: in practice some passes over the part's links.
///
/// # Errors
/// [`ClusterError`] if there is not one number for each cell, no cell of that part, no mark for a side, a mark that is not
/// in the part, a cell marked for both sides, or no number left.
pub fn split_part(
    graph: &CellGraph,
    parts: &mut [i32],
    part: i32,
    marks: [&[u32]; 2],
) -> Result<i32, ClusterError> {
    if parts.len() != graph.cell_count() {
        return Err(ClusterError::PartCount { found: parts.len(), expected: graph.cell_count() });
    }
    let cells: Vec<u32> =
        parts.iter().zip(0..).filter(|(own, _)| **own == part).map(|(_, cell)| cell).collect();
    if cells.is_empty() {
        return Err(ClusterError::Part { part });
    }
    let greatest = parts.iter().max().copied().unwrap_or(part);
    let number = greatest.checked_add(1).ok_or(ClusterError::NoNumber)?;
    for cell in min_cut(graph, &cells, marks)? {
        parts[cell as usize] = number;
    }
    Ok(number)
}
