//! Features of an image as facets of a mesh: faults, horizons, outlines (Hale 2001, Fig. 10).
//!
//! In order ([`find_features`]): b is read along every facet between two cells ([`FacetField`]). Facets that pass a
//! threshold are chosen. Gaps of one facet are closed, if asked for. Small and double pieces are dropped. The rest is
//! split into connected pieces where more than two chosen facets meet, each turned one way, the largest first
//! ([`FeatureSet::of_facets`]).
//!
//! Where pieces meet they share the mesh's points. In the plane a piece is a polyline, its facets one after another; in
//! space it is a surface. [`faces_of_pieces`] and [`feature_faces`] find the faces of polygons and polyhedra that lie on
//! features. Cost:
//! reading b, O(facets) with some 10 to 100 samples each; the rest O(n log n) in chosen facets. Assumes a valid mesh.
//! The result is the same at any thread count.

mod across;
mod clean;
mod faces;
mod field;
mod orient;
mod ridges;
#[cfg(test)]
mod tests;

use crate::geometry::{Bounds, dot};
use crate::mesh::{FacetGroup, Mesh, Regions, Tags, TagsError, feature_name};
use crate::region::{components, join_islands};
use crate::watch::Cancelled;
pub use across::{Across, Between, across, is_at_end};
pub use faces::{FeatureFaces, between_cells, faces_of_pieces, feature_faces};
pub use field::FacetField;
use orient::{Oriented, Piece};
use ridges::Ridges;

/// Which value of b along a facet is compared with the threshold.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FacetTest {
    /// The mean: a facet may leave the feature for a part of its length.
    #[default]
    Mean,
    /// The greatest: the whole facet lies in the feature.
    Max,
}

/// How facets are chosen and cleaned.
#[derive(Clone, Debug, PartialEq)]
pub struct FeatureFacetOptions {
    /// Facets whose value of b is at most this are chosen; −1 to 1. Default −0.2. On a section of thin faults, facets
    /// that leave features have about 0, and only facets along straight ones reach −0.5.
    pub below: f64,
    /// The value of b that is compared. Default the mean.
    pub test: FacetTest,
    /// Pieces of fewer facets are dropped, but those without a free end (2-D) or side (3-D), which join others. Default 3.
    pub min_facets: usize,
    /// The same for pieces shorter (2-D) or smaller (3-D) than this, in lattice units. Default 0.
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
    /// The threshold is out of the range of b.
    #[error("the threshold is {value}; expected -1 to 1, as b(x) is")]
    Threshold {
        /// The threshold given.
        value: f64,
    },
    /// The least length or area is negative or not finite.
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
    /// The mean of b over the piece, weighted by length or area; NaN where it is not known.
    pub mean: f64,
    /// Whether all normals agree; on a one-sided surface they cannot.
    pub orientable: bool,
    /// Whether it has no end (2-D) or border (3-D), neither free nor at another piece.
    pub closed: bool,
}

/// The facets that are known to be those of one feature.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FacetsOfFeature<const D: usize> {
    /// The facets, in any order.
    pub facets: Vec<[u32; D]>,
    /// The mean of b over them; NaN where it is not known.
    pub mean: f64,
}

impl<const D: usize> FacetsOfFeature<D> {
    /// Their length (2-D) or area (3-D), in the coordinates of `mesh`.
    ///
    /// # Panics
    /// If a corner is not a point of the mesh.
    pub fn measure(&self, mesh: &Mesh<D>) -> f64 {
        self.facets.iter().map(|facet| measure_of(mesh, facet)).sum()
    }
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
    /// Facets dropped because they wrapped a cell or their piece was small.
    pub dropped: usize,
}

/// A feature in numbers, for reports.
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
    /// The mean of b over it; NaN, in JSON null, where it is not known.
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
/// If all facets of a cell are chosen, the one with the highest mean of b is dropped. Then small pieces are dropped.
/// First, of pieces with the same ends or rim at other pieces, such as the two paths through a flat tetrahedron, all
/// but that with the lowest mean. Then those of fewest facets first, since others may become one piece without them.
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
    chosen = clean::unwrap_cells(field, chosen);
    if options.close_gaps {
        let before = chosen.len();
        chosen = clean::close_gaps(mesh, field, chosen);
        selection.added = chosen.len() - before;
    }
    let kept = clean::drop_small(mesh, field, chosen, options);
    selection.dropped = selection.chosen + selection.added - kept.len();
    let mean: Vec<f64> = kept.iter().map(|&facet| field.mean()[facet as usize]).collect();
    let features = FeatureSet::of_facets(mesh, &corners_of(field, &kept), &mean);
    Ok(FeatureSet { selection, ..features })
}

/// The corners of the facets of those indices in the field.
fn corners_of<const D: usize>(field: &FacetField<D>, indices: &[u32]) -> Vec<[u32; D]> {
    indices.iter().map(|&facet| field.facets()[facet as usize].corners).collect()
}

impl<const D: usize> FeatureSet<D> {
    /// The connected pieces of given facets of a mesh, split where more than two meet. `facets` are different and
    /// ascend, as their corners do; `mean` is the mean of b over each. The selection counts them as chosen.
    ///
    /// # Panics
    /// If there is not one mean for each facet, or a corner is not a point of the mesh.
    pub fn of_facets(mesh: &Mesh<D>, facets: &[[u32; D]], mean: &[f64]) -> Self {
        assert_eq!(facets.len(), mean.len(), "one mean a facet");
        let ridges = Ridges::new(facets);
        let feature = |piece: Vec<u32>| {
            let values = piece.iter().map(|&at| (&facets[at as usize], mean[at as usize]));
            let (measure, mean) = measure_and_mean(mesh, values);
            let Oriented { facets, orientable } =
                Piece { mesh, all: facets, ridges: &ridges, facets: &piece }.oriented();
            let closed = piece.iter().all(|&at| ridges.neighbours(at).all(|n| n.is_some()));
            (measure, Feature { facets, mean, orientable, closed })
        };
        let mut features: Vec<(f64, Feature<D>)> =
            ridges.pieces().into_iter().map(feature).collect();
        // larger first; the sort is stable and pieces come by their lowest facet
        features.sort_by(|a, b| b.0.total_cmp(&a.0));
        Self {
            features: features.into_iter().map(|(_, feature)| feature).collect(),
            intersections: ridges.intersections(),
            selection: Selection { chosen: facets.len(), ..Selection::default() },
        }
    }

    /// Features whose facets are known, each group one feature, the largest first; groups without facets are left out.
    ///
    /// # Panics
    /// If a corner is not a point of the mesh.
    pub fn of_groups(mesh: &Mesh<D>, groups: &[FacetsOfFeature<D>]) -> Self {
        let feature = |group: &FacetsOfFeature<D>| {
            let mut ascending = group.facets.clone();
            ascending.iter_mut().for_each(|corners| corners.sort_unstable());
            ascending.sort_unstable();
            let found = Self::of_facets(mesh, &ascending, &vec![group.mean; ascending.len()]);
            let parts = &found.features;
            let (facets, closed) = (
                parts.iter().flat_map(|part| part.facets.iter().copied()).collect::<Vec<_>>(),
                parts.iter().all(|part| part.closed),
            );
            let orientable = parts.iter().all(|part| part.orientable);
            let measure: f64 = facets.iter().map(|facet| measure_of(mesh, facet)).sum();
            (measure, Feature { facets, mean: group.mean, orientable, closed })
        };
        let mut features: Vec<(f64, Feature<D>)> =
            groups.iter().filter(|group| !group.facets.is_empty()).map(feature).collect();
        features.sort_by(|a, b| b.0.total_cmp(&a.0)); // stable
        let mut all: Vec<[u32; D]> =
            groups.iter().flat_map(|group| group.facets.iter().copied()).collect();
        all.iter_mut().for_each(|corners| corners.sort_unstable());
        all.sort_unstable();
        all.dedup();
        Self {
            features: features.into_iter().map(|(_, feature)| feature).collect(),
            intersections: Ridges::new(&all).intersections(),
            selection: Selection { chosen: all.len(), ..Selection::default() },
        }
    }

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

    /// The parts into which the features cut the mesh, numbered from 1 in the order of their first cells. Parts of fewer
    /// than `least` cells, such as a cell with features on all sides, join the part with which they share most facets.
    /// Features that end inside the mesh separate nothing.
    pub fn regions(&self, mesh: &Mesh<D>, least: usize) -> Regions {
        let walls: Vec<[u32; D]> =
            self.features.iter().flat_map(|feature| feature.facets.iter().copied()).collect();
        let mut of_cells = components(mesh, &walls);
        if least > 1 {
            join_islands(mesh, &mut of_cells, least);
        }
        Regions { of_cells, names: Vec::new() }
    }

    /// Each feature in numbers, in the coordinates of `mesh`: the mesh in which they were found, or the same mesh moved
    /// to the world.
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

/// The length or area of facets, given as corners with their mean of b, and the mean of b over all.
fn measure_and_mean<'a, const D: usize>(
    mesh: &Mesh<D>,
    facets: impl Iterator<Item = (&'a [u32; D], f64)>,
) -> (f64, f64) {
    let (mut measure, mut sum) = (0.0, 0.0);
    for (corners, mean) in facets {
        let part = measure_of(mesh, corners);
        measure += part;
        sum += part * mean;
    }
    (measure, if measure > 0.0 { sum / measure } else { 0.0 })
}
