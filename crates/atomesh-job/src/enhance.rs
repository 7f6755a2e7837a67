//! From an image to the potential that attracts atoms.

use std::path::PathBuf;

use atomesh::enhance::{Enhanced, FeatureOptions, Mixture};
use atomesh::image::{Image, Samples, Units};
use atomesh::mesh::Mesh;
use atomesh::run::potential_bytes;
use atomesh::watch::{Phase, check};
use atomesh_draw::{Picture, Style};
use atomesh_io::image::{AnyImage, Meaning};

use crate::dimension::Dimension;
use crate::error::JobError;
use crate::files::{self, PictureFile};
use crate::images;
use crate::memory;
use crate::options::{FrameOptions, PotentialOptions};
use crate::session::Session;
#[cfg(feature = "clap")]
use crate::values::named;

/// An image to enhance, and where the potential goes.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "clap", derive(clap::Args))]
pub struct EnhanceRequest {
    /// Image to enhance: every format that `mesh` reads
    #[cfg_attr(feature = "clap", arg(value_name = "IMAGE"))]
    pub image: PathBuf,
    /// Potential to write, float32: .nii, .nii.gz, .nrrd and .vti with the image's frame; .npy, .tif and
    /// .raw without
    #[cfg_attr(feature = "clap", arg(short, long, value_name = "FILE"))]
    pub output: PathBuf,
    /// Picture of the potential, features dark, .png or .svg; in 3-D, the three slices through the middle
    #[cfg_attr(feature = "clap", arg(long, value_name = "PICTURE"))]
    pub picture: Option<PathBuf>,
    /// Features.
    #[cfg_attr(feature = "clap", command(flatten, next_help_heading = "Features"))]
    pub features: PotentialOptions,
    /// Units of lengths: the frame's own (millimetres, metres ...), or samples. Default: physical
    #[cfg_attr(feature = "clap", arg(long, value_name = "UNITS", help_heading = "Features",
        value_parser = named::<Units>(&["physical", "samples"])))]
    pub units: Option<Units>,
    /// Frame.
    #[cfg_attr(feature = "clap", command(flatten, next_help_heading = "Frame"))]
    pub frame: FrameOptions,
}

/// A potential, and what it shows.
#[derive(Clone, Debug)]
pub struct Potential<const D: usize> {
    /// b(x), float32.
    pub image: Image<D>,
    /// The kinds of features, with their weights.
    pub mixture: Mixture,
    /// Whether there are no such features, so that b is 0.
    pub is_constant: bool,
}

/// What became of [`enhance_file`].
#[derive(Clone, Debug)]
pub struct EnhanceSummary {
    /// The kinds of features, with their weights.
    pub mixture: Mixture,
    /// The potential's shape, x first.
    pub shape: Vec<usize>,
}

/// Enhances an image in place, that is placed, cropped and without NaN.
///
/// # Errors
/// [`JobError`] if an option is out of range, or the watch ends the work.
pub fn enhance<const D: usize>(
    image: &Image<D>,
    features: &PotentialOptions,
    units: Units,
    dimension: &Dimension<D>,
    session: &mut Session<'_>,
) -> Result<Potential<D>, JobError> {
    let (mixture, options) = wanted(features, units);
    let made = (dimension.tools.enhance_mixture)(&mixture, &options, image, session)?;
    let Enhanced { values, constant, .. } = made;
    let image =
        Image::new(*image.frame(), Samples::F32(values.into())).map_err(JobError::content)?;
    Ok(Potential { image, mixture, is_constant: constant })
}

/// The kinds of features that options ask for, and how they are looked for.
fn wanted(features: &PotentialOptions, units: Units) -> (Mixture, FeatureOptions) {
    let options = features.feature_options(FeatureOptions { units, ..Default::default() });
    let mixture = match &features.features {
        Some(mixture) => mixture.0.clone(),
        None => Mixture::from(options.features),
    };
    (mixture, options)
}

/// Enhances a file and writes the potential.
///
/// # Errors
/// As [`enhance`], and if a file cannot be read or written.
pub fn enhance_file(
    request: &EnhanceRequest,
    session: &mut Session<'_>,
) -> Result<EnhanceSummary, JobError> {
    files::check_potential(&request.output)?;
    let picture = PictureFile::of(request.picture.as_ref())?;
    let outputs = [Some(request.output.as_path()), request.picture.as_deref()];
    files::check_apart([request.image.as_path()], outputs.into_iter().flatten(), session)?;
    let meaning = if request.features.are_labels() { Meaning::Labels } else { Meaning::Brightness };
    let options = request.frame.read_options_for(meaning)?;
    match images::read(&request.image, &options, session)?.image {
        AnyImage::Flat(image) => {
            run(request, image, picture.as_ref(), &Dimension::plane(), session)
        }
        AnyImage::Volume(image) => {
            run(request, image, picture.as_ref(), &Dimension::space(), session)
        }
    }
}

fn run<const D: usize>(
    request: &EnhanceRequest,
    image: Image<D>,
    picture: Option<&PictureFile>,
    dimension: &Dimension<D>,
    session: &mut Session<'_>,
) -> Result<EnhanceSummary, JobError> {
    let image = images::place(image, &request.frame, Some(&request.image), session)?;
    let units = request.units.unwrap_or_default();
    let (mixture, options) = wanted(&request.features, units);
    memory::check_potential(image.samples().len(), potential_bytes(&mixture, &options), "enhance")
        .map_err(|e| e.about(&request.image))?;
    let potential = enhance(&image, &request.features, units, dimension, session)
        .map_err(|e| e.about_content(&request.image))?;
    if potential.is_constant {
        let text = "no features of this kind; the potential is 0";
        session.warn(Some(&request.image), text);
    }
    let Potential { image: potential, mixture, .. } = potential;
    let drawn = match picture {
        Some(_) => Some(draw(&potential, units, dimension, session)?),
        None => None,
    };
    check(session, Phase::Write, 0.0, None).map_err(|_| JobError::cancelled())?;
    session.write_together(|group, session| {
        if let (Some(file), Some(drawn)) = (picture, &drawn) {
            file.staged(group)?.write(drawn)?;
        }
        let path = files::stage(&request.output, group)?;
        Ok((dimension.files.image)(&path, &potential, session)?)
    })?;
    Ok(EnhanceSummary { mixture, shape: potential.frame().shape().to_vec() })
}

/// The potential as a picture.
fn draw<const D: usize>(
    potential: &Image<D>,
    units: Units,
    dimension: &Dimension<D>,
    session: &mut Session<'_>,
) -> Result<Picture, JobError> {
    session.begin(Phase::Draw);
    let nothing = Mesh::new(Vec::new(), Vec::new()).map_err(JobError::content)?;
    let style = Style { units, brightness: 1.0, edge_pixels: 4.0, ..Style::default() };
    (dimension.drawing.mesh)(potential, &nothing, &style).map_err(JobError::content)
}
