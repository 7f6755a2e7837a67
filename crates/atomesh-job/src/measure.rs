//! How good any mesh is, for an image potential.

use std::path::{Path, PathBuf};

use atomesh::enhance::given_potential;
use atomesh::image::{Frame, Image, Samples, Units};
use atomesh::measure::WantedSize;
use atomesh::mesh::{Mesh, PolyMesh};
use atomesh::run::{MeshReport, VoronoiReport};
use atomesh_draw::Style;
use atomesh_io::image::Meaning;
use atomesh_io::mesh::cells::LoadedCells;
use atomesh_io::mesh::{LoadedMesh, Provenance};
use serde::Serialize;
use serde_json::Value;

use crate::dimension::Dimension;
use crate::error::JobError;
use crate::files::{self, write_bytes};
use crate::images::{Beside, ImageRole, is_z_up};
use crate::mesh_file::{self, MeshFile};
use crate::options::FrameOptions;
use crate::page::{PageParts, Shown, caption, option_rows, write_page};
use crate::session::{Note, NoteKind, Session};
#[cfg(feature = "clap")]
use crate::values::{named, number_in};

/// A mesh, what it is measured against, and where the report goes.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "clap", derive(clap::Args))]
pub struct MeasureRequest {
    /// Mesh to measure, in world coordinates: .vtu .vtk .msh .msh2 .npz .inp; or Voronoi cells that atomesh wrote: .vtu,
    /// or .json (a list of connections)
    #[cfg_attr(feature = "clap", arg(value_name = "MESH"))]
    pub mesh: PathBuf,
    /// Potential b(x), an image with values from -1 (features) to 1. Its frame is that of the options
    /// below, else of the mesh if atomesh wrote it, else of this file
    #[cfg_attr(feature = "clap", arg(long, value_name = "FILE"))]
    pub potential: PathBuf,
    /// Edge length d of the mesh in lattice units, above 0. Default: the mean of the field `distance` of the
    /// mesh; of Voronoi cells, the size that they were made with, or the mean distance of their sites
    #[cfg_attr(feature = "clap", arg(long, value_name = "D", allow_hyphen_values = true,
        value_parser = number_in(f64::MIN_POSITIVE, f64::MAX, "a length above 0")))]
    pub size: Option<f64>,
    /// Lattice units in which shape is measured. Default: those in which the mesh was made, else
    /// physical
    #[cfg_attr(feature = "clap", arg(long, value_name = "UNITS",
        value_parser = named::<Units>(&["physical", "samples"])))]
    pub units: Option<Units>,
    /// Image to rebuild from the mesh: fidelity is the error that is left, with a constant in each cell and
    /// with the best continuous linear fit. Not for Voronoi cells
    #[cfg_attr(feature = "clap", arg(long, value_name = "FILE"))]
    pub image: Option<PathBuf>,
    /// Image of labels, whole numbers: homogeneity is the share of a cell that its dominant label fills
    #[cfg_attr(feature = "clap", arg(long, value_name = "FILE"))]
    pub labels: Option<PathBuf>,
    /// File for the report as JSON. Default: standard output, unless --html is given
    #[cfg_attr(feature = "clap", arg(long, value_name = "JSON"))]
    pub json: Option<PathBuf>,
    /// File for the report as one self-contained HTML page with a picture and histograms
    #[cfg_attr(feature = "clap", arg(long, value_name = "HTML"))]
    pub html: Option<PathBuf>,
    /// Frame.
    #[cfg_attr(feature = "clap", command(flatten, next_help_heading = "Frame"))]
    pub frame: FrameOptions,
}

impl MeasureRequest {
    /// The files that are read.
    fn inputs(&self) -> impl Iterator<Item = &Path> {
        let always = [&self.mesh, &self.potential].into_iter();
        always.chain(&self.image).chain(&self.labels).map(PathBuf::as_path)
    }
}

/// What was measured of a mesh.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Measured {
    /// Of triangles or tetrahedra.
    Simplices(Box<MeshReport>),
    /// Of Voronoi cells.
    Cells(Box<VoronoiReport>),
}

/// The report as JSON, with the notes of the session.
fn report_text(report: &impl Serialize, session: &Session<'_>) -> Result<String, JobError> {
    #[derive(Serialize)]
    struct Noted<'a, T> {
        #[serde(flatten)]
        report: &'a T,
        notes: Value,
    }
    let noted = Noted { report, notes: session.notes_json() };
    Ok(serde_json::to_string_pretty(&noted).map_err(JobError::content)? + "\n")
}

/// What a mesh is measured against: images in place.
#[derive(Clone, Debug)]
pub struct Against<const D: usize> {
    frame: Frame<D>,
    /// b(x), values −1…1.
    potential: Vec<f32>,
    /// What is rebuilt from the mesh.
    pub image: Option<Image<D>>,
    /// Labels.
    pub labels: Option<Image<D>>,
}

impl<const D: usize> Against<D> {
    /// A potential alone.
    ///
    /// # Errors
    /// [`JobError`] if a sample is outside −1…1.
    pub fn potential(potential: Image<D>) -> Result<Self, JobError> {
        let (frame, samples) = potential.into_parts();
        let potential = given_potential(samples).map_err(JobError::content)?;
        Ok(Self { frame, potential, image: None, labels: None })
    }
}

/// Measures a mesh against images.
///
/// # Errors
/// [`JobError`] if labels are no whole numbers, no size is known, or the watch ends the work.
pub fn measure<const D: usize>(
    request: &MeasureRequest,
    loaded: &LoadedMesh<D>,
    against: &Against<D>,
    dimension: &Dimension<D>,
    session: &mut Session<'_>,
) -> Result<MeshReport, JobError> {
    let units = lattice_units(request, loaded.provenance.as_ref());
    let mesh = (dimension.tools.lattice_mesh)(&loaded.mesh, &against.frame, units);
    let field = loaded.point_field("distance").filter(|_| request.size.is_none());
    let Some(size) = request.size.or_else(|| mean(&mesh, field?)) else {
        let message = "the mesh has no field `distance`; expected --size D";
        return Err(JobError::misuse(message).about(&request.mesh));
    };
    let size = WantedSize { mean: size, at_points: field };
    let grid = against.frame.grid(units);
    let report = (dimension.tools.measure)(&mesh, &grid, &against.potential, size, session);
    let mut report = report.map_err(|e| JobError::from(e).about(&request.mesh))?;
    if let Some(image) = &against.image {
        let fidelity = dimension.tools.fidelity;
        let found = fidelity(&loaded.mesh, image.frame(), image.samples(), session);
        let found = found.map_err(|e| JobError::from(e).about_any(request.image.as_deref()))?;
        report.fidelity = Some(found);
    }
    if let Some(labels) = &against.labels {
        let found = (dimension.tools.homogeneity)(&loaded.mesh, labels, session);
        let found = found.map_err(|e| JobError::from(e).about_any(request.labels.as_deref()))?;
        report.homogeneity = Some(found);
    }
    Ok(report)
}

/// Measures Voronoi cells against images: fidelity, which is defined for triangles and tetrahedra alone, is left out.
///
/// # Errors
/// [`JobError`] if labels are no whole numbers, or the watch ends the work.
pub fn measure_cells<const D: usize>(
    request: &MeasureRequest,
    loaded: &LoadedCells<D>,
    against: &Against<D>,
    dimension: &Dimension<D>,
    session: &mut Session<'_>,
) -> Result<VoronoiReport, JobError> {
    let (units, tools) = (lattice_units(request, Some(&loaded.provenance)), dimension.tools);
    let grid = against.frame.grid(units);
    let cells = (tools.lattice_cells)(&loaded.mesh, &against.frame, units);
    let size = request.size.or_else(|| mesh_file::size(&loaded.provenance));
    let size = size.unwrap_or_else(|| mean_distance(&cells));
    let report = (tools.measure_cells)(&cells, &grid, &against.potential, size, session);
    let mut report = report.map_err(|e| JobError::from(e).about(&request.mesh))?;
    if let Some(labels) = &against.labels {
        let found = (tools.homogeneity_of_cells)(&loaded.mesh, labels, session);
        let found = found.map_err(|e| JobError::from(e).about_any(request.labels.as_deref()))?;
        report.homogeneity = Some(found);
    }
    Ok(report)
}

/// The distance of sites of as many cells of equal measure, of a hexagonal lattice or, in space, a body-centred cubic one.
fn mean_distance<const D: usize>(cells: &PolyMesh<D>) -> f64 {
    // the measure of a cell whose nearest sites are 1 away
    let unit = if D == 2 { 3f64.sqrt() / 2.0 } else { 4.0 / 27f64.sqrt() };
    (cells.measure() / cells.cell_count() as f64 / unit).powf(1.0 / D as f64)
}

fn lattice_units(request: &MeasureRequest, made_by: Option<&Provenance>) -> Units {
    request.units.or(mesh_file::units(made_by)).unwrap_or_default()
}

/// Measures the files of a request, and writes those that it names.
///
/// # Errors
/// As [`measure`] and [`measure_cells`], and if a file cannot be read or written.
pub fn measure_file(
    request: &MeasureRequest,
    session: &mut Session<'_>,
) -> Result<Measured, JobError> {
    let outputs = request.json.iter().chain(&request.html);
    files::check_apart(request.inputs(), outputs.map(PathBuf::as_path), session)?;
    match mesh_file::read(&request.mesh, session)? {
        MeshFile::Flat(mesh) => run(request, &mesh, &Dimension::plane(), session),
        MeshFile::Volume(mesh) => run(request, &mesh, &Dimension::space(), session),
        MeshFile::Polygons(cells) => run_cells(request, &cells, &Dimension::plane(), session),
        MeshFile::Polyhedra(cells) => run_cells(request, &cells, &Dimension::space(), session),
    }
}

/// Reads what a mesh is measured against.
fn read_against<const D: usize>(
    request: &MeasureRequest,
    (frame, provenance): (Option<&Frame<D>>, Option<&Provenance>),
    dimension: &Dimension<D>,
    session: &mut Session<'_>,
) -> Result<Against<D>, JobError> {
    let beside = Beside { frame, provenance, options: &request.frame, role: ImageRole::Followed };
    let mut read = |path: &Path, meaning| beside.read_as(meaning, path, dimension, session);
    let potential = read(&request.potential, Meaning::Brightness)?;
    let image = request.image.as_deref().map(|path| read(path, Meaning::Brightness)).transpose()?;
    let labels = request.labels.as_deref().map(|path| read(path, Meaning::Labels)).transpose()?;
    let against = Against::potential(potential).map_err(|e| e.about(&request.potential))?;
    Ok(Against { image, labels, ..against })
}

fn run<const D: usize>(
    request: &MeasureRequest,
    loaded: &LoadedMesh<D>,
    dimension: &Dimension<D>,
    session: &mut Session<'_>,
) -> Result<Measured, JobError> {
    let known = (loaded.frame.as_ref(), loaded.provenance.as_ref());
    let against = read_against(request, known, dimension, session)?;
    let report = measure(request, loaded, &against, dimension, session)?;
    session.write_together(|group, session| {
        if let Some(path) = files::stage_any(&request.json, group)? {
            write_bytes(&path, report_text(&report, session)?.as_bytes())?;
        }
        if let Some(path) = files::stage_any(&request.html, group)? {
            let page = Page { request, loaded, against: &against, notes: session.notes_in_words() };
            page.write(&path, &report, dimension)?;
        }
        Ok(())
    })?;
    Ok(Measured::Simplices(Box::new(report)))
}

/// [`run`] for Voronoi cells: fidelity is left out with a note.
fn run_cells<const D: usize>(
    request: &MeasureRequest,
    loaded: &LoadedCells<D>,
    dimension: &Dimension<D>,
    session: &mut Session<'_>,
) -> Result<Measured, JobError> {
    if let Some(page) = &request.html {
        let message = "a page shows triangles or tetrahedra, not Voronoi cells";
        return Err(JobError::misuse(message).about(page).advise("--json takes their figures"));
    }
    let known = (Some(&loaded.frame), Some(&loaded.provenance));
    let against = read_against(request, known, dimension, session)?;
    if let Some(image) = &request.image {
        let text =
            "fidelity is of triangles and tetrahedra; the report of Voronoi cells leaves it out";
        session.note(Note { kind: NoteKind::Change, file: Some(image.clone()), text: text.into() });
    }
    let report = measure_cells(request, loaded, &against, dimension, session)?;
    session.write_together(|group, session| match files::stage_any(&request.json, group)? {
        Some(path) => write_bytes(&path, report_text(&report, session)?.as_bytes()),
        None => Ok(()),
    })?;
    Ok(Measured::Cells(Box::new(report)))
}

/// A measured mesh as a page.
struct Page<'a, const D: usize> {
    request: &'a MeasureRequest,
    loaded: &'a LoadedMesh<D>,
    against: &'a Against<D>,
    notes: Vec<String>,
}

impl<const D: usize> Page<'_, D> {
    /// Writes the page, the mesh drawn over the image, or else over the potential.
    fn write(
        &self,
        path: &Path,
        report: &MeshReport,
        dimension: &Dimension<D>,
    ) -> Result<(), JobError> {
        let (request, loaded) = (self.request, self.loaded);
        let potential;
        let image = match &self.against.image {
            Some(image) => image,
            None => {
                let samples = Samples::F32(self.against.potential.clone().into());
                potential = Image::new(self.against.frame, samples).map_err(JobError::content)?;
                &potential
            }
        };
        let mesh = (dimension.tools.lattice_mesh)(&loaded.mesh, image.frame(), Units::Samples);
        let file = request.image.as_ref().unwrap_or(&request.potential);
        let z_up = is_z_up(Some(file), image.frame());
        let made = loaded.provenance.as_ref();
        let style = Style { units: lattice_units(request, made), z_up, ..Style::default() };
        let by = made.map_or(String::new(), |p| format!("; made by atomesh {}", p.version));
        let parts = PageParts {
            mesh: &request.mesh,
            subtitle: format!("{} measured against a potential{by}", dimension.cells),
            caption: caption::<D>(file),
            tables: vec![(
                "Options of the mesh".into(),
                made.map(|p| option_rows(&p.options)).unwrap_or_default(),
            )],
            notes: self.notes.clone(),
        };
        write_page(path, parts, report, &Shown { image, mesh: &mesh, style: &style }, dimension)
    }
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
