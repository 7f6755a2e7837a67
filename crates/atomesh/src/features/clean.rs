//! Dropping chosen facets that wrap a cell or make small pieces, and adding facets that close gaps.

use std::collections::{HashMap, HashSet};

use super::ridges::{Ridges, key};
use super::{FacetField, FeatureFacetOptions, corners_of, measure_and_mean};
use crate::geometry::{Point, difference, dot};
use crate::mesh::Mesh;

/// Rounds of dropping at most. Each but the last drops all pieces of one kind and size, so that few are needed.
const MOST_ROUNDS: usize = 1000;

/// The least cosine of the angle by which a facet that closes a gap turns from those that it joins: 60°.
const LEAST_COSINE: f64 = 0.5;

/// The chosen facets, less one of each cell all of whose facets are chosen: that with the highest mean of b. A feature
/// passes through a cell; it does not wrap it.
pub(super) fn unwrap_cells<const D: usize>(field: &FacetField<D>, chosen: Vec<u32>) -> Vec<u32> {
    let cells = |facet: u32| {
        let facet = &field.facets()[facet as usize];
        std::iter::once(facet.cell).chain(facet.neighbour)
    };
    let cell_count = chosen.iter().flat_map(|&f| cells(f)).max().map_or(0, |c| c as usize + 1);
    // how many facets of each cell are chosen, and the one of the highest mean, the last of equal ones
    let mut of_cells = vec![(0, 0_u32); cell_count];
    for &facet in &chosen {
        for cell in cells(facet) {
            let (count, worst) = &mut of_cells[cell as usize];
            if *count == 0 || field.mean()[facet as usize] >= field.mean()[*worst as usize] {
                *worst = facet;
            }
            *count += 1;
        }
    }
    let is_worst_of_all = |cell: u32, facet: u32| of_cells[cell as usize] == (D + 1, facet);
    chosen
        .into_iter()
        .filter(|&facet| !cells(facet).any(|cell| is_worst_of_all(cell, facet)))
        .collect()
}

/// The chosen facets without small pieces. Dropping one may join others into one large piece, so little is dropped at a
/// time: first, of pieces with the same rim, all but that of the lowest mean of b; then those of fewest facets, the
/// highest mean first, and never two that meet in one round.
pub(super) fn drop_small<const D: usize>(
    mesh: &Mesh<D>,
    field: &FacetField<D>,
    mut chosen: Vec<u32>,
    options: &FeatureFacetOptions,
) -> Vec<u32> {
    for _ in 0..MOST_ROUNDS {
        let dropped = next_to_drop(mesh, field, &chosen, options);
        if dropped.is_empty() {
            break;
        }
        let mut keep = vec![true; chosen.len()];
        dropped.iter().for_each(|&at| keep[at as usize] = false);
        let mut keep = keep.into_iter();
        chosen.retain(|_| keep.next().unwrap_or(true));
    }
    chosen
}

/// A small piece: the ridges where it meets others, its mean of b, and its facets by their places.
struct Small {
    rim: Vec<u64>,
    mean: f64,
    facets: Vec<u32>,
    /// Whether it joins others: it has no free end (2-D) or side (3-D).
    joins: bool,
}

/// The facets, by place, that one round drops.
fn next_to_drop<const D: usize>(
    mesh: &Mesh<D>,
    field: &FacetField<D>,
    chosen: &[u32],
    options: &FeatureFacetOptions,
) -> Vec<u32> {
    let ridges = Ridges::new(&corners_of(field, chosen));
    let mut small = Vec::new();
    for facets in ridges.pieces() {
        let values = facets.iter().map(|&at| {
            let facet = chosen[at as usize] as usize;
            (&field.facets()[facet].corners, field.mean()[facet])
        });
        let (measure, mean) = measure_and_mean(mesh, values);
        if facets.len() < options.min_facets || measure < options.min_measure {
            let joins = has_no_free_side(&ridges, &facets);
            small.push(Small { rim: rim(&ridges, &facets), mean, facets, joins });
        }
    }
    // the deepest first, and of equal ones that with the lowest facets
    small.sort_by(|a, b| {
        a.rim.cmp(&b.rim).then(a.mean.total_cmp(&b.mean)).then(a.facets.cmp(&b.facets))
    });
    // two points bound a path in the plane, three edges or more a patch in space
    let have_one_rim = |pair: &&[Small]| pair[0].rim.len() >= D && pair[0].rim == pair[1].rim;
    let doubles = small.windows(2).filter(have_one_rim);
    let dropped: Vec<u32> = doubles.flat_map(|pair| pair[1].facets.iter().copied()).collect();
    if !dropped.is_empty() {
        return dropped;
    }
    small.retain(|piece| !piece.joins);
    let fewest = small.iter().map(|piece| piece.facets.len()).min().unwrap_or(0);
    small.retain(|piece| piece.facets.len() == fewest);
    small.sort_by(|a, b| b.mean.total_cmp(&a.mean).then(a.facets.cmp(&b.facets)));
    let mut touched = HashSet::new();
    let mut dropped = Vec::new();
    for piece in small {
        if !piece.rim.iter().any(|ridge| touched.contains(ridge)) {
            touched.extend(piece.rim);
            dropped.extend(piece.facets);
        }
    }
    dropped
}

/// Whether another facet meets each side of a piece.
fn has_no_free_side<const D: usize>(ridges: &Ridges<D>, piece: &[u32]) -> bool {
    piece.iter().all(|&at| (0..D).all(|opposite| ridges.count(at, opposite) > 1))
}

/// The ridges where a piece meets others, ascending.
fn rim<const D: usize>(ridges: &Ridges<D>, piece: &[u32]) -> Vec<u64> {
    let sides = piece.iter().flat_map(|&at| (0..D).map(move |opposite| (at, opposite)));
    let joined = sides.filter(|&(at, opposite)| ridges.count(at, opposite) > 2);
    let mut joined: Vec<u64> = joined.map(|(at, opposite)| ridges.key(at, opposite)).collect();
    joined.sort_unstable();
    joined.dedup();
    joined
}

/// The chosen facets, and those that join free ridges of them without turning by more than 60°: edges between two free
/// ends (2-D), triangles with two or three free sides (3-D). Facets of the lowest mean of b come first; a ridge is
/// joined once. The result ascends.
pub(super) fn close_gaps<const D: usize>(
    mesh: &Mesh<D>,
    field: &FacetField<D>,
    mut chosen: Vec<u32>,
) -> Vec<u32> {
    // the only facet at each free ridge
    let ridges = Ridges::new(&corners_of(field, &chosen));
    let mut free: HashMap<u64, u32> = HashMap::new();
    for (at, &facet) in chosen.iter().enumerate() {
        for opposite in (0..D).filter(|&k| ridges.count(at as u32, k) == 1) {
            free.insert(ridges.key(at as u32, opposite), facet);
        }
    }
    let known: HashSet<u32> = chosen.iter().copied().collect();
    let mut candidates: Vec<(f64, u32)> = (0..field.facets().len() as u32)
        .filter(|facet| !known.contains(facet))
        .filter(|&facet| free_sides(field, facet, &free).count() >= 2)
        .map(|facet| (field.mean()[facet as usize], facet))
        .collect();
    candidates.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    for (_, facet) in candidates {
        let sides: Vec<FreeSide> = free_sides(field, facet, &free).collect();
        let goes_on =
            |side: &FreeSide| cosine(mesh, field, [facet, side.facet], side.ridge) >= LEAST_COSINE;
        if sides.len() < 2 || !sides.iter().all(goes_on) {
            continue;
        }
        for side in &sides {
            free.remove(&side.ridge);
        }
        chosen.push(facet);
    }
    chosen.sort_unstable();
    chosen
}

/// A ridge that only one chosen facet has, and that facet.
struct FreeSide {
    ridge: u64,
    facet: u32,
}

/// The free ridges among a facet's.
fn free_sides<'a, const D: usize>(
    field: &'a FacetField<D>,
    facet: u32,
    free: &'a HashMap<u64, u32>,
) -> impl Iterator<Item = FreeSide> + 'a {
    let corners = &field.facets()[facet as usize].corners;
    (0..D).filter_map(move |opposite| {
        let ridge = key(corners, opposite);
        free.get(&ridge).map(|&facet| FreeSide { ridge, facet })
    })
}

/// The cosine of the angle by which one facet turns from the other at the ridge that they share: 1 if they lie in one
/// line or plane.
fn cosine<const D: usize>(
    mesh: &Mesh<D>,
    field: &FacetField<D>,
    facets: [u32; 2],
    ridge: u64,
) -> f64 {
    let [a, b] = facets.map(|facet| {
        let corners = &field.facets()[facet as usize].corners;
        let off = (0..D).find(|&k| key(corners, k) == ridge).unwrap_or(0);
        away(mesh, corners, off)
    });
    let lengths = (dot(&a, &a) * dot(&b, &b)).sqrt();
    if lengths > 0.0 { -dot(&a, &b) / lengths } else { -1.0 }
}

/// The vector from the ridge opposite to a corner to that corner, at right angles to the ridge.
fn away<const D: usize>(mesh: &Mesh<D>, corners: &[u32; D], off: usize) -> Point<D> {
    let at = |k: usize| &mesh.points()[corners[k] as usize];
    let first = (off + 1) % D;
    let mut v = difference(at(off), at(first));
    for k in (0..D).filter(|&k| k != off && k != first) {
        let along = difference(at(k), at(first));
        let share = dot(&v, &along) / dot(&along, &along);
        (0..D).for_each(|axis| v[axis] -= share * along[axis]);
    }
    v
}
