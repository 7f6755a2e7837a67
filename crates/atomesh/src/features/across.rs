//! The facets across which what flows passes a feature: those between cells on its two sides.

use crate::parallel::prelude::*;

use crate::crests::{Pieces, tangents};
use crate::fields::NominalDistance;
use crate::geometry::{Bounds, Point};

/// How far the centre of a cell may be from a piece that one of its facets passes, over d.
const NEAR: f64 = 1.2;
/// How far the middle of such a facet may be from the piece, over d.
const OFF: f64 = 0.5;
/// How far beyond the end of a piece it may be, in mean steps.
const BEYOND: f64 = 0.5;
/// A piece is known, and not just led on, within this of one of its points, in mean steps.
const KNOWN: f64 = 3.0;
/// A place nearer to the end of its piece than this is at the end, over d.
const AT_END: f64 = 0.75;

/// A facet or face between two cells, in lattice coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Between<const D: usize> {
    /// The cells.
    pub cells: [u32; 2],
    /// Its middle.
    pub middle: Point<D>,
}

/// The feature between two cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Across {
    /// The piece.
    pub piece: u32,
    /// Whether the way from the first cell to the second goes along the piece's normal, not against it.
    pub is_along: bool,
}

/// Finds for each facet the piece on whose two sides its cells' centres lie, if one passes between them: the strongest of
/// several.
///
/// The facets of a piece are a sheet of the mesh's, as near to the piece as the mesh allows, that ends only where the
/// piece does. The same at any thread count.
pub fn across<const D: usize>(
    centres: &[Point<D>],
    facets: &[Between<D>],
    pieces: &Pieces<D>,
    distance: &NominalDistance<D>,
) -> Vec<Option<Across>> {
    let heights = heights(centres, pieces, distance);
    let is_on = |piece: u32, middle: &Point<D>| {
        let off = OFF * distance.at(middle);
        let foot = pieces.foot_on(piece, middle, off + pieces.apart() * pieces.step());
        foot.is_some_and(|foot| {
            let is_within = foot.beyond <= BEYOND * pieces.step();
            is_within && foot.signed_distance(middle).abs() <= off
        })
    };
    let of = |facet: &Between<D>| {
        let [first, second] = facet.cells.map(|cell| &heights[cell as usize]);
        first.iter().find_map(|&(piece, height)| {
            let &(_, other) = second.iter().find(|(other, _)| *other == piece)?;
            let is_between = (height > 0.0) != (other > 0.0) && is_on(piece, &facet.middle);
            is_between.then_some(Across { piece, is_along: other > 0.0 })
        })
    };
    facets.par_iter().with_min_len(1 << 8).map(of).collect()
}

/// The pieces near each place, in order, with the signed distance from each.
fn heights<const D: usize>(
    places: &[Point<D>],
    pieces: &Pieces<D>,
    distance: &NominalDistance<D>,
) -> Vec<Vec<(u32, f64)>> {
    let of = |p: &Point<D>| {
        let reach = NEAR * distance.at(p) + pieces.apart() * pieces.step();
        let height = |piece: u32| {
            let foot = pieces.foot_on(piece, p, reach)?;
            Some((piece, foot.signed_distance(p)))
        };
        pieces.near(p, reach).into_iter().filter_map(height).collect()
    };
    places.par_iter().with_min_len(1 << 6).map(of).collect()
}

/// Whether a place near a piece is within 3/4 d of an end or border that the piece has inside the box.
pub fn is_at_end<const D: usize>(
    pieces: &Pieces<D>,
    piece: u32,
    place: &Point<D>,
    distance: &NominalDistance<D>,
    bounds: &Bounds<D>,
) -> bool {
    let (d, step) = (distance.at(place), pieces.step());
    let reach = d + pieces.apart() * step;
    let Some(foot) = pieces.foot_on(piece, place, reach) else { return true };
    let ways = tangents(&foot.normal);
    ways[..D - 1].iter().any(|way| {
        [AT_END * d, -AT_END * d].iter().any(|far| {
            let there = std::array::from_fn(|k| foot.position[k] + far * way[k]);
            let there = bounds.clamp(&there);
            // beyond its last points, where it was led on to the box, a piece may have ended
            let foot = pieces.foot_on(piece, &there, reach);
            foot.is_none_or(|foot| !pieces.has_point_near(piece, &foot.position, KNOWN * step))
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::crests::FeaturePoint;
    use crate::image::Grid;

    /// A line along x = 10.3 from y = 0 to y = 20, in a box of 40 by 40.
    fn line() -> (Pieces<2>, NominalDistance<2>, Bounds<2>) {
        let grid = Grid { shape: [41, 41], step: [1.0; 2] };
        let at = |y: usize| FeaturePoint {
            index: 10 + 41 * y,
            position: [10.3, y as f64],
            normal: [1.0, 0.0],
            strength: 1.0,
        };
        let pieces = Pieces::new((0..=20).map(at).collect(), &grid, 3);
        (pieces, NominalDistance::constant(&grid, 6.0).unwrap(), grid.bounds())
    }

    #[test]
    fn facets_between_the_two_sides_of_a_piece_are_across_it() {
        let (pieces, distance, _) = line();
        let centres = [[8.0, 10.0], [13.0, 10.5], [9.0, 15.0], [8.0, 30.0], [13.0, 30.0]];
        let between = |cells: [u32; 2], middle| Between { cells, middle };
        let facets = [
            between([0, 1], [10.5, 10.0]),
            between([1, 2], [10.0, 13.0]),
            between([0, 2], [8.5, 12.0]),
            between([3, 4], [10.3, 30.0]),
        ];
        let found = across(&centres, &facets, &pieces, &distance);
        let along = found.iter().map(|found| found.map(|across| across.is_along));
        let along: Vec<Option<bool>> = along.collect();
        // opposite ways across; one side; beyond the end
        assert!(along[0].is_some() && along[1].is_some() && along[0] != along[1], "{found:?}");
        assert_eq!(along[2..], [None, None]);
    }

    #[test]
    fn a_place_is_at_an_end_inside_the_box_and_not_at_one_on_its_side() {
        let (pieces, distance, bounds) = line();
        let at = |y: f64| is_at_end(&pieces, 0, &[10.3, y], &distance, &bounds);
        // 3/4 of 6 from the end at 20; as far as three samples beyond it the piece still is known
        assert_eq!([0.5, 10.0, 14.0, 19.0, 20.0].map(at), [false, false, false, true, true]);
    }
}
