//! `atomesh flow`: steady flow on a mesh, or on the mesh of an image.

mod answer;
mod files;
mod ground;
mod permeability;
mod picture;
pub mod wells;

use std::path::PathBuf;

use atomesh_flow::dg::{DgOptions, Form};
use atomesh_flow::solve::{SolveMethod, SolveOptions};

use crate::failure::Failure;
use crate::frame_options::FrameOptions;
use crate::memory;
use crate::progress::Progress;
use crate::run_config::{
    ImprovementOptions, InputOptions, LatticeOptions, OptimizerOptions, OutputOptions,
    PotentialOptions, RegionOptions, RunConfig,
};
use crate::values::{named, number_in};

use wells::{BarrierSpec, SideSpec, WellSpec};

/// Compute steady flow on a mesh that follows an image, from sources to sinks, past faults
///
/// Solves -div(k grad p) = q. Given an image, it is meshed first, by the options of `atomesh mesh`, with
/// sources and sinks as fixed atoms; facets along which b is low are barriers. Given a mesh, its tagged features
/// are. Triangles and tetrahedra are solved on by a discontinuous Galerkin scheme, Voronoi cells (--mesh
/// voronoi) by two-point flux. Both conserve mass in every cell and let pressure jump across barriers.
///
/// The table of what flows in and out goes to standard output. Places and lengths of wells are in world
/// coordinates; units of permeability, pressure and time are the user's own. Nothing flows through a side without
/// a condition.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES, allow_negative_numbers = true, override_usage = USAGE)]
pub struct FlowArgs {
    #[command(flatten, next_help_heading = "Input")]
    input: InputOptions,
    #[command(flatten, next_help_heading = "Flow")]
    flow: FlowOptions,
    #[command(flatten, next_help_heading = "Output")]
    output: FlowOutput,
    #[command(flatten, next_help_heading = "Lattice")]
    lattice: LatticeOptions,
    #[command(flatten, next_help_heading = "Features")]
    features: PotentialOptions,
    #[command(flatten, next_help_heading = "Regions")]
    regions: RegionOptions,
    #[command(flatten, next_help_heading = "Frame")]
    frame: FrameOptions,
    #[command(flatten, next_help_heading = "Optimisation")]
    optimize: OptimizerOptions,
    #[command(flatten, next_help_heading = "Improvement")]
    improve: ImprovementOptions,
    /// Take the options of the mesh from a file that `mesh --write-config` wrote; the command line goes before
    /// it
    #[arg(long, value_name = "TOML", help_heading = "Input")]
    config: Option<PathBuf>,
}

const USAGE: &str = "\
atomesh flow [OPTIONS] IMAGE --source X,Y[,Z] --sink X,Y[,Z]
       atomesh flow [OPTIONS] MESH --source X,Y[,Z] --sink X,Y[,Z]";

const EXAMPLES: &str = "\
Examples:
  From an image to a picture of flow past its faults:
    atomesh flow faults.png --size 8 --source 20,20 --sink 300,300 --picture flow.png
  Faults that let a thousandth through, a well of given pressure, and the answer as files:
    atomesh flow faults.png --size 8 --multiplier 0.001 --source 20,20:pressure=10:radius=0.1 \\
      --sink 300,300:rate=2 -o flow.vtu --streamlines lines.vtp --report flow.json
  On a mesh with tags, from one side to the other, permeability from the image it was sampled from:
    atomesh sample tagged.msh --image k=permeability.npy --statistic harmonic -o rock.vtu
    atomesh flow rock.vtu --permeability k --side xmin=pressure:1 --side xmax=pressure:0 -o flow.vtu
  The same on Voronoi cells:
    atomesh flow faults.png --mesh voronoi --size 8 --source 20,20 --sink 300,300 --picture flow.png";

/// What flows where.
#[derive(Clone, Debug, clap::Args)]
struct FlowOptions {
    /// A source: its place, and if wanted :rate=Q (default 1) or :pressure=P, and :radius=R, which a pressure needs.
    /// May be given again
    #[arg(long, value_name = "X,Y[,Z][:KEY=VALUE]", allow_hyphen_values = true)]
    source: Vec<WellSpec>,
    /// A sink, likewise; those without rate or pressure share what the other wells bring
    #[arg(long, value_name = "X,Y[,Z][:KEY=VALUE]", allow_hyphen_values = true)]
    sink: Vec<WellSpec>,
    /// Pressure, or flux into the domain through a unit of area, on tagged facets of the boundary such as xmin.
    /// May be given again
    #[arg(long, value_name = "NAME=pressure:P|flux:F")]
    side: Vec<SideSpec>,
    /// Facets along which the mean of b is at most this are faults; with images only. With --mesh voronoi, |b| along
    /// faces
    #[arg(long, value_name = "B", default_value_t = -0.2,
        value_parser = number_in(-1.0, 0.0, "a number from -1 to 0"))]
    below: f64,
    /// What share of the flow the faults, all groups named feature-N, let through: 0 seals, 1 does nothing
    #[arg(long, value_name = "M", default_value_t = 0.0,
        value_parser = number_in(0.0, 1.0, "a number from 0 to 1"))]
    multiplier: f64,
    /// The same for one group of facets. May be given again
    #[arg(long, value_name = "NAME=M")]
    barrier: Vec<BarrierSpec>,
    /// Permeability: a number; one for each axis, KX,KY or KX,KY,KZ; a tensor Kxx,Kxy,Kyy or Kxx,Kxy,Kxz,Kyy,Kyz,Kzz; or the
    /// name of a cell field of the mesh
    #[arg(long, value_name = "K | NAME", default_value = "1")]
    permeability: String,
    /// Image of permeabilities, averaged over each cell
    #[arg(long, value_name = "FILE", conflicts_with = "permeability")]
    permeability_image: Option<PathBuf>,
    /// How it is averaged
    #[arg(long, value_name = "MEAN", default_value = "geometric", requires = "permeability_image",
        value_parser = ["mean", "harmonic", "geometric"])]
    permeability_mean: String,
    /// Share of the volume that the fluid fills, for times of flight
    #[arg(long, value_name = "PHI", default_value_t = 1.0,
        value_parser = number_in(1e-12, 1.0, "a number above 0, at most 1"))]
    porosity: f64,
    /// Form of the discontinuous Galerkin scheme: symmetric interior penalty, or Oden, Babuska and Baumann's, of
    /// order 2 or more
    #[arg(long, value_name = "FORM", value_parser = named::<Form>(&["sipg", "obb"]))]
    form: Option<Form>,
    /// Degree of the pressure in a cell, 1 to 3. Default: 2
    #[arg(long, value_name = "ORDER", value_parser = clap::value_parser!(u8).range(0..=9))]
    order: Option<u8>,
    /// How equations are solved
    #[arg(long, value_name = "METHOD", default_value = "auto",
        value_parser = named::<SolveMethod>(&["auto", "direct", "iterative"]))]
    solver: SolveMethod,
    /// Share of the right-hand side that iteration may leave
    #[arg(long, value_name = "SHARE", default_value_t = SolveOptions::default().tolerance,
        value_parser = number_in(1e-15, 1e-2, "a number from 1e-15 to 0.01"))]
    solver_tolerance: f64,
}

impl FlowOptions {
    fn solve(&self) -> SolveOptions {
        SolveOptions {
            method: self.solver,
            tolerance: self.solver_tolerance,
            memory: memory::available().unwrap_or(u64::MAX) / 10 * 8,
            ..SolveOptions::default()
        }
    }

    fn galerkin(&self) -> DgOptions {
        let default = DgOptions::default();
        let form = self.form.unwrap_or(default.form);
        let order = self.order.map_or(default.order, usize::from);
        DgOptions { form, order, solve: self.solve(), ..default }
    }
}

/// The files that are written.
#[derive(Clone, Debug, clap::Args)]
struct FlowOutput {
    /// Mesh with pressure, velocity, mean time of flight from where it flows in (NaN where nothing comes) and
    /// permeability of each cell: .vtu; triangles and tetrahedra also .msh .msh2 .vtk .npz, without velocity
    #[arg(short, long, value_name = "MESH")]
    output: Option<PathBuf>,
    /// Pressure as the scheme has it, with its jumps: a .vtu whose points are repeated for each cell
    #[arg(long, value_name = "VTU")]
    pressure_output: Option<PathBuf>,
    /// Streamlines from source to sink, with times of flight, as .vtp
    #[arg(long, value_name = "VTP")]
    streamlines: Option<PathBuf>,
    /// How many streamlines, dealt to sources by their rates
    #[arg(long, value_name = "COUNT", default_value_t = 60)]
    streamline_count: usize,
    /// What flows through each facet: a head as JSON, and beside it NAME-facets.csv
    #[arg(long, value_name = "NAME.json")]
    fluxes: Option<PathBuf>,
    /// Wells, compartments, mass balance and how the equations were solved, as JSON
    #[arg(long, value_name = "JSON")]
    report: Option<PathBuf>,
    /// Picture of the flow, .png or .svg: mesh, faults bold, flow vectors; in 3-D on the three slices through the
    /// middle
    #[arg(long, value_name = "PICTURE")]
    picture: Option<PathBuf>,
    /// What the picture shows behind the mesh
    #[arg(long, value_name = "WHAT", default_value = "image", value_parser = ["image", "pressure"])]
    picture_of: String,
    /// Draw streamlines too
    #[arg(long)]
    picture_streamlines: bool,
}

/// Runs the command; the text is for standard output.
///
/// # Errors
/// [`Failure`] if options make no sense, a file cannot be used, or the user ends the work.
pub fn run(args: FlowArgs, watch: &mut Progress) -> Result<String, Failure> {
    let FlowArgs {
        input,
        flow,
        output,
        lattice,
        features,
        regions,
        frame,
        optimize,
        improve,
        config,
    } = args;
    let mut run = RunConfig {
        input,
        lattice,
        features,
        regions,
        frame,
        optimize,
        improve,
        ..RunConfig::default()
    };
    if let Some(path) = &config {
        run = run.or_file(path)?;
        run.output = OutputOptions::default();
    }
    let files = files::Files::new(&output, &run)?;
    if run.is_voronoi() {
        files.check_for_cells(&flow)?;
    }
    ground::run(run, &flow, &files, watch)
}
