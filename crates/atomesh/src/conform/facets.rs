//! The facets of a mesh that make up features.
//!
//! A piece divides the cells near it into those on the side of its normal and those on the other. A facet between the
//! two whose corners all lie on the piece belongs to it. So a piece is one sheet: as the border of a set of cells it
//! has an end or border only where the piece ends, or is not met.

use crate::parallel::prelude::*;

use crate::crests::Pieces;
use crate::fields::NominalDistance;
use crate::geometry::{Bounds, Point, dot};
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
    let of = |p: &Point<D>| pieces_at_place(p, pieces, bounds);
    places.par_iter().with_min_len(1 << 8).map(of).collect()
}

/// The same, where the pieces near each place and how far it is from them are known.
pub(super) fn pieces_of<const D: usize>(
    places: &[Point<D>],
    heights: &[Vec<(u32, f64)>],
    pieces: &Pieces<D>,
    bounds: &Bounds<D>,
) -> Vec<Vec<u32>> {
    let on = ON.max(ON_AT_SIDE) * pieces.step();
    let of = |(p, heights): (&Point<D>, &Vec<(u32, f64)>)| {
        let may_be_on = heights.iter().any(|(_, height)| height.abs() <= on);
        if may_be_on { pieces_at_place(p, pieces, bounds) } else { Vec::new() }
    };
    places.par_iter().zip(heights).with_min_len(1 << 8).map(of).collect()
}

/// The pieces that a place lies on.
fn pieces_at_place<const D: usize>(
    p: &Point<D>,
    pieces: &Pieces<D>,
    bounds: &Bounds<D>,
) -> Vec<u32> {
    let step = pieces.step();
    let is_inner = bounds.freedom(p).count_ones() as usize == D;
    let is_near_side =
        (0..D).any(|k| (p[k] - bounds.min[k]).min(bounds.max[k] - p[k]) < pieces.led_on() * step);
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
    let of = |sides: &[Side<D>]| {
        let [own, other] = sides else { return None };
        let facet = own.corners;
        let common = |piece: &u32| {
            facet[1..].iter().all(|&corner| of_points[corner as usize].contains(piece))
        };
        of_points[facet[0] as usize].iter().copied().filter(common).find_map(|piece| {
            let sides = [side(own.cell, piece)?, side(other.cell, piece)?];
            if (sides[0] > 0.0) == (sides[1] > 0.0) {
                return None;
            }
            // the normal of the facet as the cell has it points out of the cell
            let outward = mesh.facet_normal(&mesh.facet_out_of(own.cell, &facet)?);
            let is_outward = dot(&outward, &mesh.facet_normal(&facet)) > 0.0;
            Some(FeatureFacet { corners: facet, piece, agrees: is_outward == (sides[0] < 0.0) })
        })
    };
    let sides = sides_on_pieces(mesh, &of_points);
    let facets: Vec<&[Side<D>]> = sides.chunk_by(|a, b| a.corners == b.corners).collect();
    facets.par_iter().with_min_len(1 << 6).filter_map(|sides| of(sides)).collect()
}

/// A facet as one of its cells has it.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Side<const D: usize> {
    /// Its corners, ascending.
    corners: [u32; D],
    cell: u32,
}

/// The facets all of whose corners lie on one piece, by ascending corners and cells.
fn sides_on_pieces<'m, const D: usize>(mesh: &'m Mesh<D>, of_points: &[Vec<u32>]) -> Vec<Side<D>> {
    let is_on_one = &|corners: &[u32; D]| {
        let mut common = of_points[corners[0] as usize].iter();
        common.any(|piece| corners[1..].iter().all(|&c| of_points[c as usize].contains(piece)))
    };
    let of_cell = |(cell, corners): (usize, &'m [u32])| {
        let on = corners.iter().filter(|&&corner| !of_points[corner as usize].is_empty()).count();
        let facets = if on < D { 0 } else { D + 1 };
        let side = (0..facets).map(move |opposite| {
            let mut facet: [u32; D] =
                std::array::from_fn(|k| corners[k + usize::from(k >= opposite)]);
            facet.sort_unstable();
            Side { corners: facet, cell: cell as u32 }
        });
        side.filter(move |side| is_on_one(&side.corners))
    };
    let cells = mesh.corners().par_chunks_exact(D + 1).enumerate().with_min_len(1 << 10);
    let mut sides: Vec<Side<D>> = cells.flat_map_iter(of_cell).collect();
    sides.par_sort_unstable();
    sides
}
