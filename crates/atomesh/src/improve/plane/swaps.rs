//! Swapping the diagonal of two triangles.

use super::energy::{Energy, doubled_area};
use super::moves::Mover;
use super::triangles::{Pair, Triangles};

/// The least gain that counts: less is rounding.
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
    pair: &Pair,
    guides: &mut [Vec<u32>; 2],
) -> bool {
    let Pair { cells, edge, apices } = *pair;
    let [a, b] = edge.map(|point| triangles.points[point as usize]);
    let [v, u] = apices.map(|point| triangles.points[point as usize]);
    if doubled_area(v, a, u) <= 0.0 || doubled_area(u, b, v) <= 0.0 {
        return false;
    }
    guides.iter_mut().for_each(Vec::clear);
    for &guide in cells.iter().flat_map(|&cell| triangles.guides_in(cell)) {
        let p = energy.guides[guide as usize].position;
        guides[usize::from(doubled_area(v, u, p) > 0.0)].push(guide);
    }
    let old = [
        energy.of_cell([v, a, b], triangles.guides_in(cells[0])),
        energy.of_cell([u, b, a], triangles.guides_in(cells[1])),
    ];
    let new = [energy.of_cell([v, a, u], &guides[0]), energy.of_cell([u, b, v], &guides[1])];
    let least = |pair: [(f64, f64); 2]| pair[0].1.min(pair[1].1);
    energy.allows(least(old), least(new)) && new[0].0 + new[1].0 < old[0].0 + old[1].0 - LEAST_GAIN
}
