//! Flow through a mesh.

use std::path::PathBuf;
use std::sync::Arc;

use atomesh::watch::Phase;
use atomesh_draw::PictureFormat;
use atomesh_io::mesh::OwnedField;
use atomesh_job::flow::{
    FlowAnswer, FlowMesh, FlowOptions, FlowOutputOptions, FlowPictureOptions, flow_on,
};
use atomesh_job::mesh::refusal;
use atomesh_job::options::FrameOptions;
use atomesh_job::sample::Property;
use atomesh_job::{Dimension, JobError, Session};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyString};
use serde_json::{Value, json};

use crate::mesh::Made;
use crate::options::{Wishes, unknown};
use crate::work::{How, work};
use crate::{arrays, errors, json as python_json};

/// The name of a permeability that is given as an array.
const GIVEN: &str = "permeability";

/// The names of the keywords of `Mesh.flow`.
const KEYWORDS: [&str; 13] = [
    "sources",
    "sinks",
    "sides",
    "k",
    "barriers",
    "multiplier",
    "order",
    "porosity",
    "solver",
    "solver_tolerance",
    "progress",
    "threads",
    "strict",
];

/// The keywords of `Mesh.flow`.
pub struct Keywords<'a, 'py> {
    pub sources: Option<&'a Bound<'py, PyAny>>,
    pub sinks: Option<&'a Bound<'py, PyAny>>,
    pub sides: Option<&'a Bound<'py, PyAny>>,
    pub k: Option<&'a Bound<'py, PyAny>>,
    pub barriers: Option<&'a Bound<'py, PyAny>>,
    pub multiplier: f64,
    pub options: Option<&'a Bound<'py, PyDict>>,
}

impl Keywords<'_, '_> {
    /// What is asked, values of the cells that it needs, and how it is computed. `cell_count` tells a value for each cell
    /// from one for each axis.
    ///
    /// # Errors
    /// `TypeError` and `InputError` as of all keywords.
    pub fn take(
        self,
        py: Python<'_>,
        cell_count: usize,
    ) -> PyResult<(FlowOptions, Vec<Property>, How)> {
        let mut flow = FlowOptions { multiplier: self.multiplier, ..Default::default() };
        if !(0.0..=1.0).contains(&self.multiplier) {
            let message = format!("multiplier={}; expected 0 to 1", self.multiplier);
            return Err(errors::input(py, message));
        }
        let parsed = |name: &str, e: String| errors::input(py, format!("{name}: {e}"));
        for (name, given, wells) in
            [("sources", self.sources, &mut flow.source), ("sinks", self.sinks, &mut flow.sink)]
        {
            for well in given.into_iter().filter(|given| !given.is_none()) {
                for well in well.try_iter()? {
                    let text = well_text(&well?)?;
                    wells.push(text.parse().map_err(|e| parsed(name, e))?);
                }
            }
        }
        if let Some(sides) = self.sides.filter(|given| !given.is_none()) {
            for (name, value) in sides.cast::<PyDict>()? {
                let text = match value.extract::<(String, f64)>() {
                    Ok((kind, value)) => format!("{name}={kind}:{value}"),
                    Err(_) => format!("{name}=pressure:{}", value.extract::<f64>()?),
                };
                flow.side.push(text.parse().map_err(|e| parsed("sides", e))?);
            }
        }
        if let Some(barriers) = self.barriers.filter(|given| !given.is_none()) {
            for (name, share) in barriers.cast::<PyDict>()? {
                let text = format!("{name}={}", share.extract::<f64>()?);
                flow.barrier.push(text.parse().map_err(|e| parsed("barriers", e))?);
            }
        }
        let mut own = Vec::new();
        if let Some(k) = self.k.filter(|given| !given.is_none()) {
            if k.is_instance_of::<PyString>() {
                flow.permeability = k.extract()?;
            } else {
                let numbers = arrays::numbers(k)?;
                if numbers.len() == cell_count && cell_count > 6 {
                    flow.permeability = GIVEN.into();
                    own.push(Property::new(GIVEN.into(), numbers));
                } else {
                    let texts: Vec<String> = numbers.iter().map(f64::to_string).collect();
                    flow.permeability = texts.join(",");
                }
            }
        }
        let how = self.rest(py, &mut flow)?;
        Ok((flow, own, how))
    }

    /// Takes the keywords that are no arguments.
    fn rest(&self, py: Python<'_>, flow: &mut FlowOptions) -> PyResult<How> {
        let work = PyDict::new(py);
        for (key, value) in self.options.into_iter().flatten() {
            match key.extract::<String>()?.as_str() {
                "order" => flow.order = Some(value.extract()?),
                "porosity" => flow.porosity = value.extract()?,
                "solver" => {
                    let name = Value::String(value.extract()?);
                    flow.solver = serde_json::from_value(name)
                        .map_err(|e| errors::input(py, format!("solver: {e}")))?;
                }
                "solver_tolerance" => flow.solver_tolerance = value.extract()?,
                "progress" | "threads" | "strict" => work.set_item(key, value)?,
                other => {
                    return Err(unknown(py, "flow", other, KEYWORDS.to_vec()));
                }
            }
        }
        Ok(Wishes::take("flow", Some(&work), &[])?.how)
    }
}

/// A well as the command spells it.
fn well_text(well: &Bound<'_, PyAny>) -> PyResult<String> {
    let place = |place: &Bound<'_, PyAny>| -> PyResult<String> {
        let texts: Vec<String> = arrays::numbers(place)?.iter().map(f64::to_string).collect();
        Ok(texts.join(","))
    };
    let Ok(parts) = well.cast::<PyDict>() else { return place(well) };
    let Some(at) = parts.get_item("at")? else {
        return Err(PyTypeError::new_err("a well without \"at\", its place"));
    };
    let mut text = place(&at)?;
    for (key, value) in parts {
        let key: String = key.extract()?;
        match key.as_str() {
            "at" => {}
            "rate" | "pressure" | "radius" => {
                text += &format!(":{key}={}", value.extract::<f64>()?);
            }
            other => {
                let message = format!(
                    "a well has no {other:?}; it has \"at\", \"rate\", \"pressure\", \"radius\""
                );
                return Err(PyTypeError::new_err(message));
            }
        }
    }
    Ok(text)
}

/// A mesh through which something is to flow.
pub struct Flowing<'a, const D: usize> {
    pub mesh: FlowMesh<D>,
    pub made: Option<&'a Made<D>>,
    pub fields: Vec<Property>,
}

/// Solves, and keeps the answer.
///
/// # Errors
/// [`JobError`] if the problem has no answer, memory does not suffice, or the watch ends the work.
pub fn solved<const D: usize>(
    flowing: Flowing<'_, D>,
    options: &FlowOptions,
    dimension: Dimension<D>,
    session: &mut Session<'_>,
) -> Result<Box<dyn FlowBody>, JobError> {
    let Flowing { mut mesh, made, fields } = flowing;
    if let Some(Made { run, outcome, image, .. }) = made {
        mesh.image = Some(image.clone());
        mesh.units = outcome.units();
        if options.multiplier < 1.0 {
            mesh.across = outcome.across_features(session).map_err(|e| refusal(run, e))?;
        }
    }
    let field = |field: Property| {
        let name = field.name.clone();
        OwnedField { name, values: field.into_values() }
    };
    mesh.cell_fields = fields.into_iter().map(field).collect();
    let answer = flow_on(mesh, options, &FrameOptions::default(), &dimension, session)?;
    Ok(Box::new(Answer { answer, dimension }))
}

/// An answer of either dimension.
pub trait FlowBody: Send + Sync {
    /// 2 or 3.
    fn dimension(&self) -> usize;
    /// The mean pressure of each cell.
    fn pressure(&self) -> &[f64];
    /// The mean velocity of each cell.
    fn velocity(&self) -> &[f64];
    /// What flows through each facet.
    fn fluxes(&self) -> &[f64];
    /// The cells of each facet, its area, its centroid and its group.
    fn facets(&self) -> Facets;
    /// What flows in and out, wells, and how it was solved.
    fn report(&self) -> Value;
    /// Streamlines.
    ///
    /// # Errors
    /// [`JobError`] if the watch ends the work.
    fn streamlines(&self, count: usize, session: &mut Session<'_>) -> Result<Vec<Line>, JobError>;
    /// Writes files.
    ///
    /// # Errors
    /// [`JobError`] if one cannot be written.
    fn write(&self, options: &FlowOutputOptions, session: &mut Session<'_>)
    -> Result<(), JobError>;
    /// A PNG.
    ///
    /// # Errors
    /// [`JobError`] if it cannot be drawn.
    fn picture(
        &self,
        shows_pressure: bool,
        lines: usize,
        max_side: f64,
        session: &mut Session<'_>,
    ) -> Result<Vec<u8>, JobError>;
}

/// The facets that fluxes are through.
pub struct Facets {
    /// The cell that each flux leaves, and the one that it enters or −1.
    pub cells: Vec<i64>,
    /// The area of each as a vector, out of the first cell.
    pub areas: Vec<f64>,
    pub centroids: Vec<f64>,
    /// The name of each facet's group, or nothing.
    pub groups: Vec<String>,
}

/// A streamline's points and times.
pub struct Line {
    dimension: usize,
    points: Vec<f64>,
    times: Vec<f64>,
    from: Option<usize>,
    to: Option<usize>,
}

struct Answer<const D: usize> {
    answer: FlowAnswer<D>,
    dimension: Dimension<D>,
}

impl<const D: usize> FlowBody for Answer<D> {
    fn dimension(&self) -> usize {
        D
    }

    fn pressure(&self) -> &[f64] {
        &self.answer.solution.pressures
    }

    fn velocity(&self) -> &[f64] {
        self.answer.velocities.as_flattened()
    }

    fn fluxes(&self) -> &[f64] {
        &self.answer.solution.fluxes
    }

    fn facets(&self) -> Facets {
        let grid = &self.answer.grid;
        let mut groups = vec![String::new(); grid.facets().len()];
        for set in grid.sets() {
            set.facets.iter().for_each(|&facet| groups[facet as usize].clone_from(&set.name));
        }
        let facets = grid.facets();
        let cells = |facet: &atomesh_flow::FlowFacet<D>| {
            [i64::from(facet.cell), facet.neighbour.map_or(-1, i64::from)]
        };
        Facets {
            cells: facets.iter().flat_map(cells).collect(),
            areas: facets.iter().flat_map(|facet| facet.area).collect(),
            centroids: facets.iter().flat_map(|facet| facet.centroid).collect(),
            groups,
        }
    }

    fn report(&self) -> Value {
        let Answer { answer, dimension } = self;
        let balance = answer.balance(&dimension.flow);
        json!({
            "scheme": answer.scheme(),
            "balance": balance,
            "relative_error": balance.relative_error(),
            "wells": answer.solution.wells,
            "pinned": answer.solution.pinned,
            "not_met": answer.leak,
            "solver": answer.solution.solve,
        })
    }

    fn streamlines(&self, count: usize, session: &mut Session<'_>) -> Result<Vec<Line>, JobError> {
        let lines = self.answer.streamlines(count, &self.dimension.flow, session)?;
        let line = |line: atomesh_flow::streamlines::Streamline<D>| Line {
            dimension: D,
            points: line.points.into_flattened(),
            times: line.times,
            from: line.from,
            to: line.to,
        };
        Ok(lines.into_iter().map(line).collect())
    }

    fn write(
        &self,
        options: &FlowOutputOptions,
        session: &mut Session<'_>,
    ) -> Result<(), JobError> {
        self.answer.write(options, &self.dimension, session)
    }

    fn picture(
        &self,
        shows_pressure: bool,
        lines: usize,
        max_side: f64,
        session: &mut Session<'_>,
    ) -> Result<Vec<u8>, JobError> {
        let traced = match lines {
            0 => Vec::new(),
            count => self.answer.streamlines(count, &self.dimension.flow, session)?,
        };
        session.begin(Phase::Draw);
        let shown = FlowPictureOptions { shows_pressure, lines: &traced, max_side };
        let picture = self.answer.picture(&shown, &self.dimension)?;
        picture.encode(PictureFormat::Png).map_err(JobError::content)
    }
}

/// A body that arrays may be views of.
struct Shared(Box<dyn FlowBody>);

/// What flows through a mesh: pressures, velocities, fluxes, streamlines. `Mesh.flow` gives it.
#[pyclass(frozen, module = "atomesh")]
pub struct Flow {
    shared: Arc<Shared>,
    notes: Vec<String>,
}

impl Flow {
    /// An answer.
    pub fn new(body: Box<dyn FlowBody>, notes: Vec<String>) -> Self {
        Self { shared: Arc::new(Shared(body)), notes }
    }
}

#[pymethods]
impl Flow {
    /// The mean pressure of each cell, shape (m,), float64; of Voronoi cells that at the site.
    #[getter]
    fn pressure<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let shape = [self.shared.0.pressure().len()];
        Ok(arrays::view(py, &self.shared, |s| s.0.pressure(), &shape)?.into_any())
    }

    /// The mean velocity of each cell, shape (m, D), float64.
    #[getter]
    fn velocity<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let axes = self.shared.0.dimension();
        let shape = [self.shared.0.velocity().len() / axes, axes];
        Ok(arrays::view(py, &self.shared, |s| s.0.velocity(), &shape)?.into_any())
    }

    /// What flows through each facet per unit of time, out of the first of its `facets["cells"]`, shape (f,), float64.
    #[getter]
    fn fluxes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let shape = [self.shared.0.fluxes().len()];
        Ok(arrays::view(py, &self.shared, |s| s.0.fluxes(), &shape)?.into_any())
    }

    /// The facets of `fluxes`: "cells" (f, 2), the second -1 on the boundary; "area" (f, D), as vectors out of the first; "centroid" (f, D); "group", the
    /// name of the group that each belongs to, or "".
    #[getter]
    fn facets<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let Facets { cells, areas, centroids, groups } = self.shared.0.facets();
        let table = PyDict::new(py);
        let axes = self.shared.0.dimension();
        table.set_item("cells", arrays::rows(py, cells, 2)?)?;
        table.set_item("area", arrays::rows(py, areas, axes)?)?;
        table.set_item("centroid", arrays::rows(py, centroids, axes)?)?;
        table.set_item("group", groups)?;
        Ok(table)
    }

    /// What flows in and out, and how exactly that adds up: "wells_in", "wells_out", "boundary_in", "boundary_out",
    /// "source", "error", "cell_error", "scale".
    #[getter]
    fn balance<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        python_json::to_python(py, &self.shared.0.report()["balance"])
    }

    /// Scheme, wells, balance, what was not met, and how the equations were solved.
    #[getter]
    fn report<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        python_json::to_python(py, &self.shared.0.report())
    }

    /// Warnings and what was changed or not met.
    #[getter]
    fn notes(&self) -> Vec<String> {
        self.notes.clone()
    }

    /// Lines along which the fluid flows, shared among sources by their rates.
    ///
    /// Parameters
    /// ----------
    /// count : int
    ///     How many. Default 60.
    ///
    /// Returns
    /// -------
    /// list of Streamline
    #[pyo3(signature = (count = 60))]
    fn streamlines(&self, py: Python<'_>, count: usize) -> PyResult<Vec<Streamline>> {
        let shared = Arc::clone(&self.shared);
        let job = move |session: &mut Session<'_>| shared.0.streamlines(count, session);
        let (lines, _) = work(py, &Default::default(), job)?;
        Ok(lines.into_iter().map(|line| Streamline { line: Arc::new(line) }).collect())
    }

    /// Writes the mesh with pressure, velocity, permeability and time of flight, and more where it is named.
    ///
    /// Parameters
    /// ----------
    /// path : path-like, optional
    ///     .vtu; triangles and tetrahedra also .msh .msh2 .vtk .npz.
    /// pressure_output, streamlines, fluxes, report, picture : path-like, optional
    ///     As the command's: pressure with its jumps (.vtu), streamlines (.vtp), fluxes (.json and .csv), figures (.json),
    ///     picture (.png or .svg).
    #[pyo3(signature = (path = None, *, pressure_output = None, streamlines = None, fluxes = None, report = None, picture = None))]
    #[allow(clippy::too_many_arguments)] // keywords
    fn write(
        &self,
        py: Python<'_>,
        path: Option<PathBuf>,
        pressure_output: Option<PathBuf>,
        streamlines: Option<PathBuf>,
        fluxes: Option<PathBuf>,
        report: Option<PathBuf>,
        picture: Option<PathBuf>,
    ) -> PyResult<()> {
        let options = FlowOutputOptions {
            output: path,
            pressure_output,
            streamlines,
            fluxes,
            report,
            picture,
            ..Default::default()
        };
        let shared = Arc::clone(&self.shared);
        work(py, &Default::default(), move |session| shared.0.write(&options, session)).map(drop)
    }

    /// A picture: mesh, barriers, flow vectors, over the image or the pressure.
    ///
    /// Parameters
    /// ----------
    /// of : str
    ///     "image" (default) or "pressure".
    /// streamlines : int
    ///     How many streamlines are drawn. Default 0.
    /// max_side : float
    ///     The longest side in pixels. Default 1600.
    ///
    /// Returns
    /// -------
    /// bytes
    ///     A PNG.
    #[pyo3(signature = (of = "image", *, streamlines = 0, max_side = 1600.0))]
    fn picture<'py>(
        &self,
        py: Python<'py>,
        of: &str,
        streamlines: usize,
        max_side: f64,
    ) -> PyResult<Bound<'py, PyBytes>> {
        let shows_pressure = match of {
            "image" => false,
            "pressure" => true,
            _ => {
                let message = format!("of={of:?}; expected \"image\" or \"pressure\"");
                return Err(errors::input(py, message));
            }
        };
        let shared = Arc::clone(&self.shared);
        let (bytes, _) = work(py, &Default::default(), move |session| {
            shared.0.picture(shows_pressure, streamlines, max_side, session)
        })?;
        Ok(PyBytes::new(py, &bytes))
    }

    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("atomesh._notebook")?.call_method1("flow_html", (slf,))
    }

    fn __repr__(&self) -> String {
        let report = self.shared.0.report();
        let scale = report["balance"]["scale"].as_f64().unwrap_or(0.0);
        format!("Flow({} cells, {scale:.6} flows in)", self.shared.0.pressure().len())
    }
}

/// A line along which the fluid flows.
#[pyclass(frozen, module = "atomesh")]
pub struct Streamline {
    line: Arc<Line>,
}

#[pymethods]
impl Streamline {
    /// Its points from the start on, shape (n, D), float64.
    #[getter]
    fn points<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let shape = [self.line.times.len(), self.line.dimension];
        Ok(arrays::view(py, &self.line, |line| &line.points, &shape)?.into_any())
    }

    /// The time of flight from the start to each point, shape (n,), float64.
    #[getter]
    fn times<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let shape = [self.line.times.len()];
        Ok(arrays::view(py, &self.line, |line| &line.times, &shape)?.into_any())
    }

    /// The number of the well that it comes from, sources first; None from the boundary.
    #[getter]
    fn source(&self) -> Option<usize> {
        self.line.from
    }

    /// The number of the well that it ends at; None at the boundary.
    #[getter]
    fn sink(&self) -> Option<usize> {
        self.line.to
    }

    fn __repr__(&self) -> String {
        let time = self.line.times.last().copied().unwrap_or(0.0);
        format!("Streamline({} points, time of flight {time:.6})", self.line.times.len())
    }
}
