//! The facets of a mesh that make up features.
//!
//! A piece divides the cells near it into those on the side of its normal and those on the other. A facet between the
//! two whose corners all lie on the piece belongs to it. So a piece is one sheet: as the border of a set of cells it
//! has an end or border only where the piece ends, or is not met.

use rayon::prelude::*;

use crate::crests::Pieces;
use crate::fields::NominalDistance;
use crate::geometry::{Bounds, Point};
use crate::mesh::Mesh;

/// A point within this of a piece is on it, in mean steps: within the box, and on its sides, where pieces are led on.
const ON: f64 = 0.25;
const ON_AT_SIDE: f64 = 0.35;
/// The same for other pieces than the nearest: where they cross, a place on both is known less well.
const ON_AT_CROSSING: f64 = 0.5;
/// A point this far beyond the end of a piece still is on it, in mean steps.
const BEYOND: f64 = 0.5;

/// A facet that belongs to a feature.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FeatureFacet<const D: usize> {
    /// Its corners, ascending.
    pub corners: [u32; D],
    /// The piece.
    pub piece: u32,
    /// Whether the normal of the facet with its corners in this order is on the side of the piece's.
    pub agrees: bool,
}

/// The pieces that each place lies on.
pub(super) fn pieces_at<const D: usize>(
    places: &[Point<D>],
    pieces: &Pieces<D>,
    bounds: &Bounds<D>,
) -> Vec<Vec<u32>> {
    let step = pieces.step();
    let of = |p: &Point<D>| -> Vec<u32> {
        let is_inner = bounds.freedom(p).count_ones() as usize == D;
        let is_near_side = (0..D)
            .any(|k| (p[k] - bounds.min[k]).min(bounds.max[k] - p[k]) < pieces.led_on() * step);
        let on = if is_inner { ON } else { ON_AT_SIDE };
        let reach = if is_near_side { pieces.led_on() + 2.0 } else { 3.0 };
        let height = |piece: u32| {
            let foot = pieces.foot_on(piece, p, reach * step)?;
            let is_there = foot.beyond <= BEYOND * step;
            is_there.then_some((piece, foot.signed_distance(p).abs() / step))
        };
        let near: Vec<(u32, f64)> =
            pieces.near(p, reach * step).into_iter().filter_map(height).collect();
        let least = near.iter().map(|(_, height)| *height).fold(f64::INFINITY, f64::min);
        let most = if least <= on { on.max(ON_AT_CROSSING) } else { on };
        near.into_iter().filter(|(_, height)| *height <= most).map(|(piece, _)| piece).collect()
    };
    places.par_iter().with_min_len(1 << 8).map(of).collect()
}

/// Whether each place lies on a piece: atoms there stay where they are while a mesh is improved.
pub(crate) fn are_on_pieces<const D: usize>(
    places: &[Point<D>],
    pieces: &Pieces<D>,
    bounds: &Bounds<D>,
) -> Vec<bool> {
    pieces_at(places, pieces, bounds).iter().map(|on| !on.is_empty()).collect()
}

/// The facets of all pieces, ascending by corners; a facet of several pieces is the strongest's.
pub fn feature_facets<const D: usize>(
    mesh: &Mesh<D>,
    pieces: &Pieces<D>,
    distance: &NominalDistance<D>,
) -> Vec<FeatureFacet<D>> {
    if pieces.is_empty() {
        return Vec::new();
    }
    let bounds = Bounds::of(mesh.points()).unwrap_or(Bounds { min: [0.0; D], max: [0.0; D] });
    let of_points = pieces_at(mesh.points(), pieces, &bounds);
    let corners = |cell: u32| {
        let first = cell as usize * (D + 1);
        &mesh.corners()[first..first + D + 1]
    };
    let side = |cell: u32, piece: u32| {
        let mut middle = [0.0; D];
        for &corner in corners(cell) {
            let p = &mesh.points()[corner as usize];
            (0..D).for_each(|k| middle[k] += p[k] / (D + 1) as f64);
        }
        let reach = 2.0 * distance.at(&middle) + 3.0 * pieces.step();
        pieces.foot_on(piece, &middle, reach).map(|foot| foot.signed_distance(&middle))
    };
    let facets = mesh.facets();
    let of = |facet: &crate::mesh::Facet<D>| {
        let first = &of_points[facet.corners[0] as usize];
        if first.is_empty() {
            return None;
        }
        let neighbour = facet.neighbour?;
        let is_on = |piece: &u32| {
            facet.corners[1..].iter().all(|&corner| of_points[corner as usize].contains(piece))
        };
        first.iter().copied().filter(is_on).find_map(|piece| {
            let sides = [side(facet.cell, piece)?, side(neighbour, piece)?];
            if (sides[0] > 0.0) == (sides[1] > 0.0) {
                return None;
            }
            // the normal of the facet as the cell has it points out of the cell
            let at = corners(facet.cell).iter().position(|c| !facet.corners.contains(c))?;
            let outward = mesh.facet_normal(&mesh.facet_of(facet.cell as usize, at));
            let own = mesh.facet_normal(&facet.corners);
            let is_outward = crate::geometry::dot(&outward, &own) > 0.0;
            Some(FeatureFacet {
                corners: facet.corners,
                piece,
                agrees: is_outward == (sides[0] < 0.0),
            })
        })
    };
    facets.par_iter().with_min_len(1 << 8).filter_map(of).collect()
}
