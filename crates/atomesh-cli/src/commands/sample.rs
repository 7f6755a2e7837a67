//! `atomesh sample`: properties of cells from images.

use std::path::PathBuf;
use std::str::FromStr;

use atomesh::image::{Frame, Image};
use atomesh::sample::{SampleError, SampleOptions, Statistic, sample};
use atomesh_io::image::{AnyImage, ImageFormat};
use atomesh_io::mesh::{
    AnyMesh, LoadedMesh, MeshData, MeshFormat, MeshWriteError, Values, write_mesh,
};
use clap::builder::{PossibleValuesParser, TypedValueParser};

use crate::failure::Failure;
use crate::frame_options::{self, FrameOptions};
use crate::mesh_file;
use crate::outputs::check_writable;
use crate::progress::{Progress, writing};
use crate::values::number_in;

/// Give each cell of a mesh the mean, total or majority of an image inside it
///
/// Every sample stands for the box around it and counts by the exact volume (2-D: area) of that box that lies in
/// the cell. Boxes are cut at the rim of the image, where meshes end, so totals are conserved: over a mesh that
/// fills the image's box, the totals of cells sum to that of the image.
///
/// Points, fields, frame and metadata of the mesh are kept. With one statistic the field is called NAME, with
/// more NAME-mean, NAME-std and so on. Where cells have samples in a part of them only, the field NAME-coverage
/// says in which.
#[derive(Debug, clap::Args)]
#[command(
    mut_arg("fill", |arg| arg.help("Value that takes the place of NaN samples. Default: they are no samples")),
    after_help = "\
Examples:
  Mean porosity, harmonic mean and extremes of permeability:
    atomesh sample mesh.vtu --image porosity=phi.npy -o cells.vtu
    atomesh sample mesh.vtu --image k=perm.npy --statistic harmonic --statistic min --statistic max \\
      -o cells.vtu
  The tissue that fills the most of each cell, and how much of it:
    atomesh sample brain.vtu --image tissue=labels.nii.gz --statistic majority \\
      --statistic homogeneity -o tissues.vtu"
)]
pub struct SampleArgs {
    /// Mesh to sample in, in world coordinates: .vtu .vtk .msh .msh2 .npz
    #[arg(value_name = "MESH")]
    mesh: PathBuf,
    /// Image to sample, and what it is called. May be given many times. The frame is that of the options below,
    /// else of the file if its format has one, else of the mesh if the shapes agree
    #[arg(long, value_name = "NAME=FILE", required = true)]
    image: Vec<NamedImage>,
    /// What is computed: mean, harmonic, geometric, std, min, max, majority, homogeneity (the share of the majority),
    /// total (times volume). May be given many times. Default: mean
    #[arg(long, value_name = "STATISTIC", value_parser = statistic(), hide_possible_values = true)]
    statistic: Vec<Statistic>,
    /// Mesh to write: .vtu .vtk .msh (Gmsh 4.1) .msh2 (Gmsh 2.2) .npz
    #[arg(short, long, value_name = "MESH")]
    output: PathBuf,
    /// Value of cells without samples; totals are 0 there. Default: NaN
    #[arg(long, value_name = "VALUE", allow_hyphen_values = true,
        value_parser = number_in(f64::MIN, f64::MAX, "a finite number"))]
    outside: Option<f64>,
    #[command(flatten, next_help_heading = "Frame")]
    frame: FrameOptions,
}

fn statistic() -> impl TypedValueParser<Value = Statistic> {
    PossibleValuesParser::new(Statistic::NAMES).try_map(|name| name.parse())
}

/// An image and its name.
#[derive(Clone, Debug, PartialEq)]
struct NamedImage {
    name: String,
    path: PathBuf,
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

/// Runs the command; the text is for standard output.
///
/// # Errors
/// [`Failure`] if a file cannot be used, options make no sense, or the user ends the work.
pub fn run(args: &SampleArgs, watch: &mut Progress) -> Result<String, Failure> {
    if MeshFormat::of(&args.output).is_err() {
        let known = MeshFormat::endings();
        let message = format!("the ending says no format; expected one of {known}");
        return Err(Failure::misuse(message).about(&args.output));
    }
    let names = || args.image.iter().map(|image| &image.name);
    if let Some(twice) = names().find(|name| names().filter(|other| other == name).count() > 1) {
        return Err(Failure::misuse(format!("two images are called {twice}; expected one each")));
    }
    {
        let _guard = writing();
        check_writable(&args.output)?;
    }
    match mesh_file::read(&args.mesh)? {
        AnyMesh::Flat(mesh) => properties(args, mesh, flat, watch)?,
        AnyMesh::Volume(mesh) => properties(args, mesh, volume, watch)?,
    }
    Ok(String::new())
}

fn flat(any: AnyImage) -> Option<Image<2>> {
    match any {
        AnyImage::Flat(image) => Some(image),
        AnyImage::Volume(_) => None,
    }
}

fn volume(any: AnyImage) -> Option<Image<3>> {
    match any {
        AnyImage::Volume(image) => Some(image),
        AnyImage::Flat(_) => None,
    }
}

/// A field in the cells, in the precision in which it is written.
struct CellField {
    name: String,
    values: Numbers,
}

enum Numbers {
    Single(Vec<f32>),
    Double(Vec<f64>),
}

impl CellField {
    /// In single precision if nothing is lost.
    fn exact(name: String, values: Vec<f64>) -> Self {
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

    fn values(&self) -> Values<'_> {
        match &self.values {
            Numbers::Single(values) => values.into(),
            Numbers::Double(values) => values.into(),
        }
    }
}

/// Samples all images and writes the mesh.
fn properties<const D: usize>(
    args: &SampleArgs,
    mut loaded: LoadedMesh<D>,
    pick: fn(AnyImage) -> Option<Image<D>>,
    watch: &mut Progress,
) -> Result<(), Failure> {
    let mut fields = Vec::new();
    for named in &args.image {
        let image = read(args, named, &loaded, pick, watch)?;
        let found = sample_one(args, named, &loaded, &image, watch)?;
        fields.extend(found);
    }
    let old = std::mem::take(&mut loaded.cell_fields).into_iter();
    let old = old.filter(|field| fields.iter().all(|new| new.name != field.name));
    let mut all: Vec<CellField> = old.map(|f| CellField::exact(f.name, f.values)).collect();
    all.extend(fields);
    write(args, &loaded, &all, watch)
}

/// Reads one image and places it.
fn read<const D: usize>(
    args: &SampleArgs,
    NamedImage { path, .. }: &NamedImage,
    loaded: &LoadedMesh<D>,
    pick: fn(AnyImage) -> Option<Image<D>>,
    watch: &mut Progress,
) -> Result<Image<D>, Failure> {
    let any = frame_options::read(path, &args.frame.read_options()?, watch)?;
    let axes = any.dimension();
    let Some(image) = pick(any) else {
        let cells = if D == 2 { "triangles" } else { "tetrahedra" };
        let message = format!("has {axes} axes; the mesh is made of {cells}");
        return Err(Failure::content(message).about(path));
    };
    let has_frame = ImageFormat::of(path).is_some_and(ImageFormat::has_frame);
    let known: Option<Frame<D>> =
        loaded.frame.filter(|f| !has_frame && f.shape() == image.frame().shape());
    let frame = known.unwrap_or(*image.frame());
    let image = image.with_frame(frame).map_err(Failure::content)?;
    args.frame.place_as_is(image).map_err(|f| f.about(path))
}

/// The fields of one image.
fn sample_one<const D: usize>(
    args: &SampleArgs,
    NamedImage { name, path }: &NamedImage,
    loaded: &LoadedMesh<D>,
    image: &Image<D>,
    watch: &mut Progress,
) -> Result<Vec<CellField>, Failure> {
    let statistics = match &args.statistic[..] {
        [] => &[Statistic::Mean],
        some => some,
    };
    let options = SampleOptions { statistics, fill: args.outside.unwrap_or(f64::NAN) };
    let found = sample(&loaded.mesh, image, options, watch).map_err(|e| match e {
        SampleError::Cancelled(_) => Failure::cancelled(),
        _ => Failure::content(e).about(path),
    })?;
    let partial = found.partial_count();
    let mut fields = Vec::new();
    for (&statistic, values) in statistics.iter().zip(found.values) {
        let name = match statistics {
            [_] => name.clone(),
            _ => format!("{name}-{statistic}"),
        };
        fields.push(match statistic {
            Statistic::Total => CellField::double(name, values),
            Statistic::Majority => CellField::exact(name, values),
            _ => CellField::single(name, values),
        });
    }
    if partial > 0 {
        let cells = loaded.mesh.cell_count();
        watch.say(&format!(
            "warning: {}: {partial} of {cells} cells have samples in a part of them only, or none; \
             {name}-coverage says in which",
            path.display()
        ));
        fields.push(CellField::single(format!("{name}-coverage"), found.coverage));
    }
    Ok(fields)
}

/// Writes the mesh with its fields.
fn write<const D: usize>(
    args: &SampleArgs,
    loaded: &LoadedMesh<D>,
    fields: &[CellField],
    watch: &mut Progress,
) -> Result<(), Failure> {
    let mut data = MeshData::new(&loaded.mesh).with_tags(&loaded.tags);
    for field in &loaded.point_fields {
        data = data.with_point_field(&field.name, &field.values).map_err(Failure::content)?;
    }
    for field in fields {
        data = data.with_cell_field(&field.name, field.values()).map_err(Failure::content)?;
    }
    if let Some(frame) = &loaded.frame {
        data = data.with_frame(frame);
    }
    if let Some(provenance) = &loaded.provenance {
        data = data.with_provenance(provenance);
    }
    let _guard = writing();
    write_mesh(&args.output, &data, watch).map_err(|e| match e {
        MeshWriteError::Cancelled(_) => Failure::cancelled(),
        _ => Failure::content(e).about(&args.output),
    })?;
    let names: Vec<&str> = fields.iter().map(|field| field.name.as_str()).collect();
    let cells = loaded.mesh.cell_count();
    watch.say(&format!("{}: {cells} cells with {}", args.output.display(), names.join(", ")));
    Ok(())
}
