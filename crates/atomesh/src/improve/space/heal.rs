//! Cells of small dihedral angles are swapped away, or their points moved, until none is left or nothing helps.
//!
//! For each bad cell, worst first: of all ways to take an edge of it out of the mesh (2-3 or 4-4 swaps turned round,
//! and so on for more cells around the edge) and to put an edge through one of its facets, the one that leaves the
//! greatest least angle is taken, if that is more than before. Where there is none, its corners are moved
//! (see [`super::smooth`]).

use super::patch::{NONE, Patch};
use super::ring::{Filling, Ring};
use super::smooth::smooth;

/// How much less the greatest cosine must be after a swap: far above rounding, so that swaps cannot go in circles.
const GAIN: f64 = 1e-6;

/// What was done to a patch.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Effort {
    pub swaps: usize,
    pub moves: usize,
    pub rounds: usize,
}

/// Swaps and moves until no cell has a cosine above `floor`, or a round has changed nothing.
pub(super) fn heal(patch: &mut Patch, floor: f64, rounds: usize, effort: &mut Effort) {
    let mut bad: Vec<u32> = Vec::new();
    for _ in 0..rounds {
        bad.clear();
        bad.extend((0..patch.slot_count()).filter(|&c| is_bad(patch, c, floor)));
        let cosine = |c: u32| patch.shapes[c as usize].cosine;
        bad.sort_by(|&a, &b| cosine(b).total_cmp(&cosine(a)));
        let before = (effort.swaps, effort.moves);
        for &cell in &bad {
            if !is_bad(patch, cell, floor) {
                continue;
            }
            if swap_away(patch, cell) {
                effort.swaps += 1;
                continue;
            }
            for corner in patch.corners[cell as usize] {
                if !is_bad(patch, cell, floor) {
                    break;
                }
                effort.moves += usize::from(smooth(patch, corner, floor));
            }
        }
        effort.rounds += 1;
        if (effort.swaps, effort.moves) == before {
            break;
        }
    }
}

/// Whether a slot holds a cell that is worse than the floor.
fn is_bad(patch: &Patch, cell: u32, floor: f64) -> bool {
    patch.is_alive(cell) && patch.shapes[cell as usize].cosine > floor
}

/// A swap that makes the cell disappear.
enum Swap {
    Edge(Ring, Filling),
    Facet(u32, usize),
}

/// Makes the swap that leaves the least cosine, if it is less than before.
pub(super) fn swap_away(patch: &mut Patch, cell: u32) -> bool {
    let worst = patch.shapes[cell as usize].cosine;
    let (mut best, mut least) = (None, -worst + GAIN);
    for i in 0..3 {
        for j in i + 1..4 {
            let Some(ring) = Ring::around(patch, cell, i, j) else { continue };
            let worth = |ring: &Ring, i, k, j| {
                let [a, b] = ring.pair(i, k, j);
                let first = patch.shape_of(&a).cosine;
                if -first <= least { -first } else { -first.max(patch.shape_of(&b).cosine) }
            };
            if let Some(filling) = ring.fill(least, worth, f64::min, f64::INFINITY) {
                least = filling.worth;
                best = Some(Swap::Edge(ring, filling));
            }
        }
    }
    for k in 0..4 {
        if let Some(cells) = through_facet(patch, cell, k) {
            let worth =
                cells.iter().map(|c| -patch.shape_of(c).cosine).fold(f64::INFINITY, f64::min);
            if worth > least {
                least = worth;
                best = Some(Swap::Facet(cell, k));
            }
        }
    }
    match best {
        Some(Swap::Edge(ring, filling)) => remove_edge(patch, &ring, &filling),
        Some(Swap::Facet(cell, k)) => remove_facet(patch, cell, k),
        None => return false,
    }
    true
}

/// The cells around the edge from the corner opposite facet k to the corner beyond it.
pub(super) fn through_facet(patch: &Patch, cell: u32, k: usize) -> Option<[[u32; 4]; 3]> {
    let beyond = patch.neighbours[cell as usize][k];
    if beyond == NONE {
        return None;
    }
    let corners = &patch.corners[cell as usize];
    let (d, e) = (corners[k], patch.corners[beyond as usize][patch.back(cell, k)]);
    // (d, p, q, r) is positive: an odd place takes an odd number of exchanges to the front
    let [mut p, mut q] = [corners[(k + 1) & 3], corners[(k + 2) & 3]];
    let r = corners[(k + 3) & 3];
    if k % 2 == 1 {
        std::mem::swap(&mut p, &mut q);
    }
    Some([[d, p, q, e], [d, q, r, e], [d, r, p, e]])
}

/// Fills the place of the cells around an edge.
pub(super) fn remove_edge(patch: &mut Patch, ring: &Ring, filling: &Filling) {
    let mut cells = Vec::with_capacity(12);
    ring.filled(filling, &mut cells);
    patch.replace(ring.cells(), &cells);
}

/// Puts an edge through facet k of a cell.
pub(super) fn remove_facet(patch: &mut Patch, cell: u32, k: usize) {
    if let Some(cells) = through_facet(patch, cell, k) {
        let beyond = patch.neighbours[cell as usize][k];
        patch.replace(&[cell, beyond], &cells);
    }
}
