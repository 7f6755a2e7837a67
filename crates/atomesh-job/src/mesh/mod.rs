//! From an image to a mesh.
//!
//! [`mesh`] is the job in memory: options and images in, [`Outcome`] out. [`mesh_file`] is the same from file
//! to file, and [`expect`] says what it would take. Options, formats and places of files are checked before an
//! image is read.

mod figures;
mod format;
mod inputs;
mod made;
mod movie;
mod outputs;
mod phases;
mod refusal;
mod write;

pub use figures::{Figures, Measured};
pub(crate) use inputs::shown;
pub use inputs::{GivenField, GivenFields, MeshImages, ShownImage, read_shown};
pub use made::MadeMesh;
pub(crate) use outputs::staged_list;
pub use refusal::refusal;
pub use write::Tagged;
pub(crate) use write::cells_of_wells;

use std::path::{Path, PathBuf};

use atomesh::image::Image;
use atomesh::improve::ImproveReport;
use atomesh::run::{Estimate, Outcome, Prepared};
use atomesh_io::image::AnyImage;

use crate::dimension::Dimension;
use crate::error::JobError;
use crate::memory;
use crate::options::RunConfig;
use crate::session::Session;
use made::Wanted;
use movie::{Recorder, Recording};
use outputs::Outputs;

/// Makes b(x), d(x) and β(x), and gives the image back. Memory is limited to what is available.
///
/// # Errors
/// [`JobError`] if options make no sense or an image is of no use.
pub fn prepare<const D: usize>(
    run: &RunConfig,
    mut images: MeshImages<D>,
    dimension: &Dimension<D>,
    session: &mut Session<'_>,
) -> Result<(Prepared<D>, Image<D>), JobError> {
    let mut options = run.mesh_options::<D>()?;
    options.memory_limit = memory::available();
    let potential = images.take_potential(run)?;
    let inputs = images.inputs(potential.as_ref());
    let prepared = atomesh::run::prepare(&dimension.method, inputs, options, session);
    let prepared = prepared.map_err(|e| refusal(run, e))?;
    for warning in prepared.warnings() {
        session.say(run.input.shown(), warning);
    }
    Ok((prepared, images.image))
}

/// Meshes images.
///
/// # Errors
/// [`JobError`] if options make no sense, an image is of no use, memory does not suffice, or the watch ends
/// the work.
pub fn mesh<const D: usize>(
    run: &RunConfig,
    images: MeshImages<D>,
    dimension: &Dimension<D>,
    session: &mut Session<'_>,
) -> Result<Outcome<D>, JobError> {
    let (prepared, image) = prepare(run, images, dimension, session)?;
    drop(image);
    meshed(run, prepared, session)
}

/// Meshes what is prepared, and says what of it is odd.
///
/// # Errors
/// [`JobError`] if memory does not suffice, the image is of no use, or the watch ends the work.
pub fn meshed<const D: usize>(
    run: &RunConfig,
    prepared: Prepared<D>,
    session: &mut Session<'_>,
) -> Result<Outcome<D>, JobError> {
    recorded(run, prepared, None, session)
}

/// The same, with its atoms recorded if there is to be a movie.
fn recorded<const D: usize>(
    run: &RunConfig,
    prepared: Prepared<D>,
    recording: Option<&mut Recording<D>>,
    session: &mut Session<'_>,
) -> Result<Outcome<D>, JobError> {
    let said = prepared.warnings().len();
    let outcome = match recording {
        Some(recording) => prepared.run(&mut Recorder { recording, session }),
        None => prepared.run(session),
    };
    let outcome = outcome.map_err(|e| refusal(run, e))?;
    for warning in &outcome.warnings()[said..] {
        session.say(run.input.shown(), warning);
    }
    Ok(outcome)
}

/// What became of a run from file to file.
#[derive(Clone, Debug)]
pub struct MeshSummary {
    /// The mesh's file.
    pub mesh: PathBuf,
    /// What its cells are called.
    pub cells: &'static str,
    /// What was measured.
    pub figures: Figures,
    /// What was improved.
    pub improved: Option<ImproveReport>,
    /// The features that were tagged, if that was asked for.
    pub tagged: Option<Tagged>,
}

/// What a run would take.
#[derive(Clone, Debug)]
pub struct Expectation {
    /// Atoms and cells.
    pub estimate: Estimate,
    /// Bytes that the process takes at its peak.
    pub memory: u64,
    /// How many cells.
    pub cell_count: u64,
    /// What the cells are called.
    pub cells: &'static str,
    /// From the start to the mesh, without reports and files.
    pub seconds: f64,
}

/// How [`mesh_file`] does its work.
#[derive(Clone, Copy, Debug, Default)]
pub struct MeshFileOptions<'a> {
    /// Where all options are written, with their defaults.
    pub write_config: Option<&'a Path>,
    /// Whether the shape is measured though no report asks for it.
    pub measures_shape: bool,
}

/// Meshes the files that options name, and writes those that they name.
///
/// # Errors
/// [`JobError`] as [`mesh()`], and if a file cannot be read or written.
pub fn mesh_file(
    mut run: RunConfig,
    options: &MeshFileOptions<'_>,
    session: &mut Session<'_>,
) -> Result<MeshSummary, JobError> {
    run.take_labels_alone();
    run.check()?;
    shown(&run)?;
    let outputs = Outputs::new(&run, options.write_config)?;
    outputs.check(&run, session)?;
    let work = FileRun { run: &run, outputs: &outputs, options };
    let loaded = read_shown(&run, session)?;
    let (world, image) = (loaded.world(), loaded.image);
    match image {
        AnyImage::Flat(image) => {
            work.run(ShownImage { image, world }, &Dimension::plane(), session)
        }
        AnyImage::Volume(image) => {
            work.run(ShownImage { image, world }, &Dimension::space(), session)
        }
    }
}

/// Says what [`mesh_file`] would take; writes nothing.
///
/// # Errors
/// As [`mesh_file`].
pub fn expect(mut run: RunConfig, session: &mut Session<'_>) -> Result<Expectation, JobError> {
    run.take_labels_alone();
    run.check()?;
    let loaded = read_shown(&run, session)?;
    let (world, image) = (loaded.world(), loaded.image);
    match image {
        AnyImage::Flat(image) => {
            expect_image(&run, ShownImage { image, world }, &Dimension::plane(), session)
        }
        AnyImage::Volume(image) => {
            expect_image(&run, ShownImage { image, world }, &Dimension::space(), session)
        }
    }
}

/// How much of each thread beyond the first is used; from our own runs.
const SHARE_OF_THREAD: f64 = 0.7;
/// How much more memory cells of second order take at an atom, in the plane and in space.
const SECOND_ORDER_BYTES: [f64; 2] = [150.0, 450.0];

/// The time that work of so many processor seconds takes.
pub(crate) fn on_threads(cpu_seconds: f64) -> f64 {
    cpu_seconds / (1.0 + SHARE_OF_THREAD * (rayon::current_num_threads() as f64 - 1.0))
}

pub(crate) fn expect_image<const D: usize>(
    run: &RunConfig,
    image: ShownImage<D>,
    dimension: &Dimension<D>,
    session: &mut Session<'_>,
) -> Result<Expectation, JobError> {
    let images = MeshImages::read_fields(run, image, dimension, session)?;
    let samples = images.image.samples();
    // reports and pictures need the image to the end
    let RunConfig { output, .. } = run;
    let is_kept = [&output.report, &output.html, &output.picture, &output.movie]
        .into_iter()
        .any(Option::is_some);
    let image_bytes = if is_kept { samples.len() * samples.sample_size() } else { 0 } as u64;
    let (prepared, _) = prepare(run, images, dimension, session)?;
    let estimate = prepared.estimate();
    let (cell_count, cells) = match run.is_voronoi() {
        true => (estimate.atoms, dimension.voronoi_cells),
        false => (estimate.cells, dimension.cells),
    };
    let later = on_threads(estimate.cpu_seconds);
    // what is prepared has taken its time and memory already
    let seconds = (session.elapsed().as_secs_f64() + later).max(0.1);
    let second_order = match run.output.order {
        Some(2) => SECOND_ORDER_BYTES[D - 2] * estimate.atoms as f64,
        _ => 0.0,
    };
    let later = estimate.memory + second_order as u64 + image_bytes;
    let memory = memory::peak().map_or(later, |peak| peak.max(later));
    Ok(Expectation { estimate, memory, cell_count, cells, seconds })
}

/// A run from file to file whose options are known.
struct FileRun<'a> {
    run: &'a RunConfig,
    outputs: &'a Outputs,
    options: &'a MeshFileOptions<'a>,
}

impl FileRun<'_> {
    fn run<const D: usize>(
        &self,
        image: ShownImage<D>,
        dimension: &Dimension<D>,
        session: &mut Session<'_>,
    ) -> Result<MeshSummary, JobError> {
        let (run, outputs) = (self.run, self.outputs);
        outputs.view.check_dimension(D)?;
        let images = MeshImages::read_fields(run, image, dimension, session)?;
        let world = images.world.clone();
        let (prepared, image) = prepare(run, images, dimension, session)?;
        let image = outputs.needs_image().then_some(image);
        let units = run.lattice.units.unwrap_or_default();
        let image = image.as_ref();
        let mut recording =
            image.filter(|_| outputs.movie.is_some()).map(|image| Recording::new(image, units));
        let outcome = recorded(run, prepared, recording.as_mut(), session)?;
        let made = MadeMesh {
            run,
            outcome: &outcome,
            image,
            world: &world,
            properties: &[],
            regions: None,
        };
        let wanted =
            Wanted { recording: recording.as_ref(), measures_shape: self.options.measures_shape };
        made.write_outputs(outputs, wanted, dimension, session)
    }
}
