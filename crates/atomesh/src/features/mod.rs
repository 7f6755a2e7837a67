//! Features of an image as facets of a mesh: faults, horizons, outlines (Hale 2001, Fig. 10).
//!
//! In order: b is read along every facet between two cells ([`FacetField`]); facets that pass a threshold
//! are chosen; gaps of one facet are closed, if asked for; what is small or double is dropped; the rest is
//! split into connected pieces where more than two chosen facets meet, each turned one way, the largest
//! first ([`find_features`]).
//!
//! Where pieces meet they share the mesh's points. In the plane a piece is a polyline and its facets follow
//! one another; in space it is a surface. Cost: reading b, O(facets) with some 10 to 100 samples each; the
//! rest O(n log n) in chosen facets. Assumes that the mesh is valid. The result is the same at any thread
//! count.

mod clean;
mod faces;
mod field;
mod orient;
mod ridges;
#[cfg(test)]
mod tests;

use crate::geometry::{Bounds, dot};
use crate::mesh::{FacetGroup, Mesh, Regions, Tags, TagsError, feature_name};
use crate::region::{components, islands};
use crate::watch::Cancelled;
pub use faces::{FeatureFaces, feature_faces};
pub use field::FacetField;
use orient::Piece;
use ridges::Ridges;

/// Which value of b along a facet is held against the threshold.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FacetTest {
    /// The mean: a facet may leave the feature for a part of its length.
    #[default]
    Mean,
    /// The greatest: the facet lies in the feature everywhere.
    Max,
}

/// How facets are chosen and cleaned.
#[derive(Clone, Debug, PartialEq)]
pub struct FeatureFacetOptions {
    /// Facets whose value of b is at most this are chosen; −1 to 1. Default −0.2: on a section of thin faults
    /// between 0, of facets that leave features, and −0.5, which only facets along straight ones reach.
    pub below: f64,
    /// The value of b that counts. Default the mean.
    pub test: FacetTest,
    /// Pieces of fewer facets are dropped. Default 3.
    pub min_facets: usize,
    /// Pieces shorter (2-D) or smaller (3-D) than this are dropped, in lattice units. Default 0.
    pub min_measure: f64,
    /// Whether facets are added where two ends (2-D) or borders (3-D) are one facet apart. Default false.
    pub close_gaps: bool,
}

impl Default for FeatureFacetOptions {
    fn default() -> Self {
        Self {
            below: -0.2,
            test: FacetTest::default(),
            min_facets: 3,
            min_measure: 0.0,
            close_gaps: false,
        }
    }
}

/// Why features could not be found.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FeaturesError {
    /// The threshold is no value of b.
    #[error("the threshold is {value}; expected -1 to 1, as b(x) is")]
    Threshold {
        /// The threshold given.
        value: f64,
    },
    /// The least length or area is negative or no number.
    #[error("the least length or area of a piece is {value}; expected 0 or more")]
    MinMeasure {
        /// The value given.
        value: f64,
    },
    /// There is not one value for each point.
    #[error("{found} values of b for {expected} points")]
    PointCount {
        /// The number of values given.
        found: usize,
        /// The number of points.
        expected: usize,
    },
    /// The caller ended the work.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// One piece: a polyline (2-D) or a surface (3-D) of facets.
#[derive(Clone, Debug, PartialEq)]
pub struct Feature<const D: usize> {
    /// The facets. In 2-D they follow one another from the end with the lesser x (then y); a loop begins at
    /// its lowest-numbered point. In 3-D they ascend by corners, and their normals agree, with the sum of them
    /// positive along the axis where it is longest.
    pub facets: Vec<[u32; D]>,
    /// The mean of b over the piece, weighted by length or area.
    pub mean: f64,
    /// Whether all normals agree; no surface with one side has such.
    pub orientable: bool,
    /// Whether it has no end (2-D) or border (3-D), neither free nor at another piece.
    pub closed: bool,
}

/// The features of a mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct FeatureSet<const D: usize> {
    /// The pieces, the largest first; of equal ones that with the lowest corners first.
    pub features: Vec<Feature<D>>,
    /// Where more than two facets of features meet: points (2-D), or edges by their ends (3-D), ascending.
    pub intersections: Vec<Vec<u32>>,
    /// What was chosen and what became of it.
    pub selection: Selection,
}

/// How many facets were chosen, added and dropped.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Selection {
    /// Facets that pass the threshold.
    pub chosen: usize,
    /// Facets added to close gaps.
    pub added: usize,
    /// Facets dropped since they wrapped a cell, or their piece was small.
    pub dropped: usize,
}

/// A piece in numbers, for reports.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct FeatureReport {
    /// Its number, 1 for the largest.
    pub id: u32,
    /// Its name, `feature-1` for the largest.
    pub name: String,
    /// Its facets.
    pub facets: usize,
    /// Its length (2-D) or area (3-D).
    pub measure: f64,
    /// The mean of b over it.
    pub mean: f64,
    /// The least coordinates along each axis.
    pub min: Vec<f64>,
    /// The greatest coordinates along each axis.
    pub max: Vec<f64>,
    /// Whether all normals agree.
    pub orientable: bool,
    /// Whether it has no end or border.
    pub closed: bool,
}

/// Finds the features of a mesh among facets with their values of b.
///
/// Of a cell all of whose facets are chosen, that with the highest mean of b is dropped. Small pieces are
/// dropped: of those with the same ends or rim at other pieces, as the two ways through a flat tetrahedron
/// are, all but that with the lowest mean; then those of fewest facets first, since others may be one piece
/// without them.
///
/// # Errors
/// [`FeaturesError`] if an option is out of range.
pub fn find_features<const D: usize>(
    mesh: &Mesh<D>,
    field: &FacetField<D>,
    options: &FeatureFacetOptions,
) -> Result<FeatureSet<D>, FeaturesError> {
    if !(-1.0..=1.0).contains(&options.below) {
        return Err(FeaturesError::Threshold { value: options.below });
    }
    if !(0.0..f64::INFINITY).contains(&options.min_measure) {
        return Err(FeaturesError::MinMeasure { value: options.min_measure });
    }
    let mut chosen: Vec<u32> = (0..field.facets().len() as u32)
        .filter(|&facet| field.value(facet as usize, options.test) <= options.below)
        .collect();
    let mut selection = Selection { chosen: chosen.len(), ..Selection::default() };
    chosen = clean::thin(field, chosen);
    if options.close_gaps {
        let before = chosen.len();
        chosen = clean::close_gaps(mesh, field, chosen);
        selection.added = chosen.len() - before;
    }
    let kept = clean::drop_small(mesh, field, chosen, options);
    selection.dropped = selection.chosen + selection.added - kept.len();
    let ridges = Ridges::new(field, &kept);
    let mut features: Vec<(f64, Feature<D>)> =
        (ridges.pieces().iter()).map(|piece| feature(mesh, field, &kept, &ridges, piece)).collect();
    // larger first; the sort is stable and pieces come by their lowest facet
    features.sort_by(|a, b| b.0.total_cmp(&a.0));
    let features = features.into_iter().map(|(_, feature)| feature).collect();
    Ok(FeatureSet { features, intersections: ridges.intersections(), selection })
}

/// A piece with its length or area.
fn feature<const D: usize>(
    mesh: &Mesh<D>,
    field: &FacetField<D>,
    kept: &[u32],
    ridges: &Ridges<D>,
    piece: &[u32],
) -> (f64, Feature<D>) {
    let (measure, mean) =
        clean::measure_and_mean(mesh, field, piece.iter().map(|&at| kept[at as usize]));
    let oriented = Piece { mesh, field, kept, ridges, facets: piece }.oriented();
    let closed = piece.iter().all(|&at| ridges.neighbours(at).all(|n| n.is_some()));
    let feature =
        Feature { facets: oriented.facets, mean, orientable: oriented.orientable, closed };
    (measure, feature)
}

impl<const D: usize> FeatureSet<D> {
    /// The features as groups of facets, numbered from 1 and named `feature-1`, `feature-2` …
    pub fn groups(&self) -> Vec<FacetGroup<D>> {
        let group = |(index, feature): (usize, &Feature<D>)| FacetGroup {
            id: index as u32 + 1,
            name: feature_name(index as u32 + 1),
            facets: feature.facets.clone(),
        };
        self.features.iter().enumerate().map(group).collect()
    }

    /// The features as tags of the mesh that they were found in.
    ///
    /// # Errors
    /// [`TagsError`] if it is another mesh.
    pub fn tags(&self, mesh: &Mesh<D>) -> Result<Tags<D>, TagsError> {
        Tags::new(mesh, self.groups(), None)
    }

    /// The parts into which the features cut the mesh, numbered from 1 in the order of their first cells; those of
    /// fewer than `least` cells, such as a cell with features on all sides, go to the neighbour that they share
    /// most facets with. Features that end inside the mesh part nothing.
    pub fn regions(&self, mesh: &Mesh<D>, least: usize) -> Regions {
        let walls: Vec<[u32; D]> =
            self.features.iter().flat_map(|feature| feature.facets.iter().copied()).collect();
        let mut of_cells = components(mesh, &walls);
        if least > 1 {
            islands(mesh, &mut of_cells, least);
        }
        Regions { of_cells, names: Vec::new() }
    }

    /// Each feature in numbers, in the coordinates of `mesh`: that in which they were found, or the same
    /// with its points moved to the world.
    ///
    /// # Panics
    /// If the mesh has fewer points than the features name.
    pub fn report(&self, mesh: &Mesh<D>) -> Vec<FeatureReport> {
        let report = |(index, feature): (usize, &Feature<D>)| {
            let corners = feature.facets.as_flattened().iter();
            let points: Vec<[f64; D]> = corners.map(|&c| mesh.points()[c as usize]).collect();
            let bounds = Bounds::of(&points);
            let side = |of: fn(Bounds<D>) -> [f64; D]| bounds.map_or(vec![], |b| of(b).to_vec());
            FeatureReport {
                id: index as u32 + 1,
                name: feature_name(index as u32 + 1),
                facets: feature.facets.len(),
                measure: feature.facets.iter().map(|facet| measure_of(mesh, facet)).sum(),
                mean: feature.mean,
                min: side(|b| b.min),
                max: side(|b| b.max),
                orientable: feature.orientable,
                closed: feature.closed,
            }
        };
        self.features.iter().enumerate().map(report).collect()
    }
}

/// The length (2-D) or area (3-D) of a facet.
fn measure_of<const D: usize>(mesh: &Mesh<D>, facet: &[u32; D]) -> f64 {
    let normal = mesh.facet_normal(facet);
    dot(&normal, &normal).sqrt()
}
