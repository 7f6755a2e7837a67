//! Swapping the diagonal of two triangles.

use super::energy::{CellCost, Energy, doubled_area};
use super::moves::Mover;
use super::triangles::{CellPair, Triangles};

/// The least gain that counts; less may be rounding.
pub(super) const LEAST_GAIN: f64 = 1e-9;

/// Swaps whatever lowers the energy, pair after pair, where something has changed since the last time.
/// Returns how many.
pub(super) fn swap_all(triangles: &mut Triangles, energy: &Energy<'_>, mover: &mut Mover) -> usize {
    let mut swaps = 0;
    let mut guides = [Vec::new(), Vec::new()];
    for cell in 0..triangles.len() as u32 {
        for place in 0..3 {
            let Some(pair) = triangles.pair(cell, place) else { continue };
            // each pair once
            if pair.cells[1] < cell || !mover.is_changed(&pair) {
                continue;
            }
            if lowers(triangles, energy, &pair, &mut guides) {
                let [first, second] = &mut guides;
                triangles.swap(&pair, [first, second]);
                mover.wake(&pair);
                swaps += 1;
                break;
            }
        }
    }
    swaps
}

/// Whether swapping a pair lowers the energy; then `guides` are those of the new cells.
fn lowers(
    triangles: &Triangles,
    energy: &Energy<'_>,
    pair: &CellPair,
    guides: &mut [Vec<u32>; 2],
) -> bool {
    let CellPair { cells, edge, apices } = *pair;
    let [a, b] = edge.map(|point| triangles.points[point as usize]);
    let [v, u] = apices.map(|point| triangles.points[point as usize]);
    if doubled_area(v, a, u) <= 0.0 || doubled_area(u, b, v) <= 0.0 {
        return false;
    }
    guides.iter_mut().for_each(Vec::clear);
    for &guide in cells.iter().flat_map(|&cell| triangles.guides_in(cell)) {
        let p = energy.guides[guide as usize].at.position;
        guides[usize::from(doubled_area(v, u, p) > 0.0)].push(guide);
    }
    let old = [
        energy.of_cell([v, a, b], triangles.guides_in(cells[0])),
        energy.of_cell([u, b, a], triangles.guides_in(cells[1])),
    ];
    let new = [energy.of_cell([v, a, u], &guides[0]), energy.of_cell([u, b, v], &guides[1])];
    let least = |pair: [CellCost; 2]| pair[0].sine.min(pair[1].sine);
    energy.allows(least(old), least(new))
        && new[0].cost + new[1].cost < old[0].cost + old[1].cost - LEAST_GAIN
}
