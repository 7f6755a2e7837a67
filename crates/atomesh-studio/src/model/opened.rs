//! Opening an image: a file, or a scene that is drawn.

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use atomesh::image::{Image, Range, Samples};
use atomesh::synth::{Scene, SynthOptions, synthesize};
use atomesh::watch::Watch;
use atomesh_io::image::AnyImage;
use atomesh_io::mesh::World;
use atomesh_job::mesh::{ShownImage, read_shown};
use atomesh_job::options::RunConfig;
use atomesh_job::{JobError, Session};
use sha2::{Digest, Sha256};

use crate::log::Source;

/// Samples of a synthetic image along each axis, in the plane and in space.
const SCENE_SHAPE: [usize; 2] = [256, 96];

/// Bins of the histogram.
const BINS: usize = 64;

/// Samples that the histogram looks at, at most.
const LOOKED_AT: usize = 1 << 18;

/// An image as it was read or drawn.
#[derive(Clone, Debug)]
pub struct Opened<const D: usize> {
    /// What it is called.
    pub name: String,
    /// The image.
    pub shown: ShownImage<D>,
    /// The range of its samples.
    pub range: Range,
    /// How many samples there are in each of equal parts of the range, of an even choice where there are many.
    pub bins: Vec<u32>,
    /// What its reader took for granted.
    pub notes: Vec<String>,
}

impl<const D: usize> Opened<D> {
    fn new(name: String, shown: ShownImage<D>, notes: Vec<String>) -> Self {
        let range = shown.image.range();
        let bins = histogram(shown.image.samples(), &range);
        Self { name, shown, range, bins, notes }
    }
}

fn histogram(samples: &Samples, range: &Range) -> Vec<u32> {
    let mut bins = vec![0; BINS];
    let step = samples.len().div_ceil(LOOKED_AT).max(1);
    let extent = range.max - range.min;
    for i in (0..samples.len()).step_by(step) {
        let share = (samples.get(i) - range.min) / extent;
        if (0.0..=1.0).contains(&share) {
            bins[((share * BINS as f64) as usize).min(BINS - 1)] += 1;
        }
    }
    bins
}

/// An image of either dimension.
#[derive(Debug)]
pub enum AnyOpened {
    /// In the plane.
    Flat(Opened<2>),
    /// In space.
    Volume(Opened<3>),
}

/// The file that a source is, if it is one.
pub fn file_of(source: &Source, folder: &Path) -> Option<PathBuf> {
    match source {
        Source::File { path, .. } => Some(path.clone()),
        Source::Dropped { name, .. } => Some(folder.join(name)),
        Source::Scene { .. } => None,
    }
}

/// SHA-256 of a file's bytes in hexadecimal digits; none of a folder.
///
/// # Errors
/// [`JobError`] if it cannot be read.
pub fn sha256(path: &Path) -> Result<Option<String>, JobError> {
    if path.is_dir() {
        return Ok(None);
    }
    let unreadable = |e| JobError::unreadable(&e).about(path);
    let mut file = File::open(path).map_err(unreadable)?;
    let (mut hash, mut buffer) = (Sha256::new(), vec![0; 1 << 16]);
    loop {
        match file.read(&mut buffer).map_err(unreadable)? {
            0 => break,
            count => hash.update(&buffer[..count]),
        }
    }
    Ok(Some(hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect()))
}

/// Opens a source, whose file must be what it was when it was logged.
///
/// # Errors
/// [`JobError`] if the file cannot be read, has changed, or no scene has the name.
pub fn open(
    source: &Source,
    run: &RunConfig,
    folder: &Path,
    watch: &mut dyn Watch,
) -> Result<AnyOpened, JobError> {
    let expected = match source {
        Source::Scene { name, seed } => return draw(name, *seed),
        Source::File { sha256, .. } => sha256.as_deref(),
        Source::Dropped { sha256, .. } => Some(sha256.as_str()),
    };
    let path = file_of(source, folder).expect("a scene was drawn above");
    if expected.is_some() && sha256(&path)?.as_deref() != expected {
        let message = "is not the file that the session was begun with";
        return Err(JobError::content(message)
            .about(&path)
            .advise("begin a session of its own with --session FOLDER"));
    }
    let mut session = Session::new(watch);
    let loaded = read_shown(run, &mut session)?;
    let notes = session.notes().iter().map(ToString::to_string).collect();
    let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
    let world = loaded.world();
    Ok(match loaded.image {
        AnyImage::Flat(image) => {
            AnyOpened::Flat(Opened::new(name, ShownImage { image, world }, notes))
        }
        AnyImage::Volume(image) => {
            AnyOpened::Volume(Opened::new(name, ShownImage { image, world }, notes))
        }
    })
}

/// Draws a scene, as `atomesh synth` does by default.
fn draw(name: &str, seed: u64) -> Result<AnyOpened, JobError> {
    let scene: Scene = name.parse().map_err(JobError::misuse)?;
    Ok(match scene.dimension() {
        2 => AnyOpened::Flat(drawn(scene, seed)?),
        _ => AnyOpened::Volume(drawn(scene, seed)?),
    })
}

fn drawn<const D: usize>(scene: Scene, seed: u64) -> Result<Opened<D>, JobError> {
    let options = SynthOptions { seed, ..SynthOptions::new([SCENE_SHAPE[D - 2]; D]) };
    let image: Image<D> = synthesize(scene, &options).map_err(JobError::misuse)?.image;
    let shown = ShownImage { image, world: World::default() };
    Ok(Opened::new(scene.name().into(), shown, Vec::new()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_histogram_counts_each_sample_once_and_no_nan() {
        let of = |values: &[f32]| {
            let samples = Samples::F32(values.to_vec().into());
            histogram(&samples, &samples.range())
        };
        let bins = of(&[0.0, 0.0, 1.0, f32::NAN, 0.5]);
        assert_eq!((bins[0], bins[32], bins[63]), (2, 1, 1));
        assert_eq!(bins.iter().sum::<u32>(), 4);
        assert_eq!(of(&[3.0; 5]).iter().sum::<u32>(), 0, "one value has no range");
    }
}
