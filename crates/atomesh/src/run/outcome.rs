//! What a run gives.

use crate::features::{FacetField, FeatureFacetOptions, FeatureSet, find_features};
use crate::fields::ScalarField;
use crate::fields::{NominalDistance, feature_density};
use crate::geometry::{Bounds, Point};
use crate::image::{Frame, Grid, Samples, Units};
use crate::improve::ImproveReport;
use crate::measure::{
    AlignmentOptions, AlignmentReport, FidelityReport, HomogeneityReport, MeasureError,
    PrecisionOptions, SampledPotential, ShapeReport, SpreadReport, WantedSize, alignment,
    alignment_of_faces, features, fidelity, precision, shape, spread,
};
use crate::mesh::{FacetGroup, Mesh, Quadratic, Regions, Tags, TagsError};
use crate::mirror::MirrorReport;
use crate::optimize::OptimizeReport;
use crate::region::{Outline, interfaces};
use crate::voronoi::{FeatureFaces, PolyMesh, PolyReport, feature_faces};
use crate::watch::Watch;
use rayon::prelude::*;

use super::error::{RunError, Warning};

/// A mesh, the fields it follows, and how it came about.
#[derive(Clone, Debug)]
pub struct Outcome<const D: usize> {
    pub(super) mesh: Mesh<D>,
    pub(super) cells: Option<PolyMesh<D>>,
    pub(super) distance_at_points: Vec<f32>,
    pub(super) potential_at_points: Vec<f32>,
    pub(super) potential: ScalarField<D>,
    pub(super) distance: NominalDistance<D>,
    pub(super) frame: Frame<D>,
    pub(super) units: Units,
    pub(super) optimize_report: OptimizeReport,
    pub(super) improve_report: Option<ImproveReport>,
    pub(super) mirror_report: Option<MirrorReport>,
    pub(super) outline: Option<Outline<D>>,
    pub(super) outline_facets: Vec<[u32; D]>,
    pub(super) labels: Option<Vec<i32>>,
    pub(super) warnings: Vec<Warning>,
}

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

/// The mean of |b| from which on a face lies on a feature.
const FEATURE: f64 = 0.2;

/// Features with a smaller area of faces than so many d, or d² in 3-D, are left out.
const LEAST_FEATURE: f64 = 2.0;

impl<const D: usize> Outcome<D> {
    /// The mesh in lattice coordinates.
    pub fn mesh(&self) -> &Mesh<D> {
        &self.mesh
    }

    /// The mesh in world coordinates, cells of positive orientation.
    pub fn world_mesh(&self) -> Mesh<D> {
        super::place(&self.mesh, &self.frame, self.units)
    }

    /// The mesh in sample coordinates: what drawing and alignment work in.
    pub fn sample_mesh(&self) -> Mesh<D> {
        in_samples(&self.mesh, self.potential.grid())
    }

    /// The facets that follow features, in world coordinates; `world` is [`Outcome::world_mesh`].
    ///
    /// # Errors
    /// [`RunError::Features`], also when cancelled.
    pub fn features(
        &self,
        world: &Mesh<D>,
        options: &FeatureFacetOptions,
        watch: &mut dyn Watch,
    ) -> Result<FeatureSet<D>, RunError> {
        let field = FacetField::along(&self.mesh, &self.potential, watch)?;
        Ok(find_features(world, &field, options)?)
    }

    /// The Voronoi cells around the mesh's points, in lattice coordinates, if they were asked for.
    pub fn cells(&self) -> Option<&PolyMesh<D>> {
        self.cells.as_ref()
    }

    /// The Voronoi cells in world coordinates. Where the lattice is in samples and their steps differ, the
    /// world's cells are convex still, but their faces are not at right angles to the lines between sites.
    pub fn world_cells(&self) -> Option<PolyMesh<D>> {
        let to = |p: &Point<D>| self.frame.lattice_to_world(self.units, p);
        self.cells.as_ref().map(|cells| cells.moved(self.frame.is_mirrored(), to))
    }

    /// The Voronoi cells in sample coordinates.
    pub fn sample_cells(&self) -> Option<PolyMesh<D>> {
        let step = self.potential.grid().step;
        let to = |p: &Point<D>| std::array::from_fn(|k| p[k] / step[k]);
        self.cells.as_ref().map(|cells| cells.moved(false, to))
    }

    /// The faces of the Voronoi cells that lie on features: |b| is 0.2 or more along them in the mean, in
    /// groups of 2 d (3-D: 2 d²) or more.
    pub fn cell_features(&self) -> Option<FeatureFaces> {
        self.cell_features_from(FEATURE)
    }

    /// The same with another value for the least mean of |b| along a face, above 0.
    pub fn cell_features_from(&self, least: f64) -> Option<FeatureFaces> {
        let least_area = LEAST_FEATURE * self.distance.mean().powi(D as i32 - 1);
        let of = |cells| feature_faces(cells, &self.potential, least, least_area);
        self.cells.as_ref().map(of)
    }

    /// Measures the Voronoi cells, if they were asked for.
    ///
    /// # Errors
    /// [`RunError::Measure`], also when cancelled.
    pub fn cells_report(&self, watch: &mut dyn Watch) -> Result<Option<VoronoiReport>, RunError> {
        let (Some(cells), Some(in_samples)) = (&self.cells, self.sample_cells()) else {
            return Ok(None);
        };
        let grid = self.potential.grid();
        let size = samples_of(self.distance.mean(), grid);
        let valleys: Vec<f32> = self.potential.samples().iter().map(|b| -b.abs()).collect();
        let b = SampledPotential { values: &valleys, shape: grid.shape };
        let found = features(b, size, watch)?;
        let options = AlignmentOptions::new(size);
        let alignment = alignment_of_faces(&in_samples, &found, &options, watch)?;
        Ok(Some(VoronoiReport { shape: PolyReport::new(cells, &grid.bounds()), alignment }))
    }

    /// d at the mesh's points, in lattice units.
    pub fn distance_at_points(&self) -> &[f32] {
        &self.distance_at_points
    }

    /// b at the mesh's points, within the range of its samples.
    pub fn potential_at_points(&self) -> &[f32] {
        &self.potential_at_points
    }

    /// b(x).
    pub fn potential(&self) -> &ScalarField<D> {
        &self.potential
    }

    /// d(x).
    pub fn distance(&self) -> &NominalDistance<D> {
        &self.distance
    }

    /// d at the image's samples, x fastest.
    pub fn distance_at_samples(&self) -> Vec<f32> {
        let grid = self.potential.grid();
        let row = grid.shape[0];
        let mut values = vec![0.0; grid.sample_count()];
        values.par_chunks_mut(row).enumerate().for_each(|(r, values)| {
            let mut rest = r;
            let mut p = [0.0; D];
            for k in 1..D {
                p[k] = (rest % grid.shape[k]) as f64 * grid.step[k];
                rest /= grid.shape[k];
            }
            for (i, value) in values.iter_mut().enumerate() {
                p[0] = i as f64 * grid.step[0];
                *value = self.distance.at(&p) as f32;
            }
        });
        values
    }

    /// How many features there are around each of the image's samples, x fastest: |b| smoothed by the greatest
    /// nominal distance, 0…1.
    pub fn feature_density(&self) -> Vec<f32> {
        let smooth = self.distance.greatest();
        feature_density(self.potential.grid(), self.potential.samples(), smooth)
            .expect("a potential has a sample for each of its grid, and d is a length")
    }

    /// The image's frame.
    pub fn frame(&self) -> &Frame<D> {
        &self.frame
    }

    /// The lattice space.
    pub fn units(&self) -> Units {
        self.units
    }

    /// What the optimizer did.
    pub fn optimize_report(&self) -> &OptimizeReport {
        &self.optimize_report
    }

    /// What was improved after connecting; `None` if nothing was asked for, or the dimension has no improver.
    pub fn improve_report(&self) -> Option<&ImproveReport> {
        self.improve_report.as_ref()
    }

    /// The pairs of atoms across features that repel; `None` if none were asked for or there are no such features.
    pub fn mirror_report(&self) -> Option<&MirrorReport> {
        self.mirror_report.as_ref()
    }

    /// Where the mesh ends, if a mask says so.
    pub fn outline(&self) -> Option<&Outline<D>> {
        self.outline.as_ref()
    }

    /// The facets on the mask's outline, normals outward in lattice space; none without a mask.
    pub fn outline_facets(&self) -> &[[u32; D]] {
        &self.outline_facets
    }

    /// The label of each cell, if there were labels.
    pub fn labels(&self) -> Option<&[i32]> {
        self.labels.as_deref()
    }

    /// The tags of [`Outcome::world_mesh`]: the box's sides `xmin` … `zmax`; with a mask, `mask`, its outline;
    /// with labels, regions of the same numbers, and for each two that meet their facets, as
    /// `interface-2-5`.
    ///
    /// # Errors
    /// [`TagsError`] if there are too many interfaces to number.
    pub fn tags(&self) -> Result<Tags<D>, TagsError> {
        let sides = sides(&self.mesh, &self.potential.grid().bounds(), false);
        let is_whole = self.outline.is_none();
        let mut groups: Vec<FacetGroup<D>> = (sides.facet_groups().iter())
            .filter(|group| is_whole || !group.facets.is_empty())
            .cloned()
            .collect();
        let mut id = 2 * D as u32;
        let mut add = |name: String, facets: Vec<[u32; D]>| {
            id += 1;
            groups.push(FacetGroup { id, name, facets });
        };
        if self.outline.is_some() {
            add("mask".into(), self.outline_facets.clone());
        }
        for ([low, high], facets) in self.labels.iter().flat_map(|l| interfaces(&self.mesh, l)) {
            add(format!("interface-{low}-{high}"), facets);
        }
        let regions = self.labels.clone().map(|of_cells| Regions { of_cells, names: Vec::new() });
        let tags = Tags::new(&self.mesh, groups, regions)?;
        Ok(if self.frame.is_mirrored() { tags.turned() } else { tags })
    }

    /// The mesh with quadratic cells, in world coordinates: straight, but on a mask's outline, where the middles
    /// of edges are put onto it as long as their cells stay valid.
    pub fn quadratic(&self) -> Quadratic<D> {
        let mut quadratic = Quadratic::new(&self.mesh);
        if let Some(outline) = &self.outline {
            let all = ((1 << D) - 1) as u8;
            let bounds = self.potential.grid().bounds();
            quadratic.curve(&self.outline_facets, |p| {
                let side = |k: &usize| p[*k] == bounds.min[*k] || p[*k] == bounds.max[*k];
                let held: u8 = (0..D).filter(side).map(|k| 1 << k).sum();
                outline.project(p, all & !held, 0.3 * self.distance.at(p))
            });
        }
        quadratic.moved(self.frame.is_mirrored(), |p| self.frame.lattice_to_world(self.units, p))
    }

    /// The box that the mesh fills; `None` if it ends at a mask's outline.
    pub fn bounds(&self) -> Option<Bounds<D>> {
        self.outline.is_none().then(|| self.potential.grid().bounds())
    }

    /// What was odd.
    pub fn warnings(&self) -> &[Warning] {
        &self.warnings
    }

    /// Measures shape and alignment.
    ///
    /// # Errors
    /// [`RunError::Measure`], also when cancelled.
    pub fn report(&self, watch: &mut dyn Watch) -> Result<MeshReport, RunError> {
        let size =
            WantedSize { mean: self.distance.mean(), at_points: Some(&self.distance_at_points) };
        let (grid, samples) = (self.potential.grid(), self.potential.samples());
        MeshReport::within(&self.mesh, self.bounds(), (grid, samples), size, watch)
            .map_err(RunError::Measure)
    }

    /// Measures how well the mesh carries an image on the grid of the potential.
    ///
    /// # Errors
    /// [`RunError::Measure`], also when cancelled.
    pub fn fidelity(
        &self,
        samples: &Samples,
        watch: &mut dyn Watch,
    ) -> Result<FidelityReport, RunError> {
        let grid = self.potential.grid();
        let frame = Frame::new(grid.shape).and_then(|frame| frame.with_spacing(grid.step));
        let frame = frame.expect("a grid's shape and step were a frame's");
        fidelity(&self.mesh, &frame, samples, watch).map_err(RunError::Measure)
    }
}

/// The sides of a mesh in lattice coordinates, turned as a move to the world turns its cells; see
/// [`Tags::sides`]. A point may be off a side by 1e-9 of the box.
pub fn sides<const D: usize>(mesh: &Mesh<D>, bounds: &Bounds<D>, mirrored: bool) -> Tags<D> {
    let extent = bounds.extent().into_iter().fold(0.0, f64::max);
    let tags = Tags::sides(mesh, bounds, 1e-9 * extent);
    if mirrored { tags.turned() } else { tags }
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
        Self::within(mesh, Some(grid.bounds()), (grid, potential), size, watch)
    }

    /// [`MeshReport::new`] for a mesh that fills `bounds`, or, if `None`, a part of the grid's box.
    ///
    /// # Errors
    /// As [`MeshReport::new`].
    pub fn within<const D: usize>(
        mesh: &Mesh<D>,
        bounds: Option<Bounds<D>>,
        (grid, potential): (&Grid<D>, &[f32]),
        size: WantedSize<'_>,
        watch: &mut dyn Watch,
    ) -> Result<Self, MeasureError> {
        let spread = spread(mesh, size, watch)?;
        let shape = shape(mesh, bounds.as_ref(), watch)?;
        let size = samples_of(size.mean, grid);
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

/// A length in samples: by the geometric mean over the axes, where steps differ.
fn samples_of<const D: usize>(length: f64, grid: &Grid<D>) -> f64 {
    length / grid.step.iter().product::<f64>().powf(1.0 / D as f64)
}

/// The mesh with its points moved from lattice to sample coordinates.
fn in_samples<const D: usize>(mesh: &Mesh<D>, grid: &Grid<D>) -> Mesh<D> {
    let to_sample = |p: &Point<D>| std::array::from_fn(|k| p[k] / grid.step[k]);
    let points = mesh.points().iter().map(to_sample).collect();
    Mesh::new(points, mesh.corners().to_vec()).expect("steps above 0 keep points finite")
}
