//! Slivers, cells below the floor on dihedral angles, are swapped away, or their points moved, until none is left or
//! nothing helps.
//!
//! For each sliver, worst first, all ways are compared to take one of its edges out of the mesh (3-2 and 4-4 swaps,
//! and so on for more cells around the edge) and to put an edge through one of its facets (2-3 swaps). The one that
//! leaves the greatest least angle is taken, if that is more than before. Where there is none, the sliver's corners
//! are moved ([`super::smooth`]).

use super::edge_ring::{EdgeRing, Filling};
use super::smooth::smooth;
use super::tetrahedra::{NONE, Tetrahedra};

/// By how much the greatest cosine must fall for a swap: far above rounding, so that swaps cannot go in circles.
const GAIN: f64 = 1e-6;

/// What was done to a part.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Effort {
    pub swaps: usize,
    pub moves: usize,
    pub rounds: usize,
    /// Whether the floor turned out to be out of reach.
    pub gave_up: bool,
}

/// The least number and the least share of cells below the floor that tell of a floor out of reach, not of a few bad
/// cells, if a round mends less than a tenth of them. Floors of 15° leave 0.0001 after the first round.
const MANY: (usize, f64) = (100, 0.02);

/// Whether too many cells are left below the floor by a round, for how many there were before.
fn is_hopeless(before: usize, left: usize, cells: usize) -> bool {
    before > 0 && left > MANY.0 && left as f64 > MANY.1 * cells as f64 && 10 * left > 9 * before
}

/// Swaps and moves until no cell has a cosine above `cosine_limit`, a round has changed nothing, or hardly any of many
/// cells: a floor out of reach is given up for good.
pub(super) fn remove_slivers(
    tetrahedra: &mut Tetrahedra,
    cosine_limit: f64,
    rounds: usize,
    effort: &mut Effort,
) {
    if effort.gave_up {
        return;
    }
    let mut slivers: Vec<u32> = Vec::new();
    for _ in 0..rounds {
        let before = slivers.len();
        slivers.clear();
        let cells = 0..tetrahedra.slot_count();
        slivers.extend(cells.filter(|&cell| is_sliver(tetrahedra, cell, cosine_limit)));
        effort.gave_up |= is_hopeless(before, slivers.len(), tetrahedra.slot_count() as usize);
        if effort.gave_up {
            return;
        }
        let cosine = |c: u32| tetrahedra.shapes[c as usize].cosine;
        slivers.sort_by(|&a, &b| cosine(b).total_cmp(&cosine(a)));
        let before = (effort.swaps, effort.moves);
        for &cell in &slivers {
            if !is_sliver(tetrahedra, cell, cosine_limit) {
                continue;
            }
            if swap_away(tetrahedra, cell) {
                effort.swaps += 1;
                continue;
            }
            for corner in tetrahedra.corners[cell as usize] {
                if !is_sliver(tetrahedra, cell, cosine_limit) {
                    break;
                }
                effort.moves += usize::from(smooth(tetrahedra, corner, cosine_limit));
            }
        }
        effort.rounds += 1;
        if (effort.swaps, effort.moves) == before {
            break;
        }
    }
}

/// Whether a slot holds a cell below the floor.
fn is_sliver(tetrahedra: &Tetrahedra, cell: u32, cosine_limit: f64) -> bool {
    tetrahedra.is_alive(cell) && tetrahedra.shapes[cell as usize].cosine > cosine_limit
}

/// A swap that takes a cell away.
enum Swap {
    Edge(EdgeRing, Filling),
    /// Through this facet of the cell.
    Facet(usize),
}

/// Makes the swap that leaves the least greatest cosine, if that is less than before. Says whether there is one.
fn swap_away(tetrahedra: &mut Tetrahedra, cell: u32) -> bool {
    let worst = tetrahedra.shapes[cell as usize].cosine;
    let (mut best, mut least) = (None, -worst + GAIN);
    for i in 0..3 {
        for j in i + 1..4 {
            let Some(ring) = EdgeRing::around(tetrahedra, cell, i, j) else { continue };
            let worth = |ring: &EdgeRing, i, k, j| {
                let [a, b] = ring.pair(i, k, j);
                let first = tetrahedra.shape_of(&a).cosine;
                if -first <= least { -first } else { -first.max(tetrahedra.shape_of(&b).cosine) }
            };
            if let Some(filling) = ring.fill(least, worth, f64::min, f64::INFINITY) {
                least = filling.worth;
                best = Some(Swap::Edge(ring, filling));
            }
        }
    }
    for k in 0..4 {
        if let Some(cells) = through_facet(tetrahedra, cell, k) {
            let worth =
                cells.iter().map(|c| -tetrahedra.shape_of(c).cosine).fold(f64::INFINITY, f64::min);
            if worth > least {
                least = worth;
                best = Some(Swap::Facet(k));
            }
        }
    }
    match best {
        Some(Swap::Edge(ring, filling)) => remove_edge(tetrahedra, &ring, &filling),
        Some(Swap::Facet(k)) => remove_facet(tetrahedra, cell, k),
        None => return false,
    }
    true
}

/// The cells around the edge from the corner opposite facet k to the corner beyond it.
pub(super) fn through_facet(tetrahedra: &Tetrahedra, cell: u32, k: usize) -> Option<[[u32; 4]; 3]> {
    let beyond = tetrahedra.neighbours[cell as usize][k];
    if beyond == NONE {
        return None;
    }
    let corners = &tetrahedra.corners[cell as usize];
    let (d, e) = (corners[k], tetrahedra.corners[beyond as usize][tetrahedra.back(cell, k)]);
    // (d, p, q, r) is positive: an odd place takes an odd number of exchanges to the front
    let [mut p, mut q] = [corners[(k + 1) & 3], corners[(k + 2) & 3]];
    let r = corners[(k + 3) & 3];
    if k % 2 == 1 {
        std::mem::swap(&mut p, &mut q);
    }
    Some([[d, p, q, e], [d, q, r, e], [d, r, p, e]])
}

/// Fills the place of the cells around an edge.
pub(super) fn remove_edge(tetrahedra: &mut Tetrahedra, ring: &EdgeRing, filling: &Filling) {
    let mut cells = Vec::with_capacity(12);
    ring.filled(filling, &mut cells);
    tetrahedra.replace(ring.cells(), &cells);
}

/// Puts an edge through facet k of a cell.
pub(super) fn remove_facet(tetrahedra: &mut Tetrahedra, cell: u32, k: usize) {
    if let Some(cells) = through_facet(tetrahedra, cell, k) {
        let beyond = tetrahedra.neighbours[cell as usize][k];
        tetrahedra.replace(&[cell, beyond], &cells);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn many_cells_that_hardly_any_round_mends_are_given_up() {
        // rounds of a ball of 190,000 cells, floors of 40° and 15°
        assert!(!is_hopeless(0, 6899, 49_475)); // nothing has been tried
        assert!(!is_hopeless(6899, 5436, 49_475));
        assert!(is_hopeless(5436, 5276, 49_475));
        assert!(!is_hopeless(12, 12, 49_475));
        assert!(!is_hopeless(90, 90, 200)); // few cells take little time
    }
}
