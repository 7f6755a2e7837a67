//! `atomesh report`: how good any mesh is, for an image potential.

use std::path::{Path, PathBuf};

use atomesh::enhance::given_potential;
use atomesh::image::{Image, Units};
use atomesh::mesh::Mesh;
use atomesh::pipeline::{MeshReport, lattice_mesh};
use atomesh_io::image::AnyImage;
use atomesh_io::mesh::{AnyMesh, LoadedMesh};

use crate::failure::Failure;
use crate::frame_options::{self, FrameOptions};
use crate::mesh_file;
use crate::outputs::{check_writable, write_bytes};
use crate::progress::{Progress, writing};
use crate::values::{named, number_in};

/// Measure the shape of a mesh and how it follows the features of a potential
///
/// Shape: q = D · inradius / circumradius per cell (1 if equilateral), the least angle (dihedral in
/// 3-D), edge lengths, and how far the volume is from the image's box.
///
/// Alignment: features are the valleys of the potential, smoothed by max(1, d/6) samples, deeper than
/// 0.25, in groups of at least 4d (2-D) or 6d² (3-D) samples. Recall is the share of them that a facet
/// passes within max(1 sample, d/10) and 20°. Distances are in samples.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  atomesh mesh t1.nii.gz -o brain.vtu --features edges --size 6 --write-potential b.nii.gz
  atomesh report brain.vtu --potential b.nii.gz --json brain.json
  atomesh report other.msh --potential b.npy --size 6 --origin -98,-134,-72")]
pub struct ReportArgs {
    /// Mesh to measure, in world coordinates: .vtu .vtk .msh .msh2 .npz .inp
    #[arg(value_name = "MESH")]
    mesh: PathBuf,
    /// Potential b(x), an image with values in -1 (features) to 1. A frame is taken from the options
    /// below, else from the mesh if atomesh wrote it, else from this file
    #[arg(long, value_name = "FILE")]
    potential: PathBuf,
    /// Edge length d of the mesh in lattice units. Default: the mean of the field `distance` of the
    /// mesh
    #[arg(long, value_name = "D", allow_hyphen_values = true,
        value_parser = number_in(f64::MIN_POSITIVE, f64::MAX, "a length above 0"))]
    size: Option<f64>,
    /// Lattice units in which shape is measured. Default: those in which the mesh was made, else
    /// physical
    #[arg(long, value_name = "UNITS", value_parser = named::<Units>(&["physical", "samples"]))]
    units: Option<Units>,
    /// File for the report as JSON. Default: standard output
    #[arg(long, value_name = "JSON")]
    json: Option<PathBuf>,
    #[command(flatten, next_help_heading = "Frame")]
    frame: FrameOptions,
}

/// Runs the command; the text is for standard output.
///
/// # Errors
/// [`Failure`] if a file cannot be used or options make no sense.
pub fn run(args: &ReportArgs, watch: &mut Progress) -> Result<String, Failure> {
    if let Some(path) = &args.json {
        let _guard = writing();
        check_writable(path)?;
    }
    let raw = args.frame.raw_layout()?;
    let mesh = mesh_file::read(&args.mesh)?;
    let potential = frame_options::read(&args.potential, raw, watch)?;
    let report = match (mesh, potential) {
        (AnyMesh::Flat(mesh), AnyImage::Flat(potential)) => measure(args, &mesh, potential, watch)?,
        (AnyMesh::Volume(mesh), AnyImage::Volume(potential)) => {
            measure(args, &mesh, potential, watch)?
        }
        (mesh, potential) => {
            let cells = match mesh {
                AnyMesh::Flat(_) => "triangles",
                AnyMesh::Volume(_) => "tetrahedra",
            };
            let axes = potential.dimension();
            let message = format!("has {axes} axes; the mesh is made of {cells}");
            return Err(Failure::content(message).about(&args.potential));
        }
    };
    let text = serde_json::to_string_pretty(&report).map_err(Failure::content)? + "\n";
    let _guard = writing();
    match &args.json {
        Some(path) => write_bytes(path, text.as_bytes()).map(|()| String::new()),
        None => Ok(text),
    }
}

fn measure<const D: usize>(
    args: &ReportArgs,
    loaded: &LoadedMesh<D>,
    potential: Image<D>,
    watch: &mut Progress,
) -> Result<MeshReport, Failure> {
    let about = |path: &Path| {
        let path = path.to_path_buf();
        move |f: Failure| f.about(&path)
    };
    let known = loaded.frame.filter(|f| f.shape() == potential.frame().shape());
    let frame = known.unwrap_or(*potential.frame());
    let potential = potential.with_frame(frame).map_err(Failure::content)?;
    let potential = args.frame.place(potential).map_err(about(&args.potential))?;
    let (frame, samples) = potential.into_parts();
    let samples =
        given_potential(samples).map_err(|e| Failure::content(e).about(&args.potential))?;

    let units = args.units.or_else(|| units(loaded)).unwrap_or_default();
    let mesh = lattice_mesh(&loaded.mesh, &frame, units);
    let field = || mean(&mesh, loaded.point_field("distance")?);
    let Some(size) = args.size.or_else(field) else {
        let message = "the mesh has no field `distance`; expected --size D";
        return Err(Failure::misuse(message).about(&args.mesh));
    };
    let report = MeshReport::new(&mesh, &frame.grid(units), &samples, size.into(), watch);
    report.map_err(super::measure_failure).map_err(about(&args.mesh))
}

/// The lattice units in which atomesh made the mesh.
fn units<const D: usize>(loaded: &LoadedMesh<D>) -> Option<Units> {
    let options = &loaded.provenance.as_ref()?.options;
    serde_json::from_value(options.get("lattice")?.get("units")?.clone()).ok()
}

/// The mean over the mesh of a field at its points.
fn mean<const D: usize>(mesh: &Mesh<D>, field: &[f32]) -> Option<f64> {
    let (mut sum, mut total) = (0.0, 0.0);
    for (cell, simplex) in mesh.cells().zip(mesh.simplices()) {
        let measure = simplex.measure().abs();
        let values: f64 = cell.iter().map(|&i| f64::from(field[i as usize])).sum();
        sum += measure * values / cell.len() as f64;
        total += measure;
    }
    let mean = sum / total;
    (mean.is_finite() && mean > 0.0).then_some(mean)
}
