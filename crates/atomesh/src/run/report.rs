//! The figures of a mesh.

use std::collections::HashMap;

use crate::geometry::{Bounds, Point};
use crate::image::{Grid, Samples};
use crate::measure::{
    AlignmentOptions, AlignmentReport, Conforming, Conformity, ConformityReport, FeatureConformity,
    FidelityReport, HomogeneityReport, MeasureError, PrecisionOptions, SampledPotential,
    ShapeReport, SpreadReport, WantedSize, alignment, alignment_of_faces, conformity, features,
    fidelity, precision, shape, spread,
};
use crate::mesh::{Mesh, PolyMesh, PolyReport};
use crate::watch::Watch;

use super::error::RunError;
use super::outcome::{Outcome, cells_in_samples, in_samples, own_features};

/// The figures of a mesh: its shape, and how it follows the image.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct MeshReport {
    /// Shape of the cells, in lattice space.
    pub shape: ShapeReport,
    /// How facets follow the potential's valleys.
    pub alignment: AlignmentReport,
    /// The features that the mesh was made to keep to, in the order of their tags; last those without facets. None if
    /// it was not made to conform.
    pub features: Vec<FeatureConformity>,
    /// How the mesh keeps to them, if it was made to.
    pub conformity: Option<ConformityReport>,
    /// All angles, and edges over d.
    pub spread: SpreadReport,
    /// How well the mesh carries an image, if one was given.
    pub fidelity: Option<FidelityReport>,
    /// How pure cells are, if labels were given.
    pub homogeneity: Option<HomogeneityReport>,
}

/// The figures of a mesh of polygons or polyhedra.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct VoronoiReport {
    /// Shape of the cells, in lattice space.
    pub shape: PolyReport,
    /// How faces follow the valleys of −|b|: features attract or repel.
    pub alignment: AlignmentReport,
    /// How pure cells are, if labels were given.
    pub homogeneity: Option<HomogeneityReport>,
}

impl VoronoiReport {
    /// Measures cells in lattice coordinates against the samples of b on a grid, for features that faces of cells `size`
    /// apart, in lattice units, can follow. Homogeneity, which needs labels, is left out.
    ///
    /// # Errors
    /// [`MeasureError`], also when cancelled.
    pub fn new<const D: usize>(
        cells: &PolyMesh<D>,
        grid: &Grid<D>,
        potential: &[f32],
        size: f64,
        watch: &mut dyn Watch,
    ) -> Result<Self, MeasureError> {
        let size = grid.in_samples(size);
        let valleys: Vec<f32> = potential.iter().map(|b| -b.abs()).collect();
        let b = SampledPotential { values: &valleys, shape: grid.shape };
        let found = features(b, size, watch)?;
        let options = AlignmentOptions::new(size);
        let in_samples = cells_in_samples(cells, grid);
        let alignment = alignment_of_faces(&in_samples, &found, &options, watch)?;
        let shape = PolyReport::new(cells, &grid.bounds());
        Ok(Self { shape, alignment, homogeneity: None })
    }
}

/// What a mesh is measured against.
struct Measured<'a, const D: usize> {
    grid: &'a Grid<D>,
    /// b at the grid's samples.
    potential: &'a [f32],
    /// The box that the mesh fills; `None` if it ends at a mask's outline.
    bounds: Option<Bounds<D>>,
}

impl MeshReport {
    /// Measures a mesh in lattice coordinates against the samples of b on a grid, for features that
    /// edges of the length `size`, in lattice units, can follow. Fidelity and homogeneity, which need
    /// more, are left out.
    ///
    /// # Errors
    /// [`MeasureError`], also when cancelled.
    pub fn new<const D: usize>(
        mesh: &Mesh<D>,
        grid: &Grid<D>,
        potential: &[f32],
        size: WantedSize<'_>,
        watch: &mut dyn Watch,
    ) -> Result<Self, MeasureError> {
        let against = Measured { grid, potential, bounds: Some(grid.bounds()) };
        Self::within(mesh, against, size, watch)
    }

    /// [`MeshReport::new`] for a mesh that may fill a part of the grid's box.
    fn within<const D: usize>(
        mesh: &Mesh<D>,
        against: Measured<'_, D>,
        size: WantedSize<'_>,
        watch: &mut dyn Watch,
    ) -> Result<Self, MeasureError> {
        let Measured { grid, potential, bounds } = against;
        let spread = spread(mesh, size, watch)?;
        let shape = shape(mesh, bounds.as_ref(), watch)?;
        let size = grid.in_samples(size.mean);
        let b = SampledPotential { values: potential, shape: grid.shape };
        let found = features(b, size, watch)?;
        let options = AlignmentOptions::new(size);
        let mesh = in_samples(mesh, grid);
        let mut alignment = alignment(&mesh, &found, &options, watch)?;
        let selected = precision(&mesh, b, &found, PrecisionOptions::new(size), watch)?;
        alignment.selected = Some(selected);
        Ok(Self {
            shape,
            alignment,
            features: Vec::new(),
            conformity: None,
            spread,
            fidelity: None,
            homogeneity: None,
        })
    }
}

/// [`Outcome::cells_report`].
pub(super) fn of_cells<const D: usize>(
    outcome: &Outcome<D>,
    watch: &mut dyn Watch,
) -> Result<Option<VoronoiReport>, RunError> {
    let Some(cells) = outcome.cells() else { return Ok(None) };
    let potential = outcome.potential();
    let (grid, size) = (potential.grid(), outcome.distance().mean());
    Ok(Some(VoronoiReport::new(cells, grid, potential.samples(), size, watch)?))
}

/// [`Outcome::report`].
pub(super) fn of_mesh<const D: usize>(
    outcome: &Outcome<D>,
    watch: &mut dyn Watch,
) -> Result<MeshReport, RunError> {
    let at_points = Some(outcome.distance_at_points());
    let size = WantedSize { mean: outcome.distance().mean(), at_points };
    let (grid, potential) = (outcome.potential().grid(), outcome.potential().samples());
    let against = Measured { grid, potential, bounds: outcome.bounds() };
    let mut report = MeshReport::within(outcome.mesh(), against, size, watch)?;
    if let Some(Conformity { features, all }) = conformity_of(outcome, watch)? {
        (report.features, report.conformity) = (features, Some(all));
    }
    Ok(report)
}

/// How the mesh keeps to the features that it was made to keep to, if it was.
fn conformity_of<const D: usize>(
    outcome: &Outcome<D>,
    watch: &mut dyn Watch,
) -> Result<Option<Conformity>, RunError> {
    let run = outcome.run();
    let (Some(pieces), Some(tagged)) = (run.pieces(), own_features(outcome, outcome.mesh())) else {
        return Ok(None);
    };
    let facets = outcome.feature_facets();
    let piece_of: HashMap<[u32; D], u32> =
        facets.iter().map(|facet| (facet.corners, facet.piece)).collect();
    let tagged: Vec<u32> = (tagged.features.iter())
        .filter_map(|feature| {
            let mut corners = *feature.facets.first()?;
            corners.sort_unstable();
            piece_of.get(&corners).copied()
        })
        .collect();
    let (frame, units) = (outcome.frame(), outcome.units());
    let to_world = |p: &Point<D>| frame.lattice_to_world(units, p);
    let conforming = Conforming {
        mesh: outcome.mesh(),
        facets,
        pieces,
        tagged: &tagged,
        kind: &run.kind_of_features(),
        distance: outcome.distance(),
        step: outcome.potential().grid().step,
        to_world: &to_world,
    };
    Ok(Some(conformity(&conforming, watch)?))
}

/// [`Outcome::fidelity`].
pub(super) fn fidelity_of<const D: usize>(
    outcome: &Outcome<D>,
    samples: &Samples,
    watch: &mut dyn Watch,
) -> Result<FidelityReport, RunError> {
    Ok(fidelity(outcome.mesh(), &outcome.run().lattice_frame(), samples, watch)?)
}
