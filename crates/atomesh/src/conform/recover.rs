//! Edges that cross features, and what is done about them.

use rayon::prelude::*;

use crate::crests::{Bins, Pieces};
use crate::fields::NominalDistance;
use crate::geometry::{Point, distance_squared};
use crate::lattice::Lattice;
use crate::mesh::Mesh;

use super::facets::pieces_at;

/// A new atom is as far as this from the atoms of its piece, over d.
const CLEAR: f64 = 0.45;
/// New atoms are as far as this from each other, over d.
const THINNED: f64 = 0.6;
/// An end of an edge within this of a piece is on it, in mean steps.
const ON: f64 = 0.1;

/// An edge that crosses a piece.
#[derive(Clone, Copy, Debug)]
pub(super) struct Crossing<const D: usize> {
    pub ends: [u32; 2],
    /// How far the ends are from the piece.
    pub heights: [f64; 2],
    pub piece: u32,
    pub place: Point<D>,
}

/// The edges that cross a piece between their ends, ascending by ends.
pub(super) fn crossings<const D: usize>(mesh: &Mesh<D>, pieces: &Pieces<D>) -> Vec<Crossing<D>> {
    let points = mesh.points();
    let step = pieces.step();
    let mut edges: Vec<[u32; 2]> = Vec::with_capacity(mesh.corners().len());
    for cell in mesh.cells() {
        for (i, &a) in cell.iter().enumerate() {
            edges.extend(cell[..i].iter().map(|&b| [a.min(b), a.max(b)]));
        }
    }
    edges.par_sort_unstable();
    edges.dedup();
    let crossing = |ends: &[u32; 2]| {
        let [a, b] = ends.map(|end| points[end as usize]);
        let length = distance_squared(&a, &b).sqrt();
        let middle = std::array::from_fn(|k| 0.5 * (a[k] + b[k]));
        let reach = 0.5 * length + 2.0 * step;
        pieces.near(&middle, reach).into_iter().find_map(|piece| {
            let far = length + 3.0 * step;
            let height =
                |p: &Point<D>| pieces.foot_on(piece, p, far).map(|foot| foot.signed_distance(p));
            let heights = [height(&a)?, height(&b)?];
            if heights[0] * heights[1] >= 0.0 || heights.iter().any(|h| h.abs() <= ON * step) {
                return None;
            }
            let mut share = heights[0] / (heights[0] - heights[1]);
            let (mut low, mut high) = ((0.0, heights[0]), (1.0, heights[1]));
            let mut place = a;
            for _ in 0..4 {
                place = std::array::from_fn(|k| a[k] + share * (b[k] - a[k]));
                let foot = pieces.foot_on(piece, &place, far)?;
                let here = foot.signed_distance(&place);
                if here.abs() < 0.02 * step {
                    if foot.beyond > 0.0 {
                        return None;
                    }
                    place = foot.position;
                    break;
                }
                if here * low.1 > 0.0 {
                    low = (share, here)
                } else {
                    high = (share, here)
                }
                share = low.0 + (high.0 - low.0) * low.1 / (low.1 - high.1);
            }
            let foot = pieces.foot_on(piece, &place, 3.0 * step)?;
            let is_there = foot.beyond == 0.0
                && distance_squared(&foot.position, &place) < (0.5 * step).powi(2);
            is_there.then_some(Crossing { ends: *ends, heights, piece, place: foot.position })
        })
    };
    edges.par_iter().with_min_len(1 << 8).filter_map(crossing).collect()
}

/// Puts atoms at crossings that are far enough from the piece's atoms; where none is, takes away the free ends nearer
/// to the pieces. Gives the lattice and whether it has changed.
pub(super) fn recovered<const D: usize>(
    mut lattice: Lattice<D>,
    crossings: &[Crossing<D>],
    pieces: &Pieces<D>,
    distance: &NominalDistance<D>,
) -> (Lattice<D>, bool) {
    let bounds = *lattice.bounds();
    let of_atoms = pieces_at(lattice.atoms(), pieces);
    let mut bins = Bins::new(&bounds, distance.least(), lattice.len());
    let mut on: Vec<(Point<D>, Vec<u32>, bool)> = Vec::new();
    for (atom, pieces) in lattice.atoms().iter().zip(&of_atoms) {
        if !pieces.is_empty() {
            bins.push(atom);
            on.push((*atom, pieces.clone(), false));
        }
    }
    let mut is_changed = false;
    for crossing in crossings {
        let d = distance.at(&crossing.place);
        let mut is_free = true;
        bins.near(&crossing.place, THINNED * d, |i| {
            let (place, pieces, is_new) = &on[i];
            let least = match (is_new, pieces.contains(&crossing.piece)) {
                (true, true) => THINNED,
                _ => CLEAR,
            };
            is_free &= distance_squared(place, &crossing.place) >= (least * d).powi(2);
        });
        if is_free {
            let place = bounds.clamp(&crossing.place);
            bins.push(&place);
            on.push((place, vec![crossing.piece], true));
            lattice.push(place, bounds.freedom(&place), 0.0);
            is_changed = true;
        }
    }
    if is_changed {
        return (lattice, true);
    }
    let mut goes = vec![false; lattice.len()];
    for Crossing { ends, heights, .. } in crossings {
        let nearer = usize::from(heights[1].abs() < heights[0].abs());
        let may_go = |end: u32| {
            lattice.temperature(end as usize) > 0.0 && lattice.freedom_in_box(end as usize) != 0
        };
        if ends.iter().any(|&end| goes[end as usize]) {
            continue;
        }
        let end = [ends[nearer], ends[1 - nearer]].into_iter().find(|&end| may_go(end));
        if let Some(end) = end {
            goes[end as usize] = true;
            is_changed = true;
        }
    }
    (lattice.retained(|i| !goes[i]), is_changed)
}
