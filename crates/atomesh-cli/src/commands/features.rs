//! `atomesh features`: the facets of a mesh that follow an image, as surfaces and as tags.

use std::path::{Path, PathBuf};

use atomesh::enhance::{EnhanceError, enhance, given_potential};
use atomesh::features::{
    FacetField, FacetTest, FeatureFacetOptions, FeatureSet, FeaturesError, find_features,
};
use atomesh::fields::ScalarField;
use atomesh::image::{Image, Units};
use atomesh::mesh::{Tags, is_feature_name};
use atomesh::run::{MeshOptions, lattice_mesh};
use atomesh_io::image::AnyImage;
use atomesh_io::mesh::{AnyMesh, LoadedMesh, MeshData, MeshFormat, MeshWriteError, write_mesh};
use atomesh_io::surface::{SurfaceFormat, SurfaceWriteError, write_surface};
use serde_json::json;

use crate::failure::Failure;
use crate::frame_options::{self, FrameOptions};
use crate::mesh_file;
use crate::outputs::{check_writable, write_bytes};
use crate::progress::{Progress, writing};
use crate::run_config::{PotentialOptions, RunConfig};
use crate::values::{named, number_in};

/// Find the facets of a mesh that follow features of an image: faults, horizons, outlines
///
/// Facets along which the potential b is low are chosen, freed of small pieces, and parted where more than
/// two of them meet into polylines (2-D) or surfaces (3-D), each turned one way: feature-1 is the largest.
/// They are written as surfaces, and as tagged facets of the mesh, beside the sides of the box.
///
/// b comes from an image, by the options of features below, or from a potential; it is read between samples
/// along each facet. Without either it is the mesh's own field `potential`, known at points alone: poorer, as
/// a facet between two features seems to lie on one.
#[derive(Debug, clap::Args)]
#[command(
    allow_negative_numbers = true,
    after_help = "\
Examples:
  atomesh mesh faults.png -o faults.vtu --size 8 --write-potential b.npy
  atomesh features faults.vtu --potential b.npy --below -0.2 -o faults.vtp
  atomesh features brain.vtu t1.nii.gz --features edges -o outlines.stl --mesh-output brain.msh"
)]
pub struct FeaturesArgs {
    /// Mesh, in world coordinates: .vtu .vtk .msh .msh2 .npz .inp
    #[arg(value_name = "MESH")]
    mesh: PathBuf,
    /// Image whose features the facets follow. A frame is taken from the options below, else from the
    /// mesh if atomesh wrote it, else from this file
    #[arg(value_name = "IMAGE", conflicts_with = "potential")]
    image: Option<PathBuf>,
    /// Potential b(x), an image with values in -1 (features) to 1
    #[arg(long, value_name = "FILE")]
    potential: Option<PathBuf>,
    /// Surfaces to write: .vtp .obj .ply; in 3-D also .stl and .ts (GOCAD), in 2-D .pl (GOCAD)
    #[arg(short, long, value_name = "SURFACE")]
    output: Option<PathBuf>,
    /// Mesh to write with the features and the sides of the box as tagged facets: .vtu .msh .msh2 .inp, or
    /// a folder named polyMesh
    #[arg(long, value_name = "MESH")]
    mesh_output: Option<PathBuf>,
    /// Write the parts into which the features cut the mesh as its regions of cells, 1, 2 ..., in place of those
    /// that it has
    #[arg(long, requires = "mesh_output")]
    regions: bool,
    /// With --regions, parts of fewer cells go to their neighbours
    #[arg(long, value_name = "COUNT", default_value_t = 0, requires = "regions")]
    least_island: usize,
    /// File for the features in numbers (length or area, mean of b, box), as JSON
    #[arg(long, value_name = "JSON")]
    json: Option<PathBuf>,
    /// Value of b up to which facets are chosen
    #[arg(long, value_name = "B", default_value_t = -0.2,
        value_parser = number_in(-1.0, 1.0, "a number from -1 to 1"))]
    below: f64,
    /// Value of b along a facet that counts: its mean, or the greatest
    #[arg(long, value_name = "VALUE", default_value = "mean",
        value_parser = named::<FacetTest>(&["mean", "max"]))]
    test: FacetTest,
    /// Pieces of fewer facets are dropped
    #[arg(long, value_name = "COUNT", default_value_t = 3)]
    min_facets: usize,
    /// Pieces of less length (2-D) or area (3-D), in world units, are dropped likewise
    #[arg(long, value_name = "MEASURE", default_value_t = 0.0,
        value_parser = number_in(0.0, f64::MAX, "a number of 0 or more"))]
    min_measure: f64,
    /// Add facets where two ends or borders are one facet apart and go on without a turn of more than 60°
    #[arg(long)]
    close_gaps: bool,
    /// Lattice units in which the potential is read. Default: those in which the mesh was made, else
    /// physical
    #[arg(long, value_name = "UNITS", value_parser = named::<Units>(&["physical", "samples"]))]
    units: Option<Units>,
    #[command(flatten, next_help_heading = "Features")]
    features: PotentialOptions,
    #[command(flatten, next_help_heading = "Frame")]
    frame: FrameOptions,
}

/// Runs the command; the text is for standard output.
///
/// # Errors
/// [`Failure`] if a file cannot be used or options make no sense.
pub fn run(args: &FeaturesArgs, watch: &mut Progress) -> Result<String, Failure> {
    let formats = check_outputs(args)?;
    let options = args.frame.read_options()?;
    let mesh = mesh_file::read(&args.mesh)?;
    let path = args.image.as_ref().or(args.potential.as_ref());
    let image = path.map(|path| frame_options::read(path, &options, watch)).transpose()?;
    match (mesh, image) {
        (AnyMesh::Flat(mesh), None) => find(args, formats, &mesh, None, watch),
        (AnyMesh::Volume(mesh), None) => find(args, formats, &mesh, None, watch),
        (AnyMesh::Flat(mesh), Some(AnyImage::Flat(image))) => {
            find(args, formats, &mesh, Some(image), watch)
        }
        (AnyMesh::Volume(mesh), Some(AnyImage::Volume(image))) => {
            find(args, formats, &mesh, Some(image), watch)
        }
        (mesh, Some(image)) => {
            let cells = match mesh {
                AnyMesh::Flat(_) => "triangles",
                AnyMesh::Volume(_) => "tetrahedra",
            };
            let message = format!("has {} axes; the mesh is made of {cells}", image.dimension());
            let failure = Failure::content(message);
            Err(path.map_or(failure.clone(), |path| failure.about(path)))
        }
    }
}

/// The format of the surfaces, if they are written.
fn check_outputs(args: &FeaturesArgs) -> Result<Option<SurfaceFormat>, Failure> {
    if args.output.is_none() && args.mesh_output.is_none() && args.json.is_none() {
        let message = "nothing to write; expected -o SURFACE, --mesh-output MESH or --json JSON";
        return Err(Failure::misuse(message));
    }
    let _guard = writing();
    let mut format = None;
    if let Some(path) = &args.output {
        format = Some(SurfaceFormat::of(path).map_err(|_| {
            let known = SurfaceFormat::EXTENSIONS;
            let message = format!("the ending says no surface format; expected one of {known}");
            Failure::misuse(message).about(path)
        })?);
        check_writable(path)?;
    }
    if let Some(path) = &args.mesh_output {
        let known = MeshFormat::of(path).ok().filter(|format| format.holds_tags());
        let Some(known) = known else {
            let message = "the ending says no mesh format that holds tags; \
                 expected one of .vtu, .msh, .msh2, .inp, polyMesh";
            return Err(Failure::misuse(message).about(path));
        };
        known
            .check_writable(path)
            .map_err(|e| Failure::content(format!("cannot be written: {e}")).about(path))?;
    }
    if let Some(path) = &args.json {
        check_writable(path)?;
    }
    Ok(format)
}

fn find<const D: usize>(
    args: &FeaturesArgs,
    format: Option<SurfaceFormat>,
    loaded: &LoadedMesh<D>,
    image: Option<Image<D>>,
    watch: &mut Progress,
) -> Result<String, Failure> {
    if let (Some(format), Some(path)) = (format, &args.output) {
        format.check_dimension(D).map_err(|e| Failure::misuse(e).about(path))?;
    }
    let field = match image {
        Some(image) => along(args, loaded, image, watch)?,
        None => {
            let Some(values) = loaded.point_field("potential") else {
                let message =
                    "the mesh has no field `potential`; expected IMAGE or --potential FILE";
                return Err(Failure::misuse(message).about(&args.mesh));
            };
            watch.say("b is the mesh's own, at its points; an image or --potential tells more");
            FacetField::from_points(&loaded.mesh, values)
                .map_err(|e| failure(e).about(&args.mesh))?
        }
    };
    let options = FeatureFacetOptions {
        below: args.below,
        test: args.test,
        min_facets: args.min_facets,
        min_measure: args.min_measure,
        close_gaps: args.close_gaps,
    };
    let found = find_features(&loaded.mesh, &field, &options).map_err(failure)?;
    let _guard = writing();
    write(args, loaded, &found, watch)?;
    let facets: usize = found.features.iter().map(|feature| feature.facets.len()).sum();
    let (selection, features) = (found.selection, found.features.len());
    watch.say(&format!(
        "{}: {features} features of {facets} facets; {} chosen, {} added, {} dropped",
        args.mesh.display(),
        selection.chosen,
        selection.added,
        selection.dropped
    ));
    Ok(String::new())
}

/// b along the facets, read from an image or potential.
fn along<const D: usize>(
    args: &FeaturesArgs,
    loaded: &LoadedMesh<D>,
    image: Image<D>,
    watch: &mut Progress,
) -> Result<FacetField<D>, Failure> {
    let path = args.image.as_ref().or(args.potential.as_ref()).unwrap_or(&args.mesh);
    let about = |f: Failure| f.about(path);
    let known = loaded.frame.filter(|frame| frame.shape() == image.frame().shape());
    let frame = known.unwrap_or(*image.frame());
    let image = image.with_frame(frame).map_err(Failure::content).map_err(about)?;
    let image = args.frame.place(image).map_err(about)?;
    let units = args.units.or_else(|| units(loaded)).unwrap_or_default();
    let run = RunConfig { features: args.features.clone(), ..RunConfig::default() };
    let options: MeshOptions<D> = run.mesh_options()?;
    let (frame, samples) = if args.potential.is_some() {
        let (frame, samples) = image.into_parts();
        (frame, given_potential(samples).map_err(Failure::content).map_err(about)?)
    } else {
        let options = atomesh::enhance::FeatureOptions { units, ..options.features };
        let enhanced = enhance(&image, &options, watch).map_err(|e| match e {
            EnhanceError::Cancelled(_) => Failure::cancelled(),
            EnhanceError::EdgeScale { .. } | EnhanceError::Smooth { .. } => Failure::misuse(e),
            _ => about(Failure::content(e)),
        })?;
        (*image.frame(), enhanced.values)
    };
    let potential = ScalarField::new(frame.grid(units), samples, options.interpolation);
    let potential = potential.map_err(Failure::content).map_err(about)?;
    let mesh = lattice_mesh(&loaded.mesh, &frame, units);
    FacetField::along(&mesh, &potential, watch).map_err(failure)
}

fn failure(error: FeaturesError) -> Failure {
    match error {
        FeaturesError::Cancelled(_) => Failure::cancelled(),
        FeaturesError::PointCount { .. } => Failure::content(error),
        _ => Failure::misuse(error),
    }
}

/// The lattice units in which atomesh made the mesh.
fn units<const D: usize>(loaded: &LoadedMesh<D>) -> Option<Units> {
    let options = &loaded.provenance.as_ref()?.options;
    serde_json::from_value(options.get("lattice")?.get("units")?.clone()).ok()
}

fn write<const D: usize>(
    args: &FeaturesArgs,
    loaded: &LoadedMesh<D>,
    found: &FeatureSet<D>,
    watch: &mut Progress,
) -> Result<(), Failure> {
    let mesh = &loaded.mesh;
    if let Some(path) = &args.output {
        let means: Vec<f32> = found.features.iter().map(|feature| feature.mean as f32).collect();
        let written = write_surface(path, mesh, &found.groups(), Some(&means), watch);
        written.map_err(|e| match e {
            SurfaceWriteError::Cancelled(_) => Failure::cancelled(),
            _ => Failure::content(e).about(path),
        })?;
    }
    if let Some(path) = &args.mesh_output {
        write_tagged(path, loaded, tags(args, loaded, found)?, watch)?;
    }
    if let Some(path) = &args.json {
        let report = json!({
            "selection": found.selection,
            "intersections": found.intersections.len(),
            "features": found.report(mesh),
        });
        write_bytes(path, format!("{report:#}\n").as_bytes())?;
    }
    Ok(())
}

/// The mesh's own tags without features that it had; the sides of its box if it has none; the features.
fn tags<const D: usize>(
    args: &FeaturesArgs,
    loaded: &LoadedMesh<D>,
    found: &FeatureSet<D>,
) -> Result<Tags<D>, Failure> {
    let mesh = &loaded.mesh;
    let groups = loaded.tags.facet_groups();
    let kept: Vec<_> =
        groups.iter().filter(|group| !is_feature_name(&group.name)).cloned().collect();
    let has_groups = !kept.is_empty();
    let regions = match args.regions {
        true => Some(found.regions(mesh, args.least_island)),
        false => loaded.tags.regions().cloned(),
    };
    let mut tags = Tags::new(mesh, kept, regions).map_err(Failure::content)?;
    if !has_groups {
        tags = mesh_file::own_sides(mesh, loaded.frame.as_ref())
            .merge(tags)
            .map_err(Failure::content)?;
    }
    tags.merge(found.tags(mesh).map_err(Failure::content)?).map_err(Failure::content)
}

fn write_tagged<const D: usize>(
    path: &Path,
    loaded: &LoadedMesh<D>,
    tags: Tags<D>,
    watch: &mut Progress,
) -> Result<(), Failure> {
    let mut data = MeshData::new(&loaded.mesh).with_tags(&tags);
    for field in &loaded.point_fields {
        // a name that another program gave may not fit every format
        let with = data.clone().with_point_field(&field.name, &field.values);
        data = with.unwrap_or(data);
    }
    if let Some(frame) = &loaded.frame {
        data = data.with_frame(frame);
    }
    if let Some(provenance) = &loaded.provenance {
        data = data.with_provenance(provenance);
    }
    write_mesh(path, &data, watch).map_err(|e| match e {
        MeshWriteError::Cancelled(_) => Failure::cancelled(),
        _ => Failure::content(e).about(path),
    })
}
