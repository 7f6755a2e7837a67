//! The facets of a mesh that follow an image, as surfaces and as tags.

mod cells;
mod write;

pub(crate) use write::{note_lost, tagged};

use std::path::{Path, PathBuf};

use atomesh::enhance::{FeatureOptions, given_potential};
use atomesh::features::{
    FacetField, FacetTest, FacetsOfFeature, FeatureFacetOptions, FeatureSet, Selection,
};
use atomesh::fields::ScalarField;
use atomesh::image::{Frame, Image, Units};
use atomesh::mesh::{FacetGroup, Tags, is_feature_name};
use atomesh::run::MeshOptions;
use atomesh_io::mesh::{LoadedMesh, Provenance};

use crate::dimension::Dimension;
use crate::error::JobError;
use crate::images::{Beside, ImageRole};
use crate::mesh_file::{self, MeshFile};
use crate::options::{FrameOptions, PotentialOptions, RunConfig};
use crate::session::Session;
use crate::surfaces::ZPositive;
#[cfg(feature = "clap")]
use crate::values::{named, number_in};
pub use cells::{FeaturesOfCells, features_of_cells};
use write::FeatureFiles;

/// A mesh, the image whose features its facets follow, and where they go.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "clap", derive(clap::Args))]
pub struct FeaturesRequest {
    /// Mesh, in world coordinates: .vtu .vtk .msh .msh2 .npz .inp; or Voronoi cells that atomesh wrote: .vtu, or .json (a
    /// list of connections)
    #[cfg_attr(feature = "clap", arg(value_name = "MESH"))]
    pub mesh: PathBuf,
    /// Image whose features the facets follow. Its frame is that of the options below, else of the
    /// mesh if atomesh wrote it, else of this file
    #[cfg_attr(feature = "clap", arg(value_name = "IMAGE", conflicts_with = "potential"))]
    pub image: Option<PathBuf>,
    /// Potential b(x), an image with values from -1 (features) to 1
    #[cfg_attr(feature = "clap", arg(long, value_name = "FILE"))]
    pub potential: Option<PathBuf>,
    /// Surfaces to write: .vtp .obj .ply; in 3-D also .stl and .ts (GOCAD), in 2-D .pl (GOCAD)
    #[cfg_attr(feature = "clap", arg(short, long, value_name = "SURFACE"))]
    pub output: Option<PathBuf>,
    /// Where z grows, for GOCAD: down (depth) or up (elevation). Default: down of seismic data whose third axis is time
    /// or depth, else up
    #[cfg_attr(feature = "clap", arg(long, value_name = "WHERE",
        value_parser = named::<ZPositive>(&["depth", "elevation"])))]
    pub z_positive: Option<ZPositive>,
    /// Mesh to write with the features and the sides of the box as tagged facets: .vtu .msh .msh2 .inp, or
    /// a folder named polyMesh; Voronoi cells: .vtu
    #[cfg_attr(feature = "clap", arg(long, value_name = "MESH"))]
    pub mesh_output: Option<PathBuf>,
    /// Write the parts into which the features cut the mesh as its regions of cells, 1, 2 ..., in place of those
    /// that it has
    #[cfg_attr(feature = "clap", arg(long, requires = "mesh_output"))]
    pub regions: bool,
    /// With --regions, parts of fewer cells go to their neighbours
    #[cfg_attr(
        feature = "clap",
        arg(long, value_name = "COUNT", default_value_t = 0, requires = "regions")
    )]
    pub least_island: usize,
    /// File for the features in numbers (length or area, mean of b, box), as JSON
    #[cfg_attr(feature = "clap", arg(long, value_name = "JSON"))]
    pub json: Option<PathBuf>,
    /// Facets are chosen whose value of b is at most this, -1 to 1. Default: the mesh's own facets of features, if
    /// it has any; else -0.2
    #[cfg_attr(feature = "clap", arg(long, value_name = "B", allow_hyphen_values = true,
        value_parser = number_in(-1.0, 1.0, "a number from -1 to 1")))]
    pub below: Option<f64>,
    /// Value of b along a facet that counts: its mean, or its greatest
    #[cfg_attr(feature = "clap", arg(long, value_name = "VALUE", default_value = "mean",
        value_parser = named::<FacetTest>(&["mean", "max"])))]
    pub test: FacetTest,
    /// Pieces of fewer facets are dropped. Default: 3; of features that the mesh names, none is dropped
    #[cfg_attr(feature = "clap", arg(long, value_name = "COUNT"))]
    pub min_facets: Option<usize>,
    /// Pieces of less length (2-D) or area (3-D), in world units, are dropped
    #[cfg_attr(feature = "clap", arg(long, value_name = "MEASURE", default_value_t = Self::default().min_measure,
        value_parser = number_in(0.0, f64::MAX, "a number of 0 or more")))]
    pub min_measure: f64,
    /// Add facets where two ends or borders are one facet apart and the turn is at most 60°
    #[cfg_attr(feature = "clap", arg(long))]
    pub close_gaps: bool,
    /// Lattice units in which the potential is made. Default: those in which the mesh was made, else
    /// physical
    #[cfg_attr(feature = "clap", arg(long, value_name = "UNITS",
        value_parser = named::<Units>(&["physical", "samples"])))]
    pub units: Option<Units>,
    /// Features.
    #[cfg_attr(feature = "clap", command(flatten, next_help_heading = "Features"))]
    pub features: PotentialOptions,
    /// Frame.
    #[cfg_attr(feature = "clap", command(flatten, next_help_heading = "Frame"))]
    pub frame: FrameOptions,
}

impl Default for FeaturesRequest {
    fn default() -> Self {
        let FeatureFacetOptions { test, min_measure, close_gaps, .. } =
            FeatureFacetOptions::default();
        Self {
            mesh: PathBuf::new(),
            image: None,
            potential: None,
            output: None,
            z_positive: None,
            mesh_output: None,
            regions: false,
            least_island: 0,
            json: None,
            below: None,
            test,
            min_facets: None,
            min_measure,
            close_gaps,
            units: None,
            features: PotentialOptions::default(),
            frame: FrameOptions::default(),
        }
    }
}

impl FeaturesRequest {
    /// The image or potential along which b is read.
    fn source(&self) -> Option<&Path> {
        self.image.as_deref().or(self.potential.as_deref())
    }

    /// How facets are chosen.
    pub fn facet_options(&self) -> FeatureFacetOptions {
        let usual = FeatureFacetOptions::default();
        FeatureFacetOptions {
            below: self.below.unwrap_or(usual.below),
            test: self.test,
            min_facets: self.min_facets.unwrap_or(usual.min_facets),
            min_measure: self.min_measure,
            close_gaps: self.close_gaps,
        }
    }
}

impl FeaturesRequest {
    /// Refuses options that choose facets where the mesh's own features are taken.
    ///
    /// # Errors
    /// [`JobError`] names the option.
    fn check_own(&self) -> Result<(), JobError> {
        let given = [(self.close_gaps, "--close-gaps"), (self.test != FacetTest::Mean, "--test")];
        let Some((_, option)) = given.iter().find(|(is_given, _)| *is_given) else { return Ok(()) };
        let message = format!("{option} is of facets chosen by b, and the mesh names its features");
        Err(JobError::misuse(message).about(&self.mesh).advise("--below B chooses facets anew"))
    }
}

/// What became of [`features_file`].
#[derive(Clone, Debug)]
pub struct FeaturesSummary {
    /// How many features.
    pub features: usize,
    /// How many facets they have together.
    pub facets: usize,
    /// What was chosen and what became of it.
    pub selection: Selection,
    /// Whether b is the mesh's own, known at its points alone.
    pub from_points: bool,
}

/// Finds the facets of a mesh that follow features of an image, or of the mesh's own field `potential`.
///
/// `image` is placed; it is b(x) itself if the request names a potential.
///
/// # Errors
/// [`JobError`] if options make no sense, the image is of no use, the mesh has no such field, or the watch ends
/// the work.
pub fn features<const D: usize>(
    request: &FeaturesRequest,
    loaded: &LoadedMesh<D>,
    image: Option<Image<D>>,
    dimension: &Dimension<D>,
    session: &mut Session<'_>,
) -> Result<FeatureSet<D>, JobError> {
    let field = match (image, loaded.point_field("potential")) {
        (Some(image), _) => Some(along(request, loaded, image, dimension, session)?),
        (None, Some(values)) => {
            let field = FacetField::from_points(&loaded.mesh, values);
            Some(field.map_err(|e| JobError::from(e).about(&request.mesh))?)
        }
        (None, None) => None,
    };
    if request.below.is_none() && has_own_features(&loaded.tags) {
        return own_features(request, loaded, field.as_ref());
    }
    let Some(field) = field else {
        let message = "the mesh has no field `potential`; expected IMAGE or --potential FILE";
        return Err(JobError::misuse(message).about(&request.mesh));
    };
    Ok((dimension.tools.find_features)(&loaded.mesh, &field, &request.facet_options())?)
}

/// Whether tags name features.
fn has_own_features<const D: usize>(tags: &Tags<D>) -> bool {
    tags.facet_groups().iter().any(|group| is_feature_name(&group.name))
}

/// The features that the mesh's tags name, those that are large enough, with the mean of b along them where there is a b.
fn own_features<const D: usize>(
    request: &FeaturesRequest,
    loaded: &LoadedMesh<D>,
    field: Option<&FacetField<D>>,
) -> Result<FeatureSet<D>, JobError> {
    request.check_own()?;
    let mesh = &loaded.mesh;
    let groups = loaded.tags.facet_groups().iter().filter(|group| is_feature_name(&group.name));
    let of_feature = |group: &FacetGroup<D>| {
        let mut ascending = group.facets.clone();
        ascending.iter_mut().for_each(|corners| corners.sort_unstable());
        let mean = field.and_then(|field| field.mean_over(mesh, &ascending));
        FacetsOfFeature { facets: group.facets.clone(), mean: mean.unwrap_or(f64::NAN) }
    };
    let all: Vec<FacetsOfFeature<D>> = groups.map(of_feature).collect();
    let count = |of: &[FacetsOfFeature<D>]| of.iter().map(|one| one.facets.len()).sum::<usize>();
    let chosen = count(&all);
    let is_large_enough = |one: &FacetsOfFeature<D>| {
        one.facets.len() >= request.min_facets.unwrap_or(1)
            && one.measure(mesh) >= request.min_measure
    };
    let kept: Vec<_> = all.into_iter().filter(is_large_enough).collect();
    let selection = Selection { chosen, dropped: chosen - count(&kept), ..Selection::default() };
    Ok(FeatureSet { selection, ..FeatureSet::of_groups(mesh, &kept) })
}

/// b along the facets, from an image or potential.
pub(crate) fn along<const D: usize>(
    request: &FeaturesRequest,
    loaded: &LoadedMesh<D>,
    image: Image<D>,
    dimension: &Dimension<D>,
    session: &mut Session<'_>,
) -> Result<FacetField<D>, JobError> {
    let (frame, units, potential) =
        potential(request, loaded.provenance.as_ref(), image, dimension, session)?;
    let mesh = (dimension.tools.lattice_mesh)(&loaded.mesh, &frame, units);
    Ok((dimension.tools.field_along)(&mesh, &potential, session)?)
}

/// b from an image or potential, with the frame and the lattice units that it is in.
pub(crate) fn potential<const D: usize>(
    request: &FeaturesRequest,
    made_by: Option<&Provenance>,
    image: Image<D>,
    dimension: &Dimension<D>,
    session: &mut Session<'_>,
) -> Result<(Frame<D>, Units, ScalarField<D>), JobError> {
    let path = request.source().unwrap_or(&request.mesh);
    let units = mesh_file::units(made_by);
    let units = request.units.or(units).unwrap_or_default();
    let run = RunConfig { features: request.features.clone(), ..RunConfig::default() };
    let options: MeshOptions<D> = run.mesh_options()?;
    let (frame, samples) = if request.potential.is_some() {
        let (frame, samples) = image.into_parts();
        (frame, given_potential(samples).map_err(|e| JobError::content(e).about(path))?)
    } else {
        let options = FeatureOptions { units, ..options.features };
        let enhanced = (dimension.tools.enhance)(&image, &options, session);
        let enhanced = enhanced.map_err(|e| JobError::from(e).about_content(path))?;
        (*image.frame(), enhanced.values)
    };
    let potential = (dimension.tools.potential)(frame.grid(units), samples, options.interpolation);
    let potential = potential.map_err(|e| JobError::content(e).about(path))?;
    Ok((frame, units, potential))
}

/// Finds features of files, and writes them.
///
/// # Errors
/// As [`features()`], and if a file cannot be read or written.
pub fn features_file(
    request: &FeaturesRequest,
    session: &mut Session<'_>,
) -> Result<FeaturesSummary, JobError> {
    let files = FeatureFiles::new(request, session)?;
    let file = mesh_file::read(&request.mesh, session)?;
    if request.mesh_output.is_some() {
        file.note_skipped(&request.mesh, session);
    }
    match file {
        MeshFile::Flat(mesh) => run(request, &files, &mesh, &Dimension::plane(), session),
        MeshFile::Volume(mesh) => run(request, &files, &mesh, &Dimension::space(), session),
        MeshFile::Polygons(mesh) => {
            cells::run(request, &files, &mesh, &Dimension::plane(), session)
        }
        MeshFile::Polyhedra(mesh) => {
            cells::run(request, &files, &mesh, &Dimension::space(), session)
        }
    }
}

fn run<const D: usize>(
    request: &FeaturesRequest,
    files: &FeatureFiles<'_>,
    loaded: &LoadedMesh<D>,
    dimension: &Dimension<D>,
    session: &mut Session<'_>,
) -> Result<FeaturesSummary, JobError> {
    files.check_dimension(D)?;
    let (frame, options) = (loaded.frame.as_ref(), &request.frame);
    let provenance = loaded.provenance.as_ref();
    let beside = Beside { frame, provenance, options, role: ImageRole::Followed };
    let image = match request.source() {
        Some(path) => Some(beside.read(path, dimension, session)?),
        None => None,
    };
    // the mesh's own facets need no b to be chosen by
    let from_points =
        image.is_none() && (request.below.is_some() || !has_own_features(&loaded.tags));
    let found = features(request, loaded, image, dimension, session)?;
    files.write(loaded, &found, dimension, session)?;
    let facets = found.features.iter().map(|feature| feature.facets.len()).sum();
    let (features, selection) = (found.features.len(), found.selection);
    Ok(FeaturesSummary { features, facets, selection, from_points })
}
