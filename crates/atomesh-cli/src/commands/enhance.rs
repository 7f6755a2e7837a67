//! `atomesh enhance`: from an image to the potential that attracts atoms.

use std::path::{Path, PathBuf};

use atomesh::enhance::{EnhanceError, Enhanced, FeatureOptions, Mixture, enhance_mixture};
use atomesh::image::{Image, Samples, Units};
use atomesh::mesh::Mesh;
use atomesh::watch::{Phase, Watch};
use atomesh_draw::{PictureFormat, Style};
use atomesh_io::image::{AnyImage, WriteReason, write_image};

use super::is_option;
use crate::dimension::Dimension;
use crate::failure::Failure;
use crate::frame_options::{self, FrameOptions};
use crate::memory;
use crate::outputs::{Places, check_potential, check_writable, unknown_ending, write_bytes};
use crate::progress::{Progress, writing};
use crate::run_config::PotentialOptions;
use crate::values::named;

/// Turn an image into the potential that attracts atoms
///
/// The potential is -1 in features and 0 elsewhere. `mesh` makes the same by --features before it fills the
/// image with atoms; this command writes it, to look at, to change, and to mesh many times by
/// `mesh --potential`.
#[derive(Debug, clap::Args)]
#[command(allow_negative_numbers = true, after_help = EXAMPLES)]
pub struct EnhanceArgs {
    /// Image to enhance: every format that `mesh` reads
    #[arg(value_name = "IMAGE")]
    image: PathBuf,
    /// Potential to write, float32: .nii, .nii.gz, .nrrd and .vti with the image's frame; .npy, .tif and
    /// .raw without
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Picture of the potential, features dark, .png or .svg; in 3-D the three slices through the middle
    #[arg(long, value_name = "PICTURE")]
    picture: Option<PathBuf>,
    #[command(flatten, next_help_heading = "Features")]
    features: PotentialOptions,
    /// Units of lengths: the frame's own (millimetres, metres ...), or samples. Default: physical
    #[arg(long, value_name = "UNITS", help_heading = "Features",
        value_parser = named::<Units>(&["physical", "samples"]))]
    units: Option<Units>,
    #[command(flatten, next_help_heading = "Frame")]
    frame: FrameOptions,
}

const EXAMPLES: &str = "\
Examples:
  Faults in a seismic section, and half as strong its reflections:
    atomesh enhance section.sgy -o faults.npy --as faults,horizons:0.5 --picture faults.png
  Thin dark lines of a micrograph, as valleys of one depth and width:
    atomesh enhance micrograph.tif -o lines.npy --as ridges --polarity dark
  The outlines in a brain scan:
    atomesh enhance t1.nii.gz -o outlines.nii.gz --as edges --picture outlines.png";

/// Runs the command; the text is for standard output.
///
/// # Errors
/// [`Failure`] if a file cannot be used, options make no sense, or the user ends the work.
pub fn run(args: &EnhanceArgs, watch: &mut Progress) -> Result<String, Failure> {
    check_potential(&args.output)?;
    let picture = match &args.picture {
        Some(path) => {
            let format = PictureFormat::of(path);
            Some((path.as_path(), format.map_err(|_| unknown_ending(path, ".png, .svg"))?))
        }
        None => None,
    };
    {
        let _guard = writing();
        let mut places = Places::taken([args.image.as_path()]);
        for path in
            [Some(args.output.as_path()), picture.map(|(path, _)| path)].into_iter().flatten()
        {
            check_writable(path)?;
            places.take(path)?;
        }
    }
    match frame_options::read(&args.image, &args.frame.read_options()?, watch)? {
        AnyImage::Flat(image) => enhance(args, image, picture, &Dimension::flat(), watch),
        AnyImage::Volume(image) => enhance(args, image, picture, &Dimension::volume(), watch),
    }
}

fn enhance<const D: usize>(
    args: &EnhanceArgs,
    image: Image<D>,
    picture: Option<(&Path, PictureFormat)>,
    dimension: &Dimension<D>,
    watch: &mut Progress,
) -> Result<String, Failure> {
    let image = args.frame.place(image).map_err(|f| f.about(&args.image))?;
    memory::check_potential(image.samples().len(), &args.image, "enhance")?;
    let units = args.units.unwrap_or_default();
    let basis = FeatureOptions { units, ..Default::default() };
    let options = args.features.feature_options(basis);
    let mixture = match &args.features.features {
        Some(mixture) => mixture.0.clone(),
        None => Mixture::from(options.features),
    };
    let Enhanced { values, constant } = enhance_mixture(&mixture, &options, |_| &image, watch)
        .map_err(|e| match e {
            EnhanceError::Cancelled(_) => Failure::cancelled(),
            _ if is_option(&e) => Failure::misuse(e),
            _ => Failure::content(e).about(&args.image),
        })?;
    if constant {
        let path = args.image.display();
        watch.say(&format!("warning: {path}: no features of this kind; the potential is 0"));
    }
    let potential = Image::new(*image.frame(), Samples::F32(values)).map_err(Failure::content)?;
    if let Some((path, format)) = picture {
        watch.begin(Phase::Draw);
        let nothing = Mesh::new(Vec::new(), Vec::new()).map_err(Failure::content)?;
        let style = Style { units, brightness: 1.0, edge_pixels: 4.0, ..Style::default() };
        let drawn = (dimension.draw)(&potential, &nothing, &style);
        let bytes = drawn.and_then(|p| p.encode(format)).map_err(Failure::content)?;
        let _guard = writing();
        write_bytes(path, &bytes)?;
    }
    if watch.step(Phase::Write, 0.0, None).is_break() {
        return Err(Failure::cancelled());
    }
    let _guard = writing();
    write_image(&args.output, &potential, watch).map_err(|e| match e.reason {
        WriteReason::Cancelled(_) => Failure::cancelled(),
        _ => Failure::content(e),
    })?;
    let shape = potential.frame().shape();
    watch.say(&format!("{}: {mixture} in {shape:?} samples", args.output.display()));
    Ok(String::new())
}
