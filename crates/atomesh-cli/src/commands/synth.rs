//! `atomesh synth`: test images whose features are known.

use std::path::{Path, PathBuf};

use atomesh::synth::{Scene, SynthError, SynthOptions, synthesize};
use atomesh::watch::{Phase, Watch};
use atomesh_io::image::{ImageFormat, WriteReason, write_image};
use atomesh_job::files::{
    check_apart, is_standard_output, shown, stage, unknown_extension, write_bytes,
};
use atomesh_job::options::axes;
use atomesh_job::values::{Counts, Numbers};
use atomesh_job::{JobError, Session, memory};
use clap::builder::{PossibleValuesParser, TypedValueParser};

use super::standard_output::StandardOutput;
use crate::progress::Progress;

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
    /// Standard deviation of Gaussian noise, relative to the contrast of the image, 0 to 100
    #[arg(long, value_name = "SHARE", default_value_t = 0.0)]
    noise: f64,
    /// Standard deviation of a Gaussian blur, in samples
    #[arg(long, value_name = "SIGMA", default_value_t = 0.0)]
    blur: f64,
    /// Write samples as unsigned bytes, as .png always does, instead of float32
    #[arg(long)]
    bytes: bool,
    #[command(flatten)]
    standard_output: StandardOutput,
}

fn scene() -> impl TypedValueParser<Value = Scene> {
    PossibleValuesParser::new(Scene::NAMES).try_map(|name| name.parse())
}

/// Runs the command; the text is for standard output.
///
/// # Errors
/// [`JobError`] if an option is out of its range or a file cannot be written.
pub fn run(mut args: SynthArgs, progress: &mut Progress) -> Result<String, JobError> {
    args.standard_output.format(&mut args.output)?;
    let format = ImageFormat::from_path(&args.output).filter(|format| format.is_written());
    if format.is_none() {
        let known = ImageFormat::usual_written_endings(", ", false);
        return Err(unknown_extension(&args.output, &known));
    }
    let bytes = args.bytes || format == Some(ImageFormat::PNG);
    let drawn = |session: &mut Session<'_>| match args.scene.dimension() {
        2 => draw::<2>(&args, 256, bytes, session),
        _ => draw::<3>(&args, 96, bytes, session),
    };
    progress.job(drawn, |summary, _| summary.clone())?;
    Ok(String::new())
}

/// Draws the scene and writes it; in words.
fn draw<const D: usize>(
    args: &SynthArgs,
    side: usize,
    bytes: bool,
    session: &mut Session<'_>,
) -> Result<String, JobError> {
    let options = options::<D>(args, side, bytes)?;
    check_memory(&options)?;
    let truth_path = truth_path(&args.output);
    let outputs = [Some(args.output.as_path()), truth_path.as_deref()];
    check_apart([], outputs.into_iter().flatten(), session)?;
    if truth_path.is_none() {
        session
            .change("the features are not written: standard output has no place beside the image");
    }
    let _ = session.step(Phase::Draw, 0.0, None);
    let drawn = synthesize(args.scene, &options).map_err(|e| match e {
        SynthError::Memory { .. } => JobError::memory(e),
        _ => JobError::misuse(e),
    })?;
    let truth = serde_json::to_string_pretty(&drawn.truth).map_err(JobError::content)? + "\n";
    if session.step(Phase::Write, 0.0, None).is_break() {
        return Err(JobError::cancelled());
    }
    session.write_together(|group, session| {
        let image = stage(&args.output, group)?;
        write_image(&image, &drawn.image, session).map_err(|e| match e.reason {
            WriteReason::Shape { .. } => JobError::misuse(e.reason).about(&image),
            _ => e.into(),
        })?;
        match &truth_path {
            Some(path) => write_bytes(&stage(path, group)?, truth.as_bytes()),
            None => Ok(()),
        }
    })?;
    let features = match &truth_path {
        Some(path) => format!("features in {}", path.display()),
        None => "features".into(),
    };
    Ok(format!(
        "{}: {:?} samples of {}; {features}: {}",
        shown(&args.output),
        drawn.image.frame().shape(),
        drawn.image.samples().type_name(),
        drawn.truth.features.len(),
    ))
}

fn options<const D: usize>(
    args: &SynthArgs,
    side: usize,
    bytes: bool,
) -> Result<SynthOptions<D>, JobError> {
    let shape = match &args.shape {
        Some(Counts(shape)) => shape.as_slice().try_into().map_err(|_| {
            let (scene, found) = (args.scene, shape.len());
            JobError::misuse(format!("--shape has {found} axes; {scene} has {D}"))
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
    Ok(options)
}

/// Refuses an image that does not fit into memory.
fn check_memory<const D: usize>(options: &SynthOptions<D>) -> Result<(), JobError> {
    let samples = options.shape.iter().fold(1u64, |n, &s| n.saturating_mul(s as u64));
    // bytes are drawn at once unless they are blurred, in single precision
    let each = match (options.bytes, options.blur > 0.0) {
        (true, false) => 1,
        (true, true) => 5,
        (false, _) => 4,
    };
    let needed = samples.saturating_mul(each);
    if memory::available().is_none_or(|available| needed <= available) {
        return Ok(());
    }
    let needed = memory::text(needed);
    let message = format!("the image needs {needed} of memory, more than there is");
    Err(JobError::memory(message).advise("choose a smaller --shape"))
}

/// The image's name with another extension; standard output has none.
fn truth_path(image: &Path) -> Option<PathBuf> {
    if is_standard_output(image) {
        return None;
    }
    let compressed = image.extension().is_some_and(|e| e.eq_ignore_ascii_case("gz"));
    let image = if compressed { image.with_extension("") } else { image.to_path_buf() };
    Some(image.with_extension("truth.json"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_truth_lies_beside_the_image() {
        let of = |name: &str| truth_path(Path::new(name));
        assert_eq!(of("a/faults.png"), Some("a/faults.truth.json".into()));
        assert_eq!(of("layers.nii.gz"), Some("layers.truth.json".into()));
        assert_eq!(of("-.png"), None);
    }
}
