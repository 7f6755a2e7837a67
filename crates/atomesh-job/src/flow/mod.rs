//! Steady flow on a mesh, or on the mesh of an image.
//!
//! [`flow`] goes from images to an answer in one call, [`flow_on`] starts from a mesh, and [`flow_file`] goes
//! from file to file.

mod answer;
mod expect;
mod files;
mod flow_mesh;
mod leak;
mod options;
mod permeability;
mod picture;
mod problem;
mod write;

pub use answer::FlowAnswer;
pub use expect::{FlowExpectation, expect};
pub use flow_mesh::{FlowMesh, FlowMeshCells};
pub use leak::Leak;
pub use options::{FlowOptions, FlowOutputOptions};
pub use picture::FlowPictureOptions;

use std::path::PathBuf;

use atomesh_flow::dg::{self, Form};
use atomesh_flow::{Balance, Setting, Solution, WellFlow};
use atomesh_io::image::{AnyImage, LoadedImage};
use atomesh_io::mesh::MeshFormat;

use crate::dimension::Dimension;
use crate::error::JobError;
use crate::memory;
use crate::mesh::{MeshImages, ShownImage, prepare, read_shown, shown};
use crate::mesh_file;
use crate::options::{
    FrameOptions, ImprovementOptions, InputOptions, LatticeOptions, OptimizerOptions,
    OutputOptions, PotentialOptions, RegionOptions, RunConfig,
};
use crate::session::Session;
use crate::values::Numbers;
use files::FlowFiles;
use flow_mesh::AnyFlowMesh;
use leak::leak;
use write::FlowWriting;

/// Meshes images, with wells as atoms and facets along features as barriers, and computes what flows.
///
/// # Errors
/// [`JobError`] if options make no sense, an image is of no use, the problem has no answer, memory does not
/// suffice, or the watch ends the work.
pub fn flow<const D: usize>(
    run: &RunConfig,
    options: &FlowOptions,
    images: MeshImages<D>,
    dimension: &Dimension<D>,
    session: &mut Session<'_>,
) -> Result<FlowAnswer<D>, JobError> {
    let run = with_wells(run.clone(), options);
    let (prepared, image) = prepare(&run, images, dimension, session)?;
    let mut mesh = FlowMesh::of_prepared(&run, options, prepared, session)?;
    mesh.image = Some(image);
    flow_on(mesh, options, &run.frame, dimension, session)
}

/// Wells are atoms, so that cells meet or centre there.
fn with_wells(mut run: RunConfig, options: &FlowOptions) -> RunConfig {
    let places = options.wells().map(|(_, well)| Numbers(well.coordinates().to_vec()));
    run.lattice.seed_point.get_or_insert_default().extend(places);
    run
}

/// Tetrahedra from which on Oden, Babuška & Baumann's equations, which iteration does not solve, take minutes.
const OBB_CELLS: usize = 3000;

/// Computes what flows on a mesh; `frame` is for the image of permeabilities.
///
/// # Errors
/// As [`flow`].
pub fn flow_on<const D: usize>(
    mesh: FlowMesh<D>,
    options: &FlowOptions,
    frame: &FrameOptions,
    dimension: &Dimension<D>,
    session: &mut Session<'_>,
) -> Result<FlowAnswer<D>, JobError> {
    let method = &dimension.flow;
    let grid = mesh.grid(method);
    let permeability = permeability::permeability(options, frame, &mesh, dimension, session)?;
    let problem = problem::problem(options, &grid, permeability)?;
    let setting = (method.setting)(&problem, &grid)?;
    let (solution, galerkin) = match &mesh.cells {
        FlowMeshCells::Voronoi { cells, .. } => {
            options.check_for_voronoi()?;
            ((method.solve_two_point)(cells, &grid, &setting, &options.solve(), session)?, None)
        }
        FlowMeshCells::Simplices { .. } => {
            let galerkin = options.galerkin();
            memory::check_equations(dg::memory(&grid, &galerkin))?;
            let is_obb = galerkin.form == Form::OdenBabuskaBaumann;
            if D == 3 && is_obb && grid.cell_count() > OBB_CELLS {
                let text = "obb takes long on so many tetrahedra; sipg is much faster";
                session.warn(None, text);
            }
            let answer = (method.solve_dg)(&grid, &setting, &galerkin, session)?;
            (answer.solution.clone(), Some(answer))
        }
    };
    let leak = said(&mesh, &setting, &solution, (method.balance)(&solution, &grid).scale, session);
    let velocities = (method.velocities)(&solution, &grid);
    let porosity = options.porosity;
    Ok(FlowAnswer { mesh, grid, problem, solution, velocities, galerkin, porosity, leak })
}

/// Says if nothing flows, or if something flows past barriers; gives the latter. `scale` is all that flows.
fn said<const D: usize>(
    mesh: &FlowMesh<D>,
    setting: &Setting<'_, D>,
    solution: &Solution<D>,
    scale: f64,
    session: &mut Session<'_>,
) -> Option<Leak> {
    if !setting.is_driven() || scale == 0.0 {
        let text = "nothing flows: barriers part all that drives it, or it is the same everywhere";
        session.warn(None, text);
        return None;
    }
    let found = leak(&mesh.across, &solution.fluxes, setting.multipliers(), scale)?;
    let place: Vec<String> = found.place.iter().map(|x| format!("{x:.6}")).collect();
    let place = place.iter().map(|x| x.trim_end_matches('0').trim_end_matches('.'));
    let text = format!(
        "{:.1} % of what flows passes a feature where no facets lie on it, most near {}: shorter edges (--size) \
         leave less open",
        100.0 * found.share,
        place.collect::<Vec<_>>().join(",")
    );
    session.warn(None, text);
    Some(found)
}

/// Everything that decides a run from file to file.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "clap", derive(clap::Args))]
pub struct FlowRequest {
    /// Files read.
    #[cfg_attr(feature = "clap", command(flatten, next_help_heading = "Input"))]
    pub input: InputOptions,
    /// What flows where.
    #[cfg_attr(feature = "clap", command(flatten, next_help_heading = "Flow"))]
    pub flow: FlowOptions,
    /// Files written.
    #[cfg_attr(feature = "clap", command(flatten, next_help_heading = "Output"))]
    pub output: FlowOutputOptions,
    /// Lattice.
    #[cfg_attr(feature = "clap", command(flatten, next_help_heading = "Lattice"))]
    pub lattice: LatticeOptions,
    /// Potential.
    #[cfg_attr(feature = "clap", command(flatten, next_help_heading = "Features"))]
    pub features: PotentialOptions,
    /// Regions.
    #[cfg_attr(feature = "clap", command(flatten, next_help_heading = "Regions"))]
    pub regions: RegionOptions,
    /// Frame.
    #[cfg_attr(feature = "clap", command(flatten, next_help_heading = "Frame"))]
    pub frame: FrameOptions,
    /// Optimizer.
    #[cfg_attr(feature = "clap", command(flatten, next_help_heading = "Optimisation"))]
    pub optimize: OptimizerOptions,
    /// Improvement.
    #[cfg_attr(feature = "clap", command(flatten, next_help_heading = "Improvement"))]
    pub improve: ImprovementOptions,
    /// Take the options of the mesh from a file that `mesh --write-config` wrote; the command line takes precedence
    #[cfg_attr(feature = "clap", arg(long, value_name = "TOML", help_heading = "Input"))]
    pub config: Option<PathBuf>,
}

impl FlowRequest {
    /// The options of the mesh, without its files; of flow; and of the files written.
    fn into_parts(self) -> Result<(RunConfig, FlowOptions, FlowOutputOptions), JobError> {
        let mut run = RunConfig {
            input: self.input,
            output: OutputOptions::default(),
            lattice: self.lattice,
            features: self.features,
            regions: self.regions,
            frame: self.frame,
            optimize: self.optimize,
            improve: self.improve,
        };
        if let Some(path) = &self.config {
            run = run.or_file(path)?;
            run.output = OutputOptions::default();
        }
        Ok((run, self.flow, self.output))
    }
}

/// What became of a run from file to file.
#[derive(Clone, Debug)]
pub struct FlowSummary {
    /// How many cells.
    pub cell_count: usize,
    /// The scheme, in words.
    pub scheme: String,
    /// How many unknowns.
    pub unknowns: usize,
    /// How the equations were solved, in words.
    pub method: String,
    /// What flows through wells.
    pub wells: Vec<WellFlow>,
    /// What flows in and out.
    pub balance: Balance,
}

/// Meshes an image or reads a mesh, computes what flows, and writes the files that are named.
///
/// # Errors
/// [`JobError`] as [`flow`], and if a file cannot be read or written.
pub fn flow_file(request: FlowRequest, session: &mut Session<'_>) -> Result<FlowSummary, JobError> {
    let Opened { run, options, files, source } = Opened::new(request, session)?;
    let work = FileRun { run: &run, options: &options, files: &files };
    match source {
        Source::Mesh(mesh) => match *mesh {
            AnyFlowMesh::Flat(mesh) => work.solve(mesh, &Dimension::plane(), session),
            AnyFlowMesh::Volume(mesh) => work.solve(mesh, &Dimension::space(), session),
        },
        Source::Image(loaded) => {
            let world = loaded.world();
            let image = loaded.image;
            match image {
                AnyImage::Flat(image) => {
                    work.mesh(ShownImage { image, world }, &Dimension::plane(), session)
                }
                AnyImage::Volume(image) => {
                    work.mesh(ShownImage { image, world }, &Dimension::space(), session)
                }
            }
        }
    }
}

/// A request whose options and files fit each other, with what it is about read.
struct Opened {
    run: RunConfig,
    options: FlowOptions,
    files: FlowFiles,
    source: Source,
}

/// What flow is computed on.
enum Source {
    /// A mesh as it is.
    Mesh(Box<AnyFlowMesh>),
    /// The mesh of an image.
    Image(Box<LoadedImage>),
}

impl Opened {
    fn new(request: FlowRequest, session: &mut Session<'_>) -> Result<Self, JobError> {
        let (mut run, options, output) = request.into_parts()?;
        let files = FlowFiles::new(&output)?;
        files.check(&run.input, session)?;
        if run.is_voronoi() {
            options.check_for_voronoi()?;
            files.check_for_voronoi()?;
        }
        run.take_labels_alone();
        let path = shown(&run)?.to_path_buf();
        let is_mesh = mesh_file::is_list(&path) || MeshFormat::is_mesh(&path);
        if is_mesh && !path.is_dir() && run.frame.shape.is_none() {
            refuse_mesh_options(&run)?;
            let source = Source::Mesh(Box::new(flow_mesh::read(&path, session)?));
            return Ok(Self { run, options, files, source });
        }
        let run = with_wells(run, &options);
        run.check()?;
        let source = Source::Image(Box::new(read_shown(&run, session)?));
        Ok(Self { run, options, files, source })
    }
}

/// A mesh as read is not meshed again.
fn refuse_mesh_options(run: &RunConfig) -> Result<(), JobError> {
    let others = [
        ("lattice", run.lattice.is_empty()),
        ("features", run.features.is_empty()),
        ("regions", run.regions.is_empty()),
        ("optimisation", run.optimize.is_empty()),
        ("improvement", run.improve.is_empty()),
    ];
    match others.iter().find(|(_, is_empty)| !is_empty) {
        Some((section, _)) => Err(JobError::misuse(format!(
            "options of {section} with a mesh; expected an image, or none of them"
        ))),
        None => Ok(()),
    }
}

/// A run from file to file whose options are known.
struct FileRun<'a> {
    run: &'a RunConfig,
    options: &'a FlowOptions,
    files: &'a FlowFiles,
}

impl FileRun<'_> {
    /// Meshes the image, solves and writes.
    fn mesh<const D: usize>(
        &self,
        image: ShownImage<D>,
        dimension: &Dimension<D>,
        session: &mut Session<'_>,
    ) -> Result<FlowSummary, JobError> {
        let images = MeshImages::read_fields(self.run, image, dimension, session)?;
        let world = images.world.clone();
        let (prepared, image) = prepare(self.run, images, dimension, session)?;
        let image = self.files.picture.is_some().then_some(image);
        let mut mesh = FlowMesh::of_prepared(self.run, self.options, prepared, session)?;
        mesh.image = image;
        mesh.provenance = mesh.provenance.map(|provenance| provenance.in_world(&world));
        self.solve(mesh, dimension, session)
    }

    /// Solves and writes.
    fn solve<const D: usize>(
        &self,
        mesh: FlowMesh<D>,
        dimension: &Dimension<D>,
        session: &mut Session<'_>,
    ) -> Result<FlowSummary, JobError> {
        if matches!(mesh.cells, FlowMeshCells::Voronoi { .. }) {
            self.files.check_for_voronoi()?;
        }
        let answer = flow_on(mesh, self.options, &self.run.frame, dimension, session)?;
        FlowWriting::new(self.files, &answer, dimension).write(session)?;
        let solve = &answer.solution.solve;
        Ok(FlowSummary {
            cell_count: answer.grid.cell_count(),
            scheme: answer.scheme(),
            unknowns: solve.unknowns,
            method: solve.method.to_string(),
            wells: answer.solution.wells.clone(),
            balance: answer.balance(&dimension.flow),
        })
    }
}
