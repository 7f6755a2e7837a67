//! What is dropped from chosen facets, and what is added to them.

use std::collections::{HashMap, HashSet};

use super::ridges::{Ridges, key};
use super::{FacetField, FeatureFacetOptions, measure_of};
use crate::geometry::{Point, difference, dot};
use crate::mesh::Mesh;

/// Rounds of dropping; each but the last drops all of one kind and size, so that few are needed.
const MOST_ROUNDS: usize = 1000;

/// The least cosine of the angle by which a facet that closes a gap turns from those that it joins: 60°.
const LEAST_COSINE: f64 = 0.5;

/// The length or area of facets, and the mean of b over them.
pub(super) fn measure_and_mean<const D: usize>(
    mesh: &Mesh<D>,
    field: &FacetField<D>,
    facets: impl Iterator<Item = u32>,
) -> (f64, f64) {
    let (mut measure, mut sum) = (0.0, 0.0);
    for facet in facets {
        let part = measure_of(mesh, &field.facets()[facet as usize].corners);
        measure += part;
        sum += part * field.mean()[facet as usize];
    }
    (measure, if measure > 0.0 { sum / measure } else { 0.0 })
}

/// The chosen facets without the worse of small pieces that lead the same way, and without small pieces that
/// end free. What is left may then be one piece, so that little is dropped at a time: twins before free ends,
/// of these the pieces of fewest facets first, until nothing is to be dropped.
pub(super) fn drop_small<const D: usize>(
    mesh: &Mesh<D>,
    field: &FacetField<D>,
    mut chosen: Vec<u32>,
    options: &FeatureFacetOptions,
) -> Vec<u32> {
    for _ in 0..MOST_ROUNDS {
        let dropped = worst(mesh, field, &chosen, options);
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

/// The facets, by place, that one round drops.
fn worst<const D: usize>(
    mesh: &Mesh<D>,
    field: &FacetField<D>,
    chosen: &[u32],
    options: &FeatureFacetOptions,
) -> Vec<u32> {
    let ridges = Ridges::new(field, chosen);
    // the small pieces that end free, and those between others by their rims
    let (mut free, mut joined) = (Vec::new(), Vec::new());
    for piece in ridges.pieces() {
        let facets = piece.iter().map(|&at| chosen[at as usize]);
        let (measure, mean) = measure_and_mean(mesh, field, facets);
        if piece.len() < options.min_facets || measure < options.min_measure {
            match rim(&ridges, &piece) {
                Rim::Free => free.push(piece),
                Rim::Joined(rim) => joined.push((rim, mean, piece)),
            }
        }
    }
    // the deepest first, and of equal ones that with the lowest facets
    joined.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).then(a.2.cmp(&b.2)));
    let twins = joined.windows(2).filter(|pair| pair[0].0 == pair[1].0);
    let dropped: Vec<u32> = twins.flat_map(|pair| pair[1].2.iter().copied()).collect();
    if !dropped.is_empty() {
        return dropped;
    }
    let fewest = free.iter().map(Vec::len).min().unwrap_or(0);
    free.into_iter().filter(|piece| piece.len() == fewest).flatten().collect()
}

/// How a piece ends.
enum Rim {
    /// At least one ridge is its own alone, or it has no rim at all.
    Free,
    /// Everywhere at other pieces: the ridges, ascending.
    Joined(Vec<u64>),
}

fn rim<const D: usize>(ridges: &Ridges<D>, piece: &[u32]) -> Rim {
    let mut joined = Vec::new();
    for &at in piece {
        for opposite in 0..D {
            match ridges.count(at, opposite) {
                1 => return Rim::Free,
                2 => {}
                _ => joined.push(ridges.key(at, opposite)),
            }
        }
    }
    joined.sort_unstable();
    joined.dedup();
    if joined.is_empty() { Rim::Free } else { Rim::Joined(joined) }
}

/// The chosen facets, ascending, and those that join free ridges of them without turning by more than 60°:
/// edges between two free ends (2-D), triangles with two or three free sides (3-D). The lowest mean of b
/// comes first; a ridge is joined once.
pub(super) fn close_gaps<const D: usize>(
    mesh: &Mesh<D>,
    field: &FacetField<D>,
    mut chosen: Vec<u32>,
) -> Vec<u32> {
    // the only facet at each free ridge
    let ridges = Ridges::new(field, &chosen);
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
        let sides: Vec<(u64, u32)> = free_sides(field, facet, &free).collect();
        let goes_on = |&(ridge, other): &(u64, u32)| {
            cosine(mesh, field, [facet, other], ridge) >= LEAST_COSINE
        };
        if sides.len() < 2 || !sides.iter().all(goes_on) {
            continue;
        }
        for (ridge, _) in &sides {
            free.remove(ridge);
        }
        chosen.push(facet);
    }
    chosen.sort_unstable();
    chosen
}

/// The free ridges among a facet's, each with the chosen facet there.
fn free_sides<'a, const D: usize>(
    field: &'a FacetField<D>,
    facet: u32,
    free: &'a HashMap<u64, u32>,
) -> impl Iterator<Item = (u64, u32)> + 'a {
    let corners = &field.facets()[facet as usize].corners;
    (0..D).filter_map(move |opposite| {
        let ridge = key(corners, opposite);
        free.get(&ridge).map(|&other| (ridge, other))
    })
}

/// The cosine of the angle by which one facet turns from the other at the ridge that they share: 1 where they
/// go straight on.
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
