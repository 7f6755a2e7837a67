//! `atomesh mesh`: from an image to a mesh that follows it.

use std::fmt::Write;
use std::path::PathBuf;
use std::time::Duration;

use atomesh::measure::ShapeReport;
use atomesh::mesh::PolyReport;
use atomesh_job::files::shown;
use atomesh_job::mesh::{Expectation, MeshFileOptions, MeshSummary, expect, mesh_file};
use atomesh_job::options::RunConfig;
use atomesh_job::{JobError, Session, memory};

use super::standard_output::StandardOutput;
use crate::progress::Progress;
use crate::words::seconds;

/// Turn an image into a mesh that follows it
///
/// The image becomes a potential that attracts atoms, -1 in features and 0 elsewhere. Atoms fill the
/// box of the image about a nominal distance apart, move to lower their energy, and are connected by
/// Delaunay's rule: triangles from a flat image, tetrahedra from a volume.
///
/// Lengths are in lattice units, which are the world units of the image's frame (millimetres,
/// metres), or samples with --units samples. Places are in world coordinates.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES, allow_negative_numbers = true, override_usage = USAGE)]
pub struct MeshArgs {
    #[command(flatten)]
    run: RunConfig,
    #[command(flatten)]
    standard_output: StandardOutput,
    /// Take options from a file that --write-config wrote; the command line takes precedence
    #[arg(long, value_name = "TOML", help_heading = "Run")]
    config: Option<PathBuf>,
    /// Write all options, defaults too, to a file for --config
    #[arg(long, value_name = "TOML", help_heading = "Run")]
    write_config: Option<PathBuf>,
    /// Print how many atoms, and how much memory and time the mesh would take; write nothing
    #[arg(long, help_heading = "Run")]
    dry_run: bool,
}

const USAGE: &str = "\
atomesh mesh [OPTIONS] IMAGE -o MESH
       atomesh mesh [OPTIONS] --potential FILE -o MESH
       atomesh mesh [OPTIONS] --config TOML";

const EXAMPLES: &str = "\
Examples:
  Follow the dark faults of a seismic slice, edges 8 samples long:
    atomesh mesh faults.png -o faults.vtu --size 8 --picture faults-mesh.png
  Follow the outlines in a brain scan, edges 6 mm long:
    atomesh mesh t1.nii.gz -o brain.vtu --features edges --size 6
  Edges of 6 at features and 18 elsewhere, and keep the run:
    atomesh mesh faults.png -o faults.msh --size 6..18 --write-config run.toml
  Run it again with another seed:
    atomesh mesh --config run.toml --seed 1 -o other.msh
  Polygons whose edges fall on the faults, with the connections that flow needs:
    atomesh mesh faults.png -o faults.vtu --size 8 --mesh voronoi --connections faults.json
  Only the brain, up to its smooth outline, cells labelled by tissue, of second order:
    atomesh mesh t1.nii.gz -o brain.msh --features edges --size 6 --mask brain.nii.gz \
      --labels tissue.nii.gz --order 2
  Five edges in a wavelength of 2 Hz, from the velocities of a SEG-Y line:
    atomesh mesh velocity.segy -o velocity.vtu --vertical depth --frequency 2 --features none
  Raw samples with wells as fixed atoms:
    atomesh mesh cube.raw -o cube.vtu --shape 300,200,100 --dtype float32 \\
      --spacing 25,25,4 --seed-point 2500,1000,200 --seed-point 5000,4000,200";

/// Runs the command; the text is for standard output.
///
/// # Errors
/// [`JobError`] if options make no sense, a file cannot be used, or the user ends the work.
pub fn run(args: MeshArgs, progress: &mut Progress) -> Result<String, JobError> {
    let mut run = args.run;
    if let Some(path) = &args.config {
        run = run.or_file(path)?;
    }
    args.standard_output.format_any(&mut run.output.output)?;
    if args.dry_run {
        let expecting = |session: &mut Session<'_>| {
            let expected = expect(run, session)?;
            session.check_notes().map(|()| expected)
        };
        let expected = progress.job(expecting, |_, _| String::new())?;
        return Ok(expectation(&expected));
    }
    let write_config = args.write_config.as_deref();
    let options = MeshFileOptions { write_config, measures_shape: !progress.is_quiet() };
    progress.job(|session| mesh_file(run, &options, session), summary)?;
    Ok(String::new())
}

fn summary(made: &MeshSummary, time: Duration) -> String {
    let path = shown(&made.mesh);
    let mut text = String::new();
    if let Some(tagged) = &made.tagged {
        let (features, facets) = (tagged.features, tagged.facets);
        let _ = writeln!(text, "{path}: {features} features of {facets} facets tagged");
    }
    let figures = &made.figures;
    let figures = if let Some(shape) = &figures.voronoi {
        let recall = figures.voronoi_alignment.as_ref().and_then(|a| a.recall);
        voronoi_figures(shape, recall, made.cells)
    } else if let Some(shape) = &figures.shape {
        simplex_figures(shape, made.cells)
    } else {
        return text;
    };
    text + &format!("{path}: {figures}; {}", seconds(time))
}

fn voronoi_figures(shape: &PolyReport, recall: Option<f64>, cells: &str) -> String {
    let followed = match recall {
        Some(recall) => format!("; {:.0} % of features followed", 100.0 * recall),
        None => String::new(),
    };
    format!(
        "{} {cells}, {} faces; {:.1} faces a cell; volume error {:.1e}{followed}",
        shape.cells, shape.faces, shape.faces_per_cell_mean, shape.volume_error,
    )
}

fn simplex_figures(shape: &ShapeReport, cells: &str) -> String {
    format!(
        "{} points, {} {cells}; quality mean {:.3}, least {:.3}; least angle {:.1}°",
        shape.points, shape.cells, shape.q_mean, shape.q_min, shape.angle_min,
    )
}

fn expectation(expected: &Expectation) -> String {
    format!(
        "atoms  about {}\ncells  about {} {}\nmemory about {}\ntime   about {:.1} s\n",
        expected.estimate.atoms,
        expected.cell_count,
        expected.cells,
        memory::text(expected.memory),
        expected.seconds,
    )
}
