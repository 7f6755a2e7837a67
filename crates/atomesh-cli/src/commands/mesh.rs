//! `atomesh mesh`: from an image to a mesh that follows it.

use std::path::{Path, PathBuf};

use atomesh::image::Image;
use atomesh::improve::ImproveReport;
use atomesh::measure::{AlignmentReport, ShapeReport, shape};
use atomesh::mesh::PolyReport;
use atomesh::run::{MeshReport, Outcome, Prepared, RunError, VoronoiReport};
use atomesh_io::image::AnyImage;
use serde_json::json;

use crate::dimension::Dimension;
use crate::failure::Failure;
use crate::frame_options;
use crate::memory;
use crate::meshing::{Meshing, labels_alone, shown_path};
use crate::outputs::{Outputs, write_bytes};
use crate::progress::{Progress, Verbosity, writing};
use crate::report_page::{PageParts, option_rows, write_page};
use crate::run_config::RunConfig;

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
    /// Take options from a file that --write-config wrote; the command line goes before it
    #[arg(long, value_name = "TOML", help_heading = "Run")]
    config: Option<PathBuf>,
    /// Write all options, defaults too, to a file for --config
    #[arg(long, value_name = "TOML", help_heading = "Run")]
    write_config: Option<PathBuf>,
    /// Say how many atoms, and how much memory and time the mesh would take; write nothing
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
/// [`Failure`] if options make no sense, a file cannot be used, or the user ends the work.
pub fn run(args: MeshArgs, watch: &mut Progress) -> Result<String, Failure> {
    let mut run = args.run;
    if let Some(path) = &args.config {
        run = run.or_file(path)?;
    }
    labels_alone(&mut run);
    run.check()?;
    let shown = shown_path(&run)?.to_path_buf();
    let outputs = if args.dry_run { None } else { Some(Outputs::new(&run, &shown)?) };
    if let Some(outputs) = &outputs {
        let _guard = writing();
        outputs.check(&run.input, args.write_config.as_deref())?;
    }
    let image = frame_options::read(&shown, &run.frame.read_options()?, watch)?;
    let job = Job { run: &run, path: &shown, outputs, write_config: args.write_config.as_deref() };
    match image {
        AnyImage::Flat(image) => job.run(image, &Dimension::flat(), watch),
        AnyImage::Volume(image) => job.run(image, &Dimension::volume(), watch),
    }
}

/// A run whose options are known.
struct Job<'a> {
    run: &'a RunConfig,
    path: &'a Path,
    /// `None`: say what the run would take.
    outputs: Option<Outputs>,
    write_config: Option<&'a Path>,
}

impl Job<'_> {
    fn meshing(&self) -> Meshing<'_> {
        Meshing { run: self.run, path: self.path }
    }

    fn run<const D: usize>(
        &self,
        image: Image<D>,
        dimension: &Dimension<D>,
        watch: &mut Progress,
    ) -> Result<String, Failure> {
        let keep_image = self.outputs.as_ref().is_some_and(Outputs::needs_image);
        let meshing = self.meshing();
        let (prepared, image) = meshing.prepare(image, dimension, keep_image, watch)?;
        let Some(outputs) = &self.outputs else {
            return Ok(expectation(&prepared, dimension, self.run.is_voronoi()));
        };
        let outcome = prepared.run(watch).map_err(|e| meshing.failure(e))?;
        let measured = image.as_ref().filter(|_| outputs.needs_report());
        let figures = self.measure(&outcome, measured, watch)?;
        let _guard = writing();
        let options = self.run.provenance::<D>();
        outputs.write(&outcome, image.as_ref(), options, dimension, watch)?;
        if let Some(path) = self.write_config {
            write_bytes(path, self.run.clone().with_defaults::<D>().to_toml()?.as_bytes())?;
        }
        watch.finish();
        if let Some(path) = &outputs.report {
            let text = format!("{:#}\n", self.report(&outcome, &figures, watch));
            write_bytes(path, text.as_bytes())?;
        }
        if let (Some(path), Some(image)) = (&outputs.html, &image) {
            self.write_page(path, (&outcome, image), &figures, dimension, watch)?;
        }
        if let Some(shape) = &figures.cells {
            let recall = figures.cells_alignment.as_ref().and_then(|a| a.recall);
            watch.say(&cells_summary(&outputs.mesh, (shape, recall), dimension, watch));
        } else if let Some(shape) = &figures.shape {
            let (mesh, improved) = (&outputs.mesh, outcome.improve_report());
            watch.say(&summary(mesh, shape, improved, dimension, watch));
        }
        Ok(String::new())
    }

    fn measure<const D: usize>(
        &self,
        outcome: &Outcome<D>,
        image: Option<&Image<D>>,
        watch: &mut Progress,
    ) -> Result<Figures, Failure> {
        let is_quiet = watch.verbosity() == Verbosity::Quiet;
        if let Some(cells) = outcome.cells() {
            let mut figures = Figures::default();
            if image.is_some() {
                let report = outcome.cells_report(watch).map_err(|e| self.meshing().failure(e))?;
                (figures.cells, figures.cells_alignment) =
                    report.map(|VoronoiReport { shape, alignment, .. }| (shape, alignment)).unzip();
            } else if !is_quiet {
                let bounds = outcome.potential().grid().bounds();
                figures.cells = Some(PolyReport::new(cells, &bounds));
            }
            return Ok(figures);
        }
        if let Some(image) = image {
            let mut report = outcome.report(watch).map_err(|e| self.meshing().failure(e))?;
            let fidelity = outcome.fidelity(image.samples(), watch);
            report.fidelity = Some(fidelity.map_err(|e| self.meshing().failure(e))?);
            let shape = Some(report.shape.clone());
            return Ok(Figures { shape, report: Some(report), ..Figures::default() });
        }
        if is_quiet {
            return Ok(Figures::default());
        }
        let shape = shape(outcome.mesh(), outcome.bounds().as_ref(), watch);
        let shape = shape.map_err(|e| self.meshing().failure(RunError::Measure(e)))?;
        Ok(Figures { shape: Some(shape), ..Figures::default() })
    }

    /// The report as JSON: the mesh's figures, then the run's.
    fn report<const D: usize>(
        &self,
        outcome: &Outcome<D>,
        figures: &Figures,
        watch: &Progress,
    ) -> serde_json::Value {
        let frame = outcome.frame();
        let seconds: serde_json::Map<_, _> = (watch.times().iter())
            .map(|(phase, time)| (phase.name().to_owned(), json!(time.as_secs_f64())))
            .collect();
        let warnings: Vec<_> = outcome.warnings().iter().map(ToString::to_string).collect();
        let distance = outcome.distance();
        json!({
            "version": env!("CARGO_PKG_VERSION"),
            "image": {
                "shape": frame.shape().as_slice(),
                "spacing": frame.spacing().as_slice(),
                "origin": frame.origin().as_slice(),
            },
            "distance": {
                "least": distance.least(),
                "mean": distance.mean(),
                "greatest": distance.greatest(),
            },
            "shape": figures.shape_json(),
            "alignment": figures.alignment_json(),
            "spread": figures.report.as_ref().map(|r| &r.spread),
            "fidelity": figures.report.as_ref().map(|r| &r.fidelity),
            "optimizer": outcome.optimize_report(),
            "improve": outcome.improve_report(),
            "mirror": outcome.mirror_report(),
            "seconds": seconds,
            "seconds_total": watch.elapsed().as_secs_f64(),
            "memory_peak_bytes": memory::peak(),
            "threads": rayon::current_num_threads(),
            "warnings": warnings,
            "options": self.run.clone().with_defaults::<D>(),
        })
    }

    /// The report as a page, with the mesh drawn over its image.
    fn write_page<const D: usize>(
        &self,
        path: &Path,
        (outcome, image): (&Outcome<D>, &Image<D>),
        figures: &Figures,
        dimension: &Dimension<D>,
        watch: &Progress,
    ) -> Result<(), Failure> {
        let (Some(report), Some(outputs)) = (&figures.report, &self.outputs) else {
            return Ok(());
        };
        let time = |seconds: f64| format!("{seconds:.3} s");
        let times = watch.times().iter();
        let mut run: Vec<_> =
            times.map(|(phase, t)| (phase.name().to_owned(), time(t.as_secs_f64()))).collect();
        run.push(("in all".into(), time(watch.elapsed().as_secs_f64())));
        if let Some(bytes) = memory::peak() {
            run.push(("memory, at most".into(), memory::text(bytes)));
        }
        let options = serde_json::to_value(self.run.clone().with_defaults::<D>());
        let shape = outcome.frame().shape().map(|n| n.to_string()).join(" × ");
        let parts = PageParts {
            mesh: &outputs.mesh,
            subtitle: format!(
                "{} over an image of {shape} samples; atomesh {}",
                dimension.cells,
                env!("CARGO_PKG_VERSION")
            ),
            caption: caption::<D>(self.path),
            tables: vec![
                ("Options".into(), option_rows(&options.unwrap_or_default())),
                ("Run".into(), run),
            ],
            warnings: outcome.warnings().iter().map(ToString::to_string).collect(),
        };
        let (mesh, style) = (outcome.sample_mesh(), outputs.style(outcome));
        write_page(path, parts, report, (image, &mesh, &style), dimension)
    }
}

/// What was measured.
#[derive(Default)]
struct Figures {
    shape: Option<ShapeReport>,
    report: Option<MeshReport>,
    cells: Option<PolyReport>,
    cells_alignment: Option<AlignmentReport>,
}

impl Figures {
    /// The shape of what the mesh is made of.
    fn shape_json(&self) -> serde_json::Value {
        match &self.cells {
            Some(shape) => json!(shape),
            None => json!(self.report.as_ref().map(|r| &r.shape)),
        }
    }

    fn alignment_json(&self) -> serde_json::Value {
        match &self.cells_alignment {
            Some(alignment) => json!(alignment),
            None => json!(self.report.as_ref().map(|r| &r.alignment)),
        }
    }
}

fn cells_summary<const D: usize>(
    path: &Path,
    (shape, recall): (&PolyReport, Option<f64>),
    dimension: &Dimension<D>,
    watch: &Progress,
) -> String {
    let name = dimension.voronoi_cells;
    let followed = match recall {
        Some(recall) => format!("; {:.0} % of features followed", 100.0 * recall),
        None => String::new(),
    };
    format!(
        "{}: {} {name}, {} faces; {:.1} faces a cell; volume error {:.1e}{followed}; {:.2} s",
        path.display(),
        shape.cells,
        shape.faces,
        shape.faces_per_cell_mean,
        shape.volume_error,
        watch.elapsed().as_secs_f64(),
    )
}

/// What the picture of a mesh over its image shows.
pub fn caption<const D: usize>(image: &Path) -> String {
    let name = image.file_name().unwrap_or(image.as_os_str()).to_string_lossy();
    match D {
        2 => format!("The mesh over {name}"),
        _ => format!("The mesh over {name}, on the three slices through its middle"),
    }
}

fn summary<const D: usize>(
    path: &Path,
    shape: &ShapeReport,
    improved: Option<&ImproveReport>,
    dimension: &Dimension<D>,
    watch: &Progress,
) -> String {
    let below = improved.filter(|report| !report.floor_held).map_or_else(String::new, |report| {
        format!(" ({} {} below --min-angle)", report.below, dimension.cells)
    });
    format!(
        "{}: {} points, {} {}; quality mean {:.3}, least {:.3}; least angle {:.1}°{below}; {:.2} s",
        path.display(),
        shape.points,
        shape.cells,
        dimension.cells,
        shape.q_mean,
        shape.q_min,
        shape.angle_min,
        watch.elapsed().as_secs_f64(),
    )
}

/// Seconds that an atom takes from growth to mesh, for the dimension; a guide, from our own runs.
const SECONDS_PER_ATOM: [f64; 2] = [5e-5, 1.2e-5];

fn expectation<const D: usize>(
    prepared: &Prepared<D>,
    dimension: &Dimension<D>,
    is_voronoi: bool,
) -> String {
    let estimate = prepared.estimate();
    let (cells, name) = match is_voronoi {
        true => (estimate.atoms, dimension.voronoi_cells),
        false => (estimate.cells, dimension.cells),
    };
    let seconds = estimate.atoms as f64 * SECONDS_PER_ATOM[D - 2];
    format!(
        "atoms  about {}\ncells  about {} {}\nmemory about {} beside the image\ntime   about {:.1} s\n",
        estimate.atoms,
        cells,
        name,
        memory::text(estimate.memory),
        seconds.max(0.1),
    )
}
