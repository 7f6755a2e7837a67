//! The facets of a mesh across which what flows passes a feature.

use crate::crests::Pieces;
use crate::features::{Between, across, between_cells, is_at_end};
use crate::geometry::Point;
use crate::watch::Watch;

use super::error::RunError;
use super::find::crests;
use super::outcome::Outcome;

/// A facet between cells on the two sides of a feature.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AcrossFeature<const D: usize> {
    /// Its number among [`Mesh::facets`](crate::mesh::Mesh::facets), or the faces of the Voronoi cells.
    pub facet: u32,
    /// The number of the feature, from 0, the strongest first.
    pub feature: u32,
    /// Whether the way from the facet's first cell to the second is that of the feature's normal.
    pub is_along: bool,
    /// The facet's middle, in world coordinates.
    pub place: Point<D>,
}

/// [`Outcome::across_features`].
pub(super) fn across_features<const D: usize>(
    outcome: &Outcome<D>,
    watch: &mut dyn Watch,
) -> Result<Vec<AcrossFeature<D>>, RunError> {
    let (run, distance) = (outcome.run(), outcome.distance());
    let found: Pieces<D>;
    let pieces = match run.pieces().or(run.faced()) {
        Some(pieces) => pieces,
        None => {
            found = crests(outcome.potential(), distance, run.options().features.repel, watch)?;
            &found
        }
    };
    let (numbers, facets, centres) = facets_between(outcome);
    let (frame, units, bounds) = (outcome.frame(), outcome.units(), run.bounds());
    let found = across(&centres, &facets, pieces, distance);
    let open = numbers.iter().zip(&facets).zip(found).filter_map(|((&facet, between), across)| {
        let across = across?;
        let (feature, middle) = (across.piece, &between.middle);
        let place = frame.lattice_to_world(units, middle);
        let is_along = across.is_along;
        let is_at_end = is_at_end(pieces, feature, middle, distance, &bounds);
        (!is_at_end).then_some(AcrossFeature { facet, feature, is_along, place })
    });
    Ok(open.collect())
}

/// The facets between two cells with their numbers, and the centres of all cells.
fn facets_between<const D: usize>(
    outcome: &Outcome<D>,
) -> (Vec<u32>, Vec<Between<D>>, Vec<Point<D>>) {
    if let Some(cells) = outcome.cells() {
        let facets = between_cells(cells);
        return ((0..facets.len() as u32).collect(), facets, cells.centers().to_vec());
    }
    let mesh = outcome.mesh();
    let mean = |corners: &[u32]| -> Point<D> {
        let sum = |k: usize| corners.iter().map(|&c| mesh.points()[c as usize][k]).sum::<f64>();
        std::array::from_fn(|k| sum(k) / corners.len() as f64)
    };
    let all = mesh.facets();
    let inner = all.iter().zip(0..).filter_map(|(facet, number)| {
        let between =
            Between { cells: [facet.cell, facet.neighbour?], middle: mean(&facet.corners) };
        Some((number, between))
    });
    let (numbers, facets) = inner.unzip();
    (numbers, facets, mesh.cells().map(mean).collect())
}
