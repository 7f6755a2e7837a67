//! What is measured of a mesh, and the report that it makes.

use std::path::Path;

use atomesh::image::Image;
use atomesh::measure::{AlignmentReport, ShapeReport};
use atomesh::mesh::PolyReport;
use atomesh::run::{MeshReport, Outcome, RunError, Tools, VoronoiReport};
use atomesh_draw::Style;
use serde_json::{Map, Value, json};

use super::refusal::refusal;
use crate::dimension::Dimension;
use crate::error::JobError;
use crate::memory;
use crate::options::RunConfig;
use crate::page::{PageParts, Shown, caption, option_rows, write_page};
use crate::session::Session;

/// What was measured of a mesh.
#[derive(Clone, Debug, Default)]
pub struct Figures {
    /// The shape of triangles or tetrahedra.
    pub shape: Option<ShapeReport>,
    /// Shape, alignment and fidelity of triangles or tetrahedra.
    pub report: Option<MeshReport>,
    /// The shape of Voronoi cells.
    pub voronoi: Option<PolyReport>,
    /// How their faces follow features.
    pub voronoi_alignment: Option<AlignmentReport>,
}

/// How much is measured.
#[derive(Clone, Copy, Debug)]
pub enum Measured<'a, const D: usize> {
    /// Nothing.
    Nothing,
    /// The shape of the cells.
    Shape,
    /// All, also against the features and this image.
    All(&'a Image<D>),
}

impl Figures {
    /// Measures a mesh.
    ///
    /// # Errors
    /// [`JobError`] if it cannot be measured, or the watch ends the work.
    pub fn new<const D: usize>(
        run: &RunConfig,
        outcome: &Outcome<D>,
        measured: Measured<'_, D>,
        tools: &Tools<D>,
        session: &mut Session<'_>,
    ) -> Result<Self, JobError> {
        let found = match outcome.cells() {
            Some(_) => Self::of_voronoi(outcome, measured, tools, session),
            None => Self::of_simplices(outcome, measured, tools, session),
        };
        found.map_err(|e| refusal(run, e))
    }

    fn of_simplices<const D: usize>(
        outcome: &Outcome<D>,
        measured: Measured<'_, D>,
        tools: &Tools<D>,
        session: &mut Session<'_>,
    ) -> Result<Self, RunError> {
        match measured {
            Measured::Nothing => Ok(Self::default()),
            Measured::Shape => {
                let bounds = outcome.bounds();
                let shape = (tools.shape)(outcome.mesh(), bounds.as_ref(), session);
                Ok(Self { shape: Some(shape.map_err(RunError::Measure)?), ..Self::default() })
            }
            Measured::All(image) => {
                let mut report = outcome.report(session)?;
                report.fidelity = Some(outcome.fidelity(image.samples(), session)?);
                let shape = Some(report.shape.clone());
                Ok(Self { shape, report: Some(report), ..Self::default() })
            }
        }
    }

    fn of_voronoi<const D: usize>(
        outcome: &Outcome<D>,
        measured: Measured<'_, D>,
        tools: &Tools<D>,
        session: &mut Session<'_>,
    ) -> Result<Self, RunError> {
        let (voronoi, voronoi_alignment) = match measured {
            Measured::Nothing => (None, None),
            Measured::Shape => {
                let bounds = outcome.potential().grid().bounds();
                (outcome.cells().map(|cells| (tools.cells_shape)(cells, &bounds)), None)
            }
            Measured::All(_) => {
                let report = outcome.cells_report(session)?;
                report.map(|VoronoiReport { shape, alignment, .. }| (shape, alignment)).unzip()
            }
        };
        Ok(Self { voronoi, voronoi_alignment, ..Self::default() })
    }

    /// The report as JSON: the mesh's figures, then the run's.
    pub fn json<const D: usize>(
        &self,
        run: &RunConfig,
        outcome: &Outcome<D>,
        session: &Session<'_>,
    ) -> Value {
        let (frame, distance) = (outcome.frame(), outcome.distance());
        let seconds: Map<_, _> = (session.times().iter())
            .map(|(phase, time)| (phase.name().to_owned(), json!(time.as_secs_f64())))
            .collect();
        let warnings: Vec<_> = outcome.warnings().iter().map(ToString::to_string).collect();
        let report = self.report.as_ref();
        let shape = match &self.voronoi {
            Some(shape) => json!(shape),
            None => json!(report.map(|r| &r.shape)),
        };
        let alignment = match &self.voronoi_alignment {
            Some(alignment) => json!(alignment),
            None => json!(report.map(|r| &r.alignment)),
        };
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
            "shape": shape,
            "alignment": alignment,
            "features": report.map(|r| &r.features),
            "conformity": report.map(|r| &r.conformity),
            "spread": report.map(|r| &r.spread),
            "fidelity": report.map(|r| &r.fidelity),
            "optimizer": outcome.optimize_report(),
            "improve": outcome.improve_report(),
            "mirror": outcome.mirror_report(),
            "seconds": seconds,
            "seconds_total": session.elapsed().as_secs_f64(),
            "memory_peak_bytes": memory::peak(),
            "threads": rayon::current_num_threads(),
            "warnings": warnings,
            "notes": session.notes_json(),
            "options": run.clone().with_defaults::<D>().in_words(),
        })
    }
}

/// A run that is shown as a page.
pub(super) struct RunPage<'a, const D: usize> {
    pub run: &'a RunConfig,
    pub outcome: &'a Outcome<D>,
    pub image: &'a Image<D>,
    pub report: &'a MeshReport,
    pub style: Style,
}

impl<const D: usize> RunPage<'_, D> {
    /// Writes the page, with the mesh drawn over its image.
    pub fn write(
        &self,
        path: &Path,
        mesh: &Path,
        dimension: &Dimension<D>,
        session: &Session<'_>,
    ) -> Result<(), JobError> {
        let shape = self.outcome.frame().shape().map(|n| n.to_string()).join(" × ");
        let options = serde_json::to_value(self.run.clone().with_defaults::<D>().in_words());
        let parts = PageParts {
            mesh,
            subtitle: format!(
                "{} over an image of {shape} samples; atomesh {}",
                dimension.cells,
                env!("CARGO_PKG_VERSION")
            ),
            caption: caption::<D>(self.run.input.shown().unwrap_or(mesh)),
            tables: vec![
                ("Options".into(), option_rows(&options.unwrap_or_default())),
                ("Run".into(), effort(session)),
            ],
            notes: session.notes_in_words(),
        };
        let mesh = self.outcome.sample_mesh();
        let shown = Shown { image: self.image, mesh: &mesh, style: &self.style };
        write_page(path, parts, self.report, &shown, dimension)
    }
}

/// Times and memory as rows.
fn effort(session: &Session<'_>) -> Vec<(String, String)> {
    let time = |seconds: f64| format!("{seconds:.3} s");
    let times = session.times().iter();
    let mut rows: Vec<_> =
        times.map(|(phase, t)| (phase.name().to_owned(), time(t.as_secs_f64()))).collect();
    rows.push(("in all".into(), time(session.elapsed().as_secs_f64())));
    if let Some(bytes) = memory::peak() {
        rows.push(("memory, at most".into(), memory::text(bytes)));
    }
    rows
}
