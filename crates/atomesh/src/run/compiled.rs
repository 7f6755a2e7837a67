//! The stages of a run, compiled here for the plane and for space.
//!
//! Whoever is generic over D and calls the stages through these tables compiles none of the work again: it was
//! compiled once, with this crate.

use crate::features::{FeatureFaces, FeatureFacetOptions, FeatureSet};
use crate::image::Samples;
use crate::measure::FidelityReport;
use crate::mesh::{Mesh, PolyMesh, Quadratic, Tags, TagsError};
use crate::watch::Watch;

use super::across::{self, AcrossFeature};
use super::connected::{self, Connected};
use super::divided::{self, Divided};
use super::error::RunError;
use super::filled::{self, Filled};
use super::improved::{self, Improved};
use super::inputs::Inputs;
use super::method::Method;
use super::options::MeshOptions;
use super::outcome::{self, Outcome};
use super::prepare;
use super::prepared::{self, Prepared};
use super::report::{self, MeshReport, VoronoiReport};
use super::settled::{self, Settled};

/// What a stage gives.
type Made<T> = Result<T, RunError>;

/// [`super::prepare()`].
type Prepare<const D: usize> =
    fn(&Method<D>, Inputs<'_, D>, MeshOptions<D>, &mut dyn Watch) -> Made<Prepared<D>>;

/// [`Outcome::features`].
type Features<const D: usize> =
    fn(&Outcome<D>, &Mesh<D>, &FeatureFacetOptions, &mut dyn Watch) -> Made<FeatureSet<D>>;

/// The work of every stage.
pub(super) struct Stages<const D: usize> {
    pub prepare: Prepare<D>,
    pub fill: fn(&Prepared<D>, &mut dyn Watch) -> Made<Filled<D>>,
    pub settle: fn(Filled<D>, &mut dyn Watch) -> Made<Settled<D>>,
    pub connect: fn(Settled<D>, &mut dyn Watch) -> Made<Connected<D>>,
    pub improve: fn(Connected<D>, &mut dyn Watch) -> Made<Improved<D>>,
    pub finish: fn(Improved<D>, &mut dyn Watch) -> Made<Outcome<D>>,
    pub divide: fn(Settled<D>, &mut dyn Watch) -> Made<Divided<D>>,
    pub finish_divided: fn(Divided<D>, &mut dyn Watch) -> Made<Outcome<D>>,
    pub report: fn(&Outcome<D>, &mut dyn Watch) -> Made<MeshReport>,
    pub cells_report: fn(&Outcome<D>, &mut dyn Watch) -> Made<Option<VoronoiReport>>,
    pub fidelity: fn(&Outcome<D>, &Samples, &mut dyn Watch) -> Made<FidelityReport>,
    pub features: Features<D>,
    pub world_mesh: fn(&Outcome<D>) -> Mesh<D>,
    pub sample_mesh: fn(&Outcome<D>) -> Mesh<D>,
    pub world_cells: fn(&Outcome<D>) -> Option<PolyMesh<D>>,
    pub sample_cells: fn(&Outcome<D>) -> Option<PolyMesh<D>>,
    pub distance_at_samples: fn(&Prepared<D>) -> Vec<f32>,
    pub cell_features: fn(&Outcome<D>, f64) -> Option<FeatureFaces>,
    pub across_features: fn(&Outcome<D>, &mut dyn Watch) -> Made<Vec<AcrossFeature<D>>>,
    pub feature_density: fn(&Outcome<D>) -> Vec<f32>,
    pub wells: fn(&Outcome<D>) -> Vec<Option<u32>>,
    pub tags: fn(&Outcome<D>) -> Result<Tags<D>, TagsError>,
    pub quadratic: fn(&Outcome<D>) -> Quadratic<D>,
}

impl<const D: usize> Stages<D> {
    const fn new() -> Self {
        Self {
            prepare: prepare::prepare,
            fill: prepared::fill,
            settle: filled::settle,
            connect: settled::connect,
            improve: connected::improve,
            finish: improved::finish,
            divide: settled::divide,
            finish_divided: divided::finish,
            report: report::of_mesh,
            cells_report: report::of_cells,
            fidelity: report::fidelity_of,
            features: outcome::features_of,
            world_mesh: outcome::world_mesh_of,
            sample_mesh: outcome::sample_mesh_of,
            world_cells: outcome::world_cells_of,
            sample_cells: outcome::sample_cells_of,
            distance_at_samples: outcome::distance_at_samples_of,
            cell_features: outcome::cell_features_of,
            across_features: across::across_features,
            feature_density: outcome::feature_density_of,
            wells: outcome::wells_of,
            tags: outcome::tags_of,
            quadratic: outcome::quadratic_of,
        }
    }
}

/// The stages in the plane.
pub(super) static PLANE: Stages<2> = Stages::new();

/// The stages in space.
pub(super) static SPACE: Stages<3> = Stages::new();
