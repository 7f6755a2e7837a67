//! `atomesh report`: how good any mesh is, for an image potential.

use std::path::{Path, PathBuf};

use atomesh::enhance::given_potential;
use atomesh::image::{Image, Samples, Units};
use atomesh::measure::{WantedSize, fidelity, homogeneity};
use atomesh::mesh::Mesh;
use atomesh::run::{MeshReport, lattice_mesh};
use atomesh_draw::Style;
use atomesh_io::image::ImageFormat;
use atomesh_io::mesh::{AnyMesh, LoadedMesh};

use super::mesh::caption;
use crate::dimension::Dimension;
use crate::failure::Failure;
use crate::frame_options::{self, FrameOptions};
use crate::mesh_file;
use crate::outputs::{check_writable, write_bytes};
use crate::progress::{Progress, writing};
use crate::report_page::{PageParts, option_rows, write_page};
use crate::values::{named, number_in};

/// Measure the shape of a mesh and how it follows the features of a potential
///
/// Shape: q = D · inradius / circumradius per cell (1 if equilateral), the least angle (dihedral in
/// 3-D), edge lengths, and how far the volume is from the image's box.
///
/// Alignment: features are the valleys of the potential, smoothed by max(1, d/6) samples, deeper than
/// 0.25, in groups of at least 4d (2-D) or 6d² (3-D) samples. Recall is the share of them that a facet
/// passes within max(1 sample, d/10) and 20°. Precision is the share, by length or area, of the facets with a
/// mean potential of -0.2 or less that lies as near to features. Distances are in samples.
///
/// Fidelity, with --image: RMS error of the image rebuilt from the mesh, with the mean of each cell and with the
/// continuous piecewise linear fit of least squares. Homogeneity, with --labels: share of a cell that its
/// dominant label fills, averaged over the volume.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  atomesh mesh t1.nii.gz -o brain.vtu --features edges --size 6 --write-potential b.nii.gz
  atomesh report brain.vtu --potential b.nii.gz --json brain.json
  atomesh report brain.vtu --potential b.nii.gz --image t1.nii.gz --html brain.html
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
    /// Image to rebuild from the mesh: fidelity is the error that is left, with a constant in each cell and
    /// with the best continuous linear fit
    #[arg(long, value_name = "FILE")]
    image: Option<PathBuf>,
    /// Image of labels, whole numbers: homogeneity is the share of a cell that its dominant label fills
    #[arg(long, value_name = "FILE")]
    labels: Option<PathBuf>,
    /// File for the report as JSON. Default: standard output, unless --html is given
    #[arg(long, value_name = "JSON")]
    json: Option<PathBuf>,
    /// File for the report as one HTML page with a picture and histograms, which needs no other file
    #[arg(long, value_name = "HTML")]
    html: Option<PathBuf>,
    #[command(flatten, next_help_heading = "Frame")]
    frame: FrameOptions,
}

/// Runs the command; the text is for standard output.
///
/// # Errors
/// [`Failure`] if a file cannot be used or options make no sense.
pub fn run(args: &ReportArgs, watch: &mut Progress) -> Result<String, Failure> {
    for path in args.json.iter().chain(&args.html) {
        let _guard = writing();
        check_writable(path)?;
    }
    let report = match mesh_file::read(&args.mesh)? {
        AnyMesh::Flat(mesh) => measure(args, &mesh, &Dimension::flat(), watch)?,
        AnyMesh::Volume(mesh) => measure(args, &mesh, &Dimension::volume(), watch)?,
    };
    let text = serde_json::to_string_pretty(&report).map_err(Failure::content)? + "\n";
    let _guard = writing();
    match &args.json {
        Some(path) => write_bytes(path, text.as_bytes()).map(|()| String::new()),
        None if args.html.is_some() => Ok(String::new()),
        None => Ok(text),
    }
}

/// Reads an image of the mesh's dimension. Its frame is the mesh's if the shapes agree.
fn read<const D: usize>(
    args: &ReportArgs,
    path: &Path,
    loaded: &LoadedMesh<D>,
    dimension: &Dimension<D>,
    watch: &mut Progress,
) -> Result<Image<D>, Failure> {
    let any = frame_options::read(path, &args.frame.read_options()?, watch)?;
    let axes = any.dimension();
    let Some(image) = (dimension.image)(any) else {
        let message = format!("has {axes} axes; the mesh is made of {}", dimension.cells);
        return Err(Failure::content(message).about(path));
    };
    let known = loaded.frame.filter(|f| f.shape() == image.frame().shape());
    let frame = known.unwrap_or(*image.frame());
    let image = image.with_frame(frame).map_err(Failure::content)?;
    args.frame.place(image).map_err(|f| f.about(path))
}

fn measure<const D: usize>(
    args: &ReportArgs,
    loaded: &LoadedMesh<D>,
    dimension: &Dimension<D>,
    watch: &mut Progress,
) -> Result<MeshReport, Failure> {
    let about = |path: &Path| {
        let path = path.to_path_buf();
        move |f: Failure| f.about(&path)
    };
    let potential = read(args, &args.potential, loaded, dimension, watch)?;
    let image = match &args.image {
        Some(path) => Some(read(args, path, loaded, dimension, watch)?),
        None => None,
    };
    let labels = match &args.labels {
        Some(path) => Some(read(args, path, loaded, dimension, watch)?),
        None => None,
    };
    let (frame, samples) = potential.into_parts();
    let samples =
        given_potential(samples).map_err(|e| Failure::content(e).about(&args.potential))?;

    let units = args.units.or_else(|| units(loaded)).unwrap_or_default();
    let mesh = lattice_mesh(&loaded.mesh, &frame, units);
    let field = loaded.point_field("distance").filter(|_| args.size.is_none());
    let Some(size) = args.size.or_else(|| mean(&mesh, field?)) else {
        let message = "the mesh has no field `distance`; expected --size D";
        return Err(Failure::misuse(message).about(&args.mesh));
    };
    let size = WantedSize { mean: size, at_points: field };
    let report = MeshReport::new(&mesh, &frame.grid(units), &samples, size, watch);
    let mut report = report.map_err(super::measure_failure).map_err(about(&args.mesh))?;
    if let (Some(image), Some(path)) = (&image, &args.image) {
        let found = fidelity(&loaded.mesh, image.frame(), image.samples(), watch);
        report.fidelity = Some(found.map_err(super::measure_failure).map_err(about(path))?);
    }
    if let (Some(labels), Some(path)) = (&labels, &args.labels) {
        let found = homogeneity(&loaded.mesh, labels, watch);
        report.homogeneity = Some(found.map_err(super::measure_failure).map_err(about(path))?);
    }
    if let Some(path) = &args.html {
        let shown = match image {
            Some(image) => image,
            None => Image::new(frame, Samples::F32(samples)).map_err(Failure::content)?,
        };
        write_html(args, path, (loaded, &shown, units), &report, dimension)?;
    }
    Ok(report)
}

/// The report as a page, the mesh drawn over an image.
fn write_html<const D: usize>(
    args: &ReportArgs,
    path: &Path,
    (loaded, image, units): (&LoadedMesh<D>, &Image<D>, Units),
    report: &MeshReport,
    dimension: &Dimension<D>,
) -> Result<(), Failure> {
    let mesh = lattice_mesh(&loaded.mesh, image.frame(), Units::Samples);
    let shown = args.image.as_ref().unwrap_or(&args.potential);
    // in these formats z grows upward
    let is_height = ImageFormat::of(shown).is_some_and(ImageFormat::z_is_height);
    let z_up = is_height && image.frame().direction()[D - 1][D - 1] > 0.0;
    let style = Style { units, z_up, ..Style::default() };
    let made = loaded.provenance.as_ref();
    let by = made.map_or(String::new(), |p| format!("; made by atomesh {}", p.version));
    let options = made.map(|p| option_rows(&p.options)).unwrap_or_default();
    let parts = PageParts {
        mesh: &args.mesh,
        subtitle: format!("{} measured against a potential{by}", dimension.cells),
        caption: caption::<D>(shown),
        tables: vec![("Options of the mesh".into(), options)],
        warnings: vec![],
    };
    let _guard = writing();
    write_page(path, parts, report, (image, &mesh, &style), dimension)
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
