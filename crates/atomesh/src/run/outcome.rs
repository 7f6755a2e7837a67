//! What a run gives.

use std::collections::HashSet;

use crate::parallel::prelude::*;

use crate::conform::FeatureFacet;
use crate::features::{
    FacetField, FacetsOfFeature, FeatureFaces, FeatureFacetOptions, FeatureSet, faces_of_pieces,
    feature_faces, find_features,
};
use crate::fields::{NominalDistance, ScalarField, feature_density};
use crate::geometry::{Bounds, Point};
use crate::image::{Frame, Grid, Samples, Units};
use crate::improve::ImproveReport;
use crate::measure::FidelityReport;
use crate::mesh::{
    FacetGroup, MASK_NAME, Mesh, PointGroup, PolyMesh, Quadratic, Regions, Tags, TagsError,
    interface_name, well_name,
};
use crate::mirror::MirrorReport;
use crate::optimize::OptimizeReport;
use crate::region::{Outline, interfaces};
use crate::watch::Watch;

use super::across::AcrossFeature;
use super::compiled::Stages;
use super::error::{RunError, Warning};
use super::prepared::{Prepared, seed_points};
use super::report::{MeshReport, VoronoiReport};

/// A mesh, the fields it follows, and how it came about.
#[derive(Clone, Debug)]
pub struct Outcome<const D: usize> {
    pub(super) run: Prepared<D>,
    pub(super) mesh: Mesh<D>,
    pub(super) cells: Option<PolyMesh<D>>,
    pub(super) distance_at_points: Vec<f32>,
    pub(super) potential_at_points: Vec<f32>,
    pub(super) optimize_report: OptimizeReport,
    pub(super) improve_report: Option<ImproveReport>,
    pub(super) mirror_report: Option<MirrorReport>,
    pub(super) outline_facets: Vec<[u32; D]>,
    /// The facets of the features that the mesh was made to keep to.
    pub(super) feature_facets: Vec<FeatureFacet<D>>,
    /// The facets along features that the mesh was not made to keep to.
    pub(super) followed: Vec<FacetsOfFeature<D>>,
    pub(super) warnings: Vec<Warning>,
    pub(super) labels: Option<Vec<i32>>,
}

/// The mean of |b| from which on a face lies on a feature.
const FEATURE: f64 = 0.2;

/// Features with a smaller area of faces than so many d, or d² in 3-D, are left out.
const LEAST_FEATURE: f64 = 2.0;

impl<const D: usize> Outcome<D> {
    /// What the run was prepared from.
    pub fn run(&self) -> &Prepared<D> {
        &self.run
    }

    /// The mesh in lattice coordinates.
    pub fn mesh(&self) -> &Mesh<D> {
        &self.mesh
    }

    /// The mesh in world coordinates, cells of positive orientation.
    pub fn world_mesh(&self) -> Mesh<D> {
        (self.stages().world_mesh)(self)
    }

    /// The mesh in sample coordinates: what drawing and alignment work in.
    pub fn sample_mesh(&self) -> Mesh<D> {
        (self.stages().sample_mesh)(self)
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
        (self.stages().features)(self, world, options, watch)
    }

    /// The place among the mesh's points, or the Voronoi cells if they were asked for, of each point that was to stay
    /// where it is ([`MeshOptions::seed_points`](super::MeshOptions::seed_points)); `None` where a mask left it out.
    pub fn wells(&self) -> Vec<Option<u32>> {
        (self.stages().wells)(self)
    }

    /// The Voronoi cells around the mesh's points, in lattice coordinates, if they were asked for.
    pub fn cells(&self) -> Option<&PolyMesh<D>> {
        self.cells.as_ref()
    }

    /// The Voronoi cells in world coordinates. Where the lattice is in samples and their steps differ, the
    /// world's cells are convex still, but their faces are not at right angles to the lines between sites.
    pub fn world_cells(&self) -> Option<PolyMesh<D>> {
        (self.stages().world_cells)(self)
    }

    /// The Voronoi cells in sample coordinates.
    pub fn sample_cells(&self) -> Option<PolyMesh<D>> {
        (self.stages().sample_cells)(self)
    }

    /// The faces of the Voronoi cells that lie on features. Of clean lines and sheets ([`Prepared::faced`]) they are those
    /// between cells on their two sides; else |b| is 0.2 or more along them in the mean, in groups of 2 d (3-D: 2 d²) or
    /// more.
    pub fn cell_features(&self) -> Option<FeatureFaces> {
        self.cell_features_from(FEATURE)
    }

    /// The same with another value for the least mean of |b| along a face, above 0, where that decides.
    pub fn cell_features_from(&self, least: f64) -> Option<FeatureFaces> {
        (self.stages().cell_features)(self, least)
    }

    /// Measures the Voronoi cells, if they were asked for.
    ///
    /// # Errors
    /// [`RunError::Measure`], also when cancelled.
    pub fn cells_report(&self, watch: &mut dyn Watch) -> Result<Option<VoronoiReport>, RunError> {
        (self.stages().cells_report)(self, watch)
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
        self.run.potential()
    }

    /// d(x).
    pub fn distance(&self) -> &NominalDistance<D> {
        self.run.distance()
    }

    /// d at the image's samples, x fastest.
    pub fn distance_at_samples(&self) -> Vec<f32> {
        self.run.distance_at_samples()
    }

    /// How many features there are around each of the image's samples, x fastest: |b| smoothed by the greatest
    /// nominal distance, 0…1.
    pub fn feature_density(&self) -> Vec<f32> {
        (self.stages().feature_density)(self)
    }

    /// The image's frame.
    pub fn frame(&self) -> &Frame<D> {
        self.run.frame()
    }

    /// The lattice space.
    pub fn units(&self) -> Units {
        self.run.options().units
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
        self.run.outline()
    }

    /// The facets on the mask's outline, normals outward in lattice space; none without a mask.
    pub fn outline_facets(&self) -> &[[u32; D]] {
        &self.outline_facets
    }

    /// The facets of the features that the mesh was made to keep to, by ascending corners; none if it was not.
    pub fn feature_facets(&self) -> &[FeatureFacet<D>] {
        &self.feature_facets
    }

    /// The facets between cells on the two sides of a feature, whether they lie on the feature or not, without those
    /// within 3/4 d of an end that the feature has inside the box. Where one of them is no barrier, flow passes the
    /// feature: it is not met there. If the mesh was not made to keep to features, these are all deep valleys of b.
    ///
    /// # Errors
    /// [`RunError::Cancelled`].
    pub fn across_features(
        &self,
        watch: &mut dyn Watch,
    ) -> Result<Vec<AcrossFeature<D>>, RunError> {
        (self.stages().across_features)(self, watch)
    }

    /// The label of each cell, if there were labels.
    pub fn labels(&self) -> Option<&[i32]> {
        self.labels.as_deref()
    }

    /// The tags of [`Outcome::world_mesh`]: the box's sides `xmin` … `zmax`; with a mask, `mask`, its outline;
    /// with labels, regions of the same numbers, and for each two that meet their facets, as
    /// `interface-2-5`; of points that were to stay where they are, `well-1`, `well-2` … in the order in which they were
    /// given.
    ///
    /// # Errors
    /// [`TagsError`] if there are too many interfaces to number.
    pub fn tags(&self) -> Result<Tags<D>, TagsError> {
        (self.stages().tags)(self)
    }

    /// The mesh with quadratic cells, in world coordinates: straight, but on a mask's outline, where the middles
    /// of edges are put onto it as long as their cells stay valid.
    pub fn quadratic(&self) -> Quadratic<D> {
        (self.stages().quadratic)(self)
    }

    /// The box that the mesh fills; `None` if it ends at a mask's outline.
    pub fn bounds(&self) -> Option<Bounds<D>> {
        self.outline().is_none().then(|| self.run.bounds())
    }

    /// What was odd: what the run was prepared with, then what became of it.
    pub fn warnings(&self) -> &[Warning] {
        &self.warnings
    }

    /// Measures shape and alignment.
    ///
    /// # Errors
    /// [`RunError::Measure`], also when cancelled.
    pub fn report(&self, watch: &mut dyn Watch) -> Result<MeshReport, RunError> {
        (self.stages().report)(self, watch)
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
        (self.stages().fidelity)(self, samples, watch)
    }

    fn stages(&self) -> &'static Stages<D> {
        self.run.parts().method.stages()
    }
}

/// [`Outcome::features`].
pub(super) fn features_of<const D: usize>(
    outcome: &Outcome<D>,
    world: &Mesh<D>,
    options: &FeatureFacetOptions,
    watch: &mut dyn Watch,
) -> Result<FeatureSet<D>, RunError> {
    if let Some(found) = own_features(outcome, world) {
        return Ok(found);
    }
    let field = FacetField::along(outcome.mesh(), outcome.potential(), watch)?;
    Ok(find_features(world, &field, options)?)
}

/// The features that the mesh was made to keep to, or that its facets follow.
pub(super) fn own_features<const D: usize>(
    outcome: &Outcome<D>,
    mesh: &Mesh<D>,
) -> Option<FeatureSet<D>> {
    let Some(pieces) = outcome.run.pieces() else {
        let followed = &outcome.followed;
        return (!followed.is_empty()).then(|| FeatureSet::of_groups(mesh, followed));
    };
    let mean = |piece: usize| -pieces.strength(piece as u32).min(1.0);
    let mut groups: Vec<FacetsOfFeature<D>> = (0..pieces.len())
        .map(|piece| FacetsOfFeature { facets: Vec::new(), mean: mean(piece) })
        .collect();
    for facet in &outcome.feature_facets {
        groups[facet.piece as usize].facets.push(facet.corners);
    }
    Some(FeatureSet::of_groups(mesh, &groups))
}

/// [`Outcome::world_mesh`].
pub(super) fn world_mesh_of<const D: usize>(outcome: &Outcome<D>) -> Mesh<D> {
    place(&outcome.mesh, outcome.frame(), outcome.units())
}

/// [`Outcome::sample_mesh`].
pub(super) fn sample_mesh_of<const D: usize>(outcome: &Outcome<D>) -> Mesh<D> {
    in_samples(&outcome.mesh, outcome.potential().grid())
}

/// [`Outcome::world_cells`].
pub(super) fn world_cells_of<const D: usize>(outcome: &Outcome<D>) -> Option<PolyMesh<D>> {
    let (frame, units) = (outcome.frame(), outcome.units());
    let to = |p: &Point<D>| frame.lattice_to_world(units, p);
    outcome.cells.as_ref().map(|cells| cells.moved(frame.is_mirrored(), to))
}

/// [`Outcome::sample_cells`].
pub(super) fn sample_cells_of<const D: usize>(outcome: &Outcome<D>) -> Option<PolyMesh<D>> {
    let grid = outcome.potential().grid();
    outcome.cells.as_ref().map(|cells| cells_in_samples(cells, grid))
}

/// [`Prepared::distance_at_samples`].
pub(super) fn distance_at_samples_of<const D: usize>(run: &Prepared<D>) -> Vec<f32> {
    let grid = run.potential().grid();
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
            *value = run.distance().at(&p) as f32;
        }
    });
    values
}

/// [`Outcome::cell_features_from`].
pub(super) fn cell_features_of<const D: usize>(
    outcome: &Outcome<D>,
    least: f64,
) -> Option<FeatureFaces> {
    let least_area = LEAST_FEATURE * outcome.distance().mean().powi(D as i32 - 1);
    let (potential, distance) = (outcome.potential(), outcome.distance());
    let cells = outcome.cells.as_ref()?;
    Some(match outcome.run.faced() {
        Some(pieces) => faces_of_pieces(cells, pieces, distance, potential),
        None => feature_faces(cells, potential, least, least_area),
    })
}

/// [`Outcome::feature_density`].
pub(super) fn feature_density_of<const D: usize>(outcome: &Outcome<D>) -> Vec<f32> {
    let (potential, smooth) = (outcome.potential(), outcome.distance().greatest());
    feature_density(potential.grid(), potential.samples(), smooth)
        .expect("a potential has a sample for each of its grid, and d is a length")
}

/// [`Outcome::wells`].
pub(super) fn wells_of<const D: usize>(outcome: &Outcome<D>) -> Vec<Option<u32>> {
    let points = outcome.cells.as_ref().map_or(outcome.mesh.points(), |cells| cells.centers());
    let place = |well: &Point<D>| points.iter().position(|p| p == well).map(|place| place as u32);
    seed_points(&outcome.run).iter().map(place).collect()
}

/// The wells that are points of the mesh, of those at one place the first.
fn well_groups<const D: usize>(outcome: &Outcome<D>) -> Vec<PointGroup> {
    let mut taken = HashSet::new();
    let wells = wells_of(outcome).into_iter().zip(1..);
    let wells = wells.filter_map(|(point, number)| Some((point?, number)));
    wells
        .filter(|(point, _)| taken.insert(*point))
        .map(|(point, id)| PointGroup { id, name: well_name(id), points: vec![point] })
        .collect()
}

/// [`Outcome::tags`].
pub(super) fn tags_of<const D: usize>(outcome: &Outcome<D>) -> Result<Tags<D>, TagsError> {
    let sides = sides(&outcome.mesh, &outcome.run.bounds(), false);
    let is_whole = outcome.outline().is_none();
    let mut groups: Vec<FacetGroup<D>> = (sides.facet_groups().iter())
        .filter(|group| is_whole || !group.facets.is_empty())
        .cloned()
        .collect();
    let mut id = 2 * D as u32;
    let mut add = |name: String, facets: Vec<[u32; D]>| {
        id += 1;
        groups.push(FacetGroup { id, name, facets });
    };
    if outcome.outline().is_some() {
        add(MASK_NAME.into(), outcome.outline_facets.clone());
    }
    for interface in outcome.labels.iter().flat_map(|l| interfaces(&outcome.mesh, l)) {
        add(interface_name(interface.labels), interface.facets);
    }
    let regions = outcome.labels.clone().map(|of_cells| Regions { of_cells, names: Vec::new() });
    let mut tags = Tags::new(&outcome.mesh, groups, regions)?;
    if let Some(features) = own_features(outcome, &outcome.mesh) {
        tags = tags.merge(features.tags(&outcome.mesh)?)?;
    }
    if outcome.cells.is_none() {
        tags = tags.with_point_groups(&outcome.mesh, well_groups(outcome))?;
    }
    Ok(if outcome.frame().is_mirrored() { tags.turned() } else { tags })
}

/// [`Outcome::quadratic`].
pub(super) fn quadratic_of<const D: usize>(outcome: &Outcome<D>) -> Quadratic<D> {
    let mut quadratic = Quadratic::new(&outcome.mesh);
    if let Some(outline) = outcome.outline() {
        let bounds = outcome.run.bounds();
        quadratic.curve(&outcome.outline_facets, |p| {
            outline.project(p, bounds.freedom(p), 0.3 * outcome.distance().at(p))
        });
    }
    let (frame, units) = (outcome.frame(), outcome.units());
    quadratic.moved(frame.is_mirrored(), |p| frame.lattice_to_world(units, p))
}

/// The sides of a mesh in lattice coordinates, turned as a move to the world turns its cells; see
/// [`Tags::sides`]. A point may be off a side by 1e-9 of the box.
pub fn sides<const D: usize>(mesh: &Mesh<D>, bounds: &Bounds<D>, mirrored: bool) -> Tags<D> {
    let extent = bounds.longest_edge();
    let tags = Tags::sides(mesh, bounds, 1e-9 * extent);
    if mirrored { tags.turned() } else { tags }
}

/// The mesh with its points moved to the world: cells turn over where the frame mirrors.
fn place<const D: usize>(mesh: &Mesh<D>, frame: &Frame<D>, units: Units) -> Mesh<D> {
    mesh.moved(frame.is_mirrored(), |p| frame.lattice_to_world(units, p))
}

/// A mesh in world coordinates, moved back to the lattice coordinates of an image's frame; the
/// inverse of [`Outcome::world_mesh`].
pub fn lattice_mesh<const D: usize>(mesh: &Mesh<D>, frame: &Frame<D>, units: Units) -> Mesh<D> {
    mesh.moved(frame.is_mirrored(), |p| frame.world_to_lattice(units, p))
}

/// The mesh with its points moved from lattice to sample coordinates.
pub(super) fn in_samples<const D: usize>(mesh: &Mesh<D>, grid: &Grid<D>) -> Mesh<D> {
    mesh.moved(false, |p| std::array::from_fn(|k| p[k] / grid.step[k]))
}

/// Voronoi cells in world coordinates, moved back to the lattice coordinates of an image's frame; the inverse of
/// [`Outcome::world_cells`]. Points that rounding has put off a side of the image's box are on it again.
pub fn lattice_cells<const D: usize>(
    cells: &PolyMesh<D>,
    frame: &Frame<D>,
    units: Units,
) -> PolyMesh<D> {
    let bounds = frame.grid(units).bounds();
    cells.moved(frame.is_mirrored(), |p| bounds.snap(&frame.world_to_lattice(units, p), 0.0))
}

/// The cells with their points moved from lattice to sample coordinates.
pub(super) fn cells_in_samples<const D: usize>(cells: &PolyMesh<D>, grid: &Grid<D>) -> PolyMesh<D> {
    cells.moved(false, |p| std::array::from_fn(|k| p[k] / grid.step[k]))
}
