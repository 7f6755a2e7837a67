//! The figures of a mesh.

use crate::geometry::Bounds;
use crate::image::{Grid, Samples};
use crate::measure::{
    AlignmentOptions, AlignmentReport, FidelityReport, HomogeneityReport, MeasureError,
    PrecisionOptions, SampledPotential, ShapeReport, SpreadReport, WantedSize, alignment,
    alignment_of_faces, features, fidelity, precision, shape, spread,
};
use crate::mesh::{Mesh, PolyReport};
use crate::watch::Watch;

use super::error::RunError;
use super::outcome::{Outcome, in_samples};

/// The figures of a mesh: its shape, and how it follows the image.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct MeshReport {
    /// Shape of the cells, in lattice space.
    pub shape: ShapeReport,
    /// How facets follow the potential's valleys.
    pub alignment: AlignmentReport,
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
        Ok(Self { shape, alignment, spread, fidelity: None, homogeneity: None })
    }
}

/// [`Outcome::cells_report`].
pub(super) fn of_cells<const D: usize>(
    outcome: &Outcome<D>,
    watch: &mut dyn Watch,
) -> Result<Option<VoronoiReport>, RunError> {
    let (Some(cells), Some(in_samples)) = (outcome.cells(), outcome.sample_cells()) else {
        return Ok(None);
    };
    let (potential, distance) = (outcome.potential(), outcome.distance());
    let grid = potential.grid();
    let size = grid.in_samples(distance.mean());
    let valleys: Vec<f32> = potential.samples().iter().map(|b| -b.abs()).collect();
    let b = SampledPotential { values: &valleys, shape: grid.shape };
    let found = features(b, size, watch)?;
    let options = AlignmentOptions::new(size);
    let alignment = alignment_of_faces(&in_samples, &found, &options, watch)?;
    Ok(Some(VoronoiReport { shape: PolyReport::new(cells, &grid.bounds()), alignment }))
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
    Ok(MeshReport::within(outcome.mesh(), against, size, watch)?)
}

/// [`Outcome::fidelity`].
pub(super) fn fidelity_of<const D: usize>(
    outcome: &Outcome<D>,
    samples: &Samples,
    watch: &mut dyn Watch,
) -> Result<FidelityReport, RunError> {
    Ok(fidelity(outcome.mesh(), &outcome.run().lattice_frame(), samples, watch)?)
}
