//! What of features no facet of theirs lies on.

use crate::parallel::prelude::*;

use crate::crests::Pieces;
use crate::fields::NominalDistance;
use crate::geometry::{Bounds, Point, PointGrid, distance_squared};
use crate::mesh::Mesh;

use super::facets::FeatureFacet;

/// A place on a piece is met where a corner of one of its facets is nearer than this, over d: no place on a facet of
/// edges d is farther than 0.58 d from a corner.
const MET: f64 = 0.75;

/// Places on pieces that are not met.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Unmet<const D: usize> {
    /// Their share of all places, which are spread evenly.
    pub share: f64,
    /// The places, those of the strongest piece first.
    pub places: Vec<Point<D>>,
    /// The piece of each place.
    pub of_places: Vec<u32>,
}

/// The places on pieces that have no facet of their own near, in lattice coordinates.
pub fn unmet<const D: usize>(
    mesh: &Mesh<D>,
    facets: &[FeatureFacet<D>],
    pieces: &Pieces<D>,
    distance: &NominalDistance<D>,
) -> Unmet<D> {
    let bounds = Bounds::of(mesh.points()).unwrap_or(Bounds { min: [0.0; D], max: [0.0; D] });
    let mut corners: Vec<(u32, u32)> = (facets.iter())
        .flat_map(|facet| facet.corners.map(|corner| (facet.piece, corner)))
        .collect();
    corners.sort_unstable();
    corners.dedup();
    let positions = corners.iter().map(|&(_, corner)| mesh.points()[corner as usize]);
    let grid = PointGrid::new(&bounds, distance.least(), positions);
    let is_met = |place: &Point<D>, piece: u32| {
        let (reach, mut is_met) = (MET * distance.at(place), false);
        grid.near(place, reach, |corner, i| {
            is_met |= corners[i].0 == piece && distance_squared(corner, place) <= reach * reach;
        });
        is_met
    };
    let all: Vec<(Point<D>, u32)> = pieces.places().collect();
    let unmet = all.par_iter().with_min_len(1 << 8).filter(|(place, piece)| !is_met(place, *piece));
    let mut unmet: Vec<(Point<D>, u32)> = unmet.copied().collect();
    unmet.sort_by_key(|(_, piece)| *piece); // stable
    let share = unmet.len() as f64 / all.len().max(1) as f64;
    let (places, of_places) = unmet.into_iter().unzip();
    Unmet { share, places, of_places }
}
