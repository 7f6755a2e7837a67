//! Properties of cells from images.

mod sampled;

pub use sampled::SampledMesh;
pub(crate) use sampled::cell_fields;

use std::path::PathBuf;
use std::str::FromStr;

use atomesh::image::Image;
use atomesh::sample::{SampleOptions, Statistic};
use atomesh_io::image::Meaning;
use atomesh_io::mesh::Values;

use crate::dimension::Dimension;
use crate::error::JobError;
use crate::files;
use crate::images::{Beside, ImageRole};
use crate::mesh_file::{self, MeshFile};
use crate::options::FrameOptions;
use crate::session::Session;
#[cfg(feature = "clap")]
use crate::values::number_in;

/// A mesh, the images that its cells get properties from, and where it goes.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "clap", derive(clap::Args))]
pub struct SampleRequest {
    /// Mesh to sample in, in world coordinates: .vtu .vtk .msh .msh2 .npz .inp; or Voronoi cells that atomesh wrote: .vtu,
    /// or .json (a list of connections)
    #[cfg_attr(feature = "clap", arg(value_name = "MESH"))]
    pub mesh: PathBuf,
    /// Image to sample, and what it is called. May be given many times. Its frame is that of the options below,
    /// else of the file if its format has one, else of the mesh if the shapes agree
    #[cfg_attr(feature = "clap", arg(long, value_name = "NAME=FILE", required = true))]
    pub image: Vec<NamedImage>,
    /// What is computed: mean, harmonic, geometric, std, min, max, majority, homogeneity (the share of the majority),
    /// total (times volume). May be given many times. Default: mean
    #[cfg_attr(feature = "clap", arg(long, value_name = "STATISTIC", value_parser = statistic(),
        hide_possible_values = true))]
    pub statistic: Vec<Statistic>,
    /// Mesh to write: .vtu .vtk .msh (Gmsh 4.1) .msh2 (Gmsh 2.2) .npz; Voronoi cells: .vtu
    #[cfg_attr(feature = "clap", arg(short, long, value_name = "MESH"))]
    pub output: PathBuf,
    /// Value of cells without samples, where totals are 0. Default: NaN
    #[cfg_attr(feature = "clap", arg(long, value_name = "VALUE", allow_hyphen_values = true,
        value_parser = number_in(f64::MIN, f64::MAX, "a finite number")))]
    pub outside: Option<f64>,
    /// Frame.
    #[cfg_attr(feature = "clap", command(flatten, next_help_heading = "Frame"))]
    pub frame: FrameOptions,
}

#[cfg(feature = "clap")]
fn statistic() -> impl clap::builder::TypedValueParser<Value = Statistic> {
    use clap::builder::{PossibleValuesParser, TypedValueParser};
    PossibleValuesParser::new(Statistic::NAMES).try_map(|name| name.parse())
}

impl SampleRequest {
    /// What samples mean: labels, where all that is computed are shares of them.
    fn meaning(&self) -> Meaning {
        let of_labels = |s: &Statistic| matches!(s, Statistic::Majority | Statistic::Homogeneity);
        match self.statistics().iter().all(of_labels) {
            true => Meaning::Labels,
            false => Meaning::Brightness,
        }
    }

    fn statistics(&self) -> &[Statistic] {
        if self.statistic.is_empty() { &[Statistic::Mean] } else { &self.statistic }
    }
}

/// An image and its name, `NAME=FILE`.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedImage {
    /// What the field is called.
    pub name: String,
    /// The image's file.
    pub path: PathBuf,
}

impl FromStr for NamedImage {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let plain = |c: char| c.is_ascii_alphanumeric() || "_-".contains(c);
        match text.split_once('=') {
            Some((name, path))
                if (1..=48).contains(&name.len())
                    && name.chars().all(plain)
                    && !path.is_empty() =>
            {
                Ok(Self { name: name.into(), path: path.into() })
            }
            _ => Err("expected NAME=FILE, NAME of 1 to 48 letters, digits, '_' or '-'".into()),
        }
    }
}

/// A field in the cells, in the precision in which it is written.
#[derive(Clone, Debug, PartialEq)]
pub struct Property {
    /// The field's name.
    pub name: String,
    values: Numbers,
}

#[derive(Clone, Debug, PartialEq)]
enum Numbers {
    Single(Vec<f32>),
    Double(Vec<f64>),
}

impl Property {
    /// A value for each cell, kept in single precision if nothing is lost.
    pub fn new(name: String, values: Vec<f64>) -> Self {
        let kept = |v: &f64| v.is_nan() || f64::from(*v as f32) == *v;
        if values.iter().all(kept) {
            Self::single(name, values)
        } else {
            Self::double(name, values)
        }
    }

    fn single(name: String, values: Vec<f64>) -> Self {
        Self { name, values: Numbers::Single(values.into_iter().map(|v| v as f32).collect()) }
    }

    fn double(name: String, values: Vec<f64>) -> Self {
        Self { name, values: Numbers::Double(values) }
    }

    /// The values in double precision.
    pub fn into_values(self) -> Vec<f64> {
        match self.values {
            Numbers::Single(values) => values.into_iter().map(f64::from).collect(),
            Numbers::Double(values) => values,
        }
    }

    /// The values, one for each cell.
    pub fn values(&self) -> Values<'_> {
        match &self.values {
            Numbers::Single(values) => values.into(),
            Numbers::Double(values) => values.into(),
        }
    }
}

/// What became of [`sample_file`].
#[derive(Clone, Debug)]
pub struct SampleSummary {
    /// How many cells.
    pub cell_count: usize,
    /// The names of their fields.
    pub fields: Vec<String>,
}

/// The properties that one image gives to the cells of a mesh; the request says which.
///
/// # Errors
/// [`JobError`] if a sample is of no use for a statistic, or the watch ends the work.
pub fn sample<const D: usize>(
    request: &SampleRequest,
    NamedImage { name, path }: &NamedImage,
    loaded: &impl SampledMesh<D>,
    image: &Image<D>,
    dimension: &Dimension<D>,
    session: &mut Session<'_>,
) -> Result<Vec<Property>, JobError> {
    let statistics = request.statistics();
    let options = SampleOptions { statistics, fill: request.outside.unwrap_or(f64::NAN) };
    let found = loaded
        .sample(image, options, dimension.tools, session)
        .map_err(|e| JobError::from(e).about(path))?;
    let partial = found.partial_count();
    let mut properties = Vec::new();
    for (&statistic, values) in statistics.iter().zip(found.values) {
        let name = match statistics {
            [_] => name.clone(),
            _ => format!("{name}-{statistic}"),
        };
        properties.push(match statistic {
            Statistic::Total => Property::double(name, values),
            Statistic::Majority => Property::new(name, values),
            _ => Property::single(name, values),
        });
    }
    if partial > 0 {
        let cells = loaded.cell_count();
        let text = format!(
            "{partial} of {cells} cells have samples in a part of them only, or none; {name}-coverage says in which"
        );
        session.warn(Some(path), text);
        properties.push(Property::single(format!("{name}-coverage"), found.coverage));
    }
    Ok(properties)
}

/// Samples all images of a request and writes the mesh with what was found.
///
/// # Errors
/// As [`sample`], and if a file cannot be read or written.
pub fn sample_file(
    request: &SampleRequest,
    session: &mut Session<'_>,
) -> Result<SampleSummary, JobError> {
    files::check_holds_values(&request.output)?;
    let names = || request.image.iter().map(|image| &image.name);
    if let Some(twice) = names().find(|name| names().filter(|other| other == name).count() > 1) {
        return Err(JobError::misuse(format!("two images are called {twice}; expected one each")));
    }
    let inputs = request.image.iter().map(|image| image.path.as_path());
    let inputs = inputs.chain([request.mesh.as_path()]);
    files::check_apart(inputs, [request.output.as_path()], session)?;
    let file = mesh_file::read(&request.mesh, session)?;
    file.note_skipped(&request.mesh, session);
    match file {
        MeshFile::Flat(mesh) => run(request, mesh, &Dimension::plane(), session),
        MeshFile::Volume(mesh) => run(request, mesh, &Dimension::space(), session),
        MeshFile::Polygons(cells) => run(request, cells, &Dimension::plane(), session),
        MeshFile::Polyhedra(cells) => run(request, cells, &Dimension::space(), session),
    }
}

fn run<const D: usize>(
    request: &SampleRequest,
    mut loaded: impl SampledMesh<D>,
    dimension: &Dimension<D>,
    session: &mut Session<'_>,
) -> Result<SampleSummary, JobError> {
    loaded.check_output(&request.output)?;
    let mut found = Vec::new();
    for named in &request.image {
        let (frame, options) = (loaded.frame(), &request.frame);
        let provenance = loaded.provenance();
        let beside = Beside { frame, provenance, options, role: ImageRole::Property };
        let image = beside.read_as(request.meaning(), &named.path, dimension, session)?;
        found.extend(sample(request, named, &loaded, &image, dimension, session)?);
    }
    let old = loaded.take_fields().into_iter();
    let old = old.filter(|field| found.iter().all(|new| new.name != field.name));
    let mut all: Vec<Property> = old.map(|f| Property::new(f.name, f.values)).collect();
    all.extend(found);
    session.write_together(|group, session| {
        let path = files::stage(&request.output, group)?;
        loaded.write(&path, &all, dimension, session)
    })?;
    let fields = all.into_iter().map(|property| property.name).collect();
    Ok(SampleSummary { cell_count: loaded.cell_count(), fields })
}
