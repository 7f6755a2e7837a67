//! `atomesh synth`: test images whose features are known.

use std::path::{Path, PathBuf};

use atomesh::synth::{Scene, SynthError, SynthOptions, synthesize};
use atomesh::watch::{Phase, Watch};
use atomesh_io::image::{ImageFormat, WriteReason, write_image};
use clap::builder::{PossibleValuesParser, TypedValueParser};

use crate::failure::Failure;
use crate::frame_options::axes;
use crate::memory;
use crate::outputs::{check_writable, write_bytes};
use crate::progress::{Progress, writing};
use crate::values::{Counts, Numbers};

/// Make a test image whose features are known
///
/// The true features are written beside the image, in world coordinates, as NAME.truth.json. The same
/// options give the same bytes.
#[derive(Debug, clap::Args)]
#[command(
    allow_negative_numbers = true,
    after_help = "\
Examples:
  atomesh synth faults -o faults.png
  atomesh synth layers -o layers.nii.gz --shape 128,128,64 --spacing 25,25,4 --noise 0.1"
)]
pub struct SynthArgs {
    /// What to draw. 2-D: faults, disc, slit, grains, section, section-faults; 3-D: the rest
    #[arg(value_name = "SCENE", value_parser = scene())]
    scene: Scene,
    /// Image to write: .png .npy .nii .nii.gz .nrrd .vti .tif .raw. The frame is kept by .nii, .nii.gz,
    /// .nrrd and .vti only
    #[arg(short, long, value_name = "IMAGE")]
    output: PathBuf,
    /// Samples along x, y (and z), 8 or more each. Default: 256,256 or 96,96,96
    #[arg(long, value_name = "NX,NY[,NZ]")]
    shape: Option<Counts>,
    /// World units from one sample to the next along x, y (and z). Default: 1
    #[arg(long, value_name = "SX,SY[,SZ]")]
    spacing: Option<Numbers>,
    /// Seed of the geometry and the noise
    #[arg(long, value_name = "SEED", default_value_t = 0)]
    seed: u64,
    /// Standard deviation of Gaussian noise, over the contrast of the image
    #[arg(long, value_name = "SHARE", default_value_t = 0.0)]
    noise: f64,
    /// Standard deviation in samples of a Gaussian blur
    #[arg(long, value_name = "SIGMA", default_value_t = 0.0)]
    blur: f64,
    /// Samples as unsigned bytes, as always in .png; else float32
    #[arg(long)]
    bytes: bool,
}

fn scene() -> impl TypedValueParser<Value = Scene> {
    PossibleValuesParser::new(Scene::NAMES).try_map(|name| name.parse())
}

/// Runs the command; the text is for standard output.
///
/// # Errors
/// [`Failure`] if an option is out of its range or a file cannot be written.
pub fn run(args: &SynthArgs, watch: &mut Progress) -> Result<String, Failure> {
    let format = ImageFormat::from_path(&args.output).filter(|format| format.is_written());
    if format.is_none() {
        let known = ImageFormat::usual_written_endings(", ", false);
        let message = format!("the ending says no format that is written; expected one of {known}");
        return Err(Failure::misuse(message).about(&args.output));
    }
    let bytes = args.bytes || format == Some(ImageFormat::PNG);
    match args.scene.dimension() {
        2 => draw::<2>(args, 256, bytes, watch),
        _ => draw::<3>(args, 96, bytes, watch),
    }
}

fn draw<const D: usize>(
    args: &SynthArgs,
    side: usize,
    bytes: bool,
    watch: &mut Progress,
) -> Result<String, Failure> {
    let shape = match &args.shape {
        Some(Counts(shape)) => shape.as_slice().try_into().map_err(|_| {
            let (scene, found) = (args.scene, shape.len());
            Failure::misuse(format!("--shape has {found} axes; {scene} has {D}"))
        })?,
        None => [side; D],
    };
    let mut options = SynthOptions::new(shape);
    if let Some(spacing) = &args.spacing {
        options.spacing = axes("--spacing", &spacing.0)?;
    }
    options.seed = args.seed;
    options.noise = args.noise;
    options.blur = args.blur;
    options.bytes = bytes;
    let samples = shape.iter().fold(1u64, |n, &s| n.saturating_mul(s as u64));
    // bytes are drawn at once unless they are blurred, in single precision
    let each = match (bytes, args.blur > 0.0) {
        (true, false) => 1,
        (true, true) => 5,
        (false, _) => 4,
    };
    let needed = samples.saturating_mul(each);
    if memory::available().is_some_and(|available| needed > available) {
        let needed = memory::text(needed);
        let message = format!("the image needs {needed} of memory, more than there is");
        return Err(Failure::content(message).advise("choose a smaller --shape"));
    }
    let truth_path = truth_path(&args.output);
    {
        let _guard = writing();
        check_writable(&args.output)?;
        check_writable(&truth_path)?;
    }
    watch.begin(Phase::Draw);
    let drawn = synthesize(args.scene, &options).map_err(|e| match e {
        SynthError::Memory { .. } => Failure::content(e),
        _ => Failure::misuse(e),
    })?;
    let truth = serde_json::to_string_pretty(&drawn.truth).map_err(Failure::content)?;
    if watch.step(Phase::Write, 0.0, None).is_break() {
        return Err(Failure::cancelled());
    }
    let _guard = writing();
    write_image(&args.output, &drawn.image, watch).map_err(|e| match e.reason {
        WriteReason::Cancelled(_) => Failure::cancelled(),
        WriteReason::Shape { .. } => Failure::misuse(e),
        _ => Failure::content(e),
    })?;
    write_bytes(&truth_path, (truth + "\n").as_bytes())?;
    let count = drawn.truth.features.len();
    watch.say(&format!(
        "{}: {:?} samples of {}; features in {}: {count}",
        args.output.display(),
        drawn.image.frame().shape(),
        drawn.image.samples().type_name(),
        truth_path.display(),
    ));
    Ok(String::new())
}

/// The image's name with another ending.
fn truth_path(image: &Path) -> PathBuf {
    let compressed = image.extension().is_some_and(|e| e.eq_ignore_ascii_case("gz"));
    let image = if compressed { image.with_extension("") } else { image.to_path_buf() };
    image.with_extension("truth.json")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_truth_lies_beside_the_image() {
        let of = |name: &str| truth_path(Path::new(name)).to_string_lossy().into_owned();
        assert_eq!(of("a/faults.png"), "a/faults.truth.json");
        assert_eq!(of("layers.nii.gz"), "layers.truth.json");
    }
}
