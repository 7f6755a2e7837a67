//! Stages of a run: a lattice of atoms, its optimisation step by step, and what connects it.

pub mod steps;

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use atomesh::image::Image as CoreImage;
use atomesh::lattice::Lattice as CoreLattice;
use atomesh::run::{Connected as CoreConnected, Filled, Prepared, RunError, Settled};
use atomesh::watch::Watch;
use atomesh_io::image::AnyImage;
use atomesh_job::mesh::{MeshImages, prepare, refusal};
use atomesh_job::options::RunConfig;
use atomesh_job::{Dimension, JobError, Session};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyType};

use crate::mesh::images::over;
use crate::mesh::{Body, Made, Mesh};
use crate::options::{MESH, Wishes};
use crate::source::{Opened, Shown, Source, name_fields};
use crate::work::{How, work};
use crate::{arrays, errors};
use steps::Steps;

/// How far the atoms have come.
#[derive(Clone)]
enum State<const D: usize> {
    /// They fill the box.
    Filled(Filled<D>),
    /// They were moved, and not to the end.
    Between(CoreLattice<D>),
    /// Their energy is low.
    Settled(Settled<D>),
}

/// A lattice of either dimension.
trait LatticeBody: Send {
    /// One to work on, so that nobody who looks at the atoms meanwhile has to wait for it.
    fn copy(&self) -> Box<dyn LatticeBody>;
    fn dimension(&self) -> usize;
    /// World coordinates of all atoms.
    fn atoms(&self) -> Vec<f64>;
    /// The work of moving the atoms with other options, from where they are.
    ///
    /// # Errors
    /// [`JobError`] if an option is out of range or an image is of no use.
    fn restart(
        &mut self,
        wishes: Option<Wishes>,
        session: &mut Session<'_>,
    ) -> Result<Box<dyn Moving>, JobError>;
    /// Takes atoms between two iterations; lattice coordinates.
    fn put(&mut self, coordinates: &[f64]) -> Result<(), JobError>;
    /// Takes what moving them gave.
    fn settle(&mut self, settled: Box<dyn std::any::Any + Send>);
    /// Lattice coordinates in the world.
    fn in_world(&self, coordinates: &[f64]) -> Vec<f64>;
    /// Connects the atoms.
    ///
    /// # Errors
    /// [`JobError`] if they make no mesh.
    fn connect(&self, session: &mut Session<'_>) -> Result<Box<dyn ConnectedBody>, JobError>;
}

/// Atoms that are about to be moved, apart from Python.
trait Moving: Send {
    /// Moves them to the end.
    ///
    /// # Errors
    /// [`JobError`] if the watch ends the work.
    fn run(
        self: Box<Self>,
        watch: &mut dyn Watch,
    ) -> Result<Box<dyn std::any::Any + Send>, JobError>;
}

/// Connected atoms of either dimension.
trait ConnectedBody: Send + Sync {
    fn points(&self) -> Vec<f64>;
    fn corners(&self) -> Vec<u32>;
    fn dimension(&self) -> usize;
    /// Mends cells and turns facets onto features.
    ///
    /// # Errors
    /// [`JobError`] if the watch ends the work.
    fn improve(
        &self,
        image: Option<AnyImage>,
        session: &mut Session<'_>,
    ) -> Result<Box<dyn Body>, JobError>;
}

/// What a lattice is made in.
#[derive(Clone)]
struct Parts<const D: usize> {
    images: MeshImages<D>,
    run: RunConfig,
    image: CoreImage<D>,
    prepared: Prepared<D>,
    dimension: Dimension<D>,
}

#[derive(Clone)]
struct Held<const D: usize> {
    parts: Parts<D>,
    state: State<D>,
}

struct Atoms<const D: usize> {
    filled: Filled<D>,
    run: RunConfig,
}

impl<const D: usize> Moving for Atoms<D> {
    fn run(
        self: Box<Self>,
        watch: &mut dyn Watch,
    ) -> Result<Box<dyn std::any::Any + Send>, JobError> {
        let Atoms { filled, run } = *self;
        let settled = filled.settle(watch).map_err(|e| refusal(&run, e))?;
        Ok(Box::new(settled))
    }
}

impl<const D: usize> Held<D> {
    fn lattice(&self) -> &CoreLattice<D> {
        match &self.state {
            State::Filled(filled) => filled.lattice(),
            State::Between(lattice) => lattice,
            State::Settled(settled) => settled.lattice(),
        }
    }

    fn refused(&self) -> impl Fn(RunError) -> JobError + '_ {
        |error| refusal(&self.parts.run, error)
    }
}

impl<const D: usize> LatticeBody for Held<D> {
    fn copy(&self) -> Box<dyn LatticeBody> {
        Box::new(self.clone())
    }

    fn dimension(&self) -> usize {
        D
    }

    fn atoms(&self) -> Vec<f64> {
        self.in_world(self.lattice().atoms().as_flattened())
    }

    fn restart(
        &mut self,
        wishes: Option<Wishes>,
        session: &mut Session<'_>,
    ) -> Result<Box<dyn Moving>, JobError> {
        if let Some(Wishes { run, fields, .. }) = wishes {
            let Parts { images, dimension, .. } = &self.parts;
            let mut images = images.clone();
            let given = Wishes::given(fields, dimension)?;
            let mut run = run;
            // a number given now replaces an image given before
            if run.lattice.beta.is_some() {
                images.weight_field = None;
            }
            if run.lattice.size.is_some() || run.lattice.frequency.is_some() {
                images.size_field = None;
            }
            images.take_given(&run, given, session)?;
            name_fields(&mut run, &images);
            let (prepared, image) = prepare(&run, images.clone(), dimension, session)?;
            self.parts.images = images;
            (self.parts.run, self.parts.image, self.parts.prepared) = (run, image, prepared);
        }
        let Parts { prepared, run, .. } = &self.parts;
        let filled = prepared.with_atoms(self.lattice().clone()).map_err(self.refused())?;
        Ok(Box::new(Atoms { filled, run: run.clone() }))
    }

    fn put(&mut self, coordinates: &[f64]) -> Result<(), JobError> {
        let atoms = coordinates.as_chunks::<D>().0.to_vec();
        let lattice = CoreLattice::from_atoms(self.parts.prepared.bounds(), atoms);
        self.state = State::Between(lattice.map_err(JobError::content)?);
        Ok(())
    }

    fn settle(&mut self, settled: Box<dyn std::any::Any + Send>) {
        if let Ok(settled) = settled.downcast::<Settled<D>>() {
            self.state = State::Settled(*settled);
        }
    }

    fn in_world(&self, coordinates: &[f64]) -> Vec<f64> {
        let (frame, units) = (self.parts.prepared.frame(), self.parts.prepared.options().units);
        let places = coordinates.as_chunks::<D>().0.iter();
        places.flat_map(|p| frame.lattice_to_world(units, p)).collect()
    }

    fn connect(&self, session: &mut Session<'_>) -> Result<Box<dyn ConnectedBody>, JobError> {
        let settled = match &self.state {
            State::Settled(settled) => settled.clone(),
            _ => {
                let lattice = self.lattice().clone();
                self.parts.prepared.with_settled(lattice).map_err(self.refused())?
            }
        };
        let connected = settled.clone().connect(session).map_err(self.refused())?;
        Ok(Box::new(Joined { parts: self.parts.clone(), settled, connected }))
    }
}

struct Joined<const D: usize> {
    parts: Parts<D>,
    settled: Settled<D>,
    connected: CoreConnected<D>,
}

impl<const D: usize> ConnectedBody for Joined<D> {
    fn points(&self) -> Vec<f64> {
        let (frame, units) = (self.parts.prepared.frame(), self.parts.prepared.options().units);
        let points = self.connected.mesh().points().iter();
        points.flat_map(|p| frame.lattice_to_world(units, p)).collect()
    }

    fn corners(&self) -> Vec<u32> {
        let mirrored = self.parts.prepared.frame().is_mirrored();
        self.connected.mesh().moved(mirrored, |p| *p).corners().to_vec()
    }

    fn dimension(&self) -> usize {
        D
    }

    fn improve(
        &self,
        image: Option<AnyImage>,
        session: &mut Session<'_>,
    ) -> Result<Box<dyn Body>, JobError> {
        let Parts { run, image: own, images, dimension, .. } = &self.parts;
        let image = over(image, own, dimension)?;
        let outcome = (|| match run.is_voronoi() {
            true => self.settled.clone().divide(session)?.finish(session),
            false => self.connected.clone().improve(session)?.finish(session),
        })();
        let outcome = outcome.map_err(|e| refusal(run, e))?;
        let world = images.world.clone();
        Made { run: run.clone(), outcome, image, world }.into_body(dimension.clone())
    }
}

type Shared = Arc<Mutex<Box<dyn LatticeBody>>>;

fn own(body: &Shared) -> MutexGuard<'_, Box<dyn LatticeBody>> {
    body.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Starts moving the atoms again.
fn restart(
    body: &Shared,
    wishes: Option<Wishes>,
    session: &mut Session<'_>,
) -> Result<Box<dyn Moving>, JobError> {
    let mut copy = own(body).copy();
    let moving = copy.restart(wishes, session)?;
    *own(body) = copy;
    Ok(moving)
}

/// A lattice of atoms in the box of an image: what is moved by `optimize` and joined by `connect`.
///
/// `lattice` grows one; `Lattice.of` takes one's own atoms.
///
/// Examples
/// --------
/// >>> import numpy as np, atomesh as am
/// >>> img = np.full((60, 80), 200, np.uint8); img[30, :] = 10
/// >>> lat = am.lattice(img, distance=8)
/// >>> energies = [step.energy for step in lat.optimize()]
/// >>> energies[-1] < energies[0]
/// True
/// >>> mesh = lat.connect().improve()
#[pyclass(frozen, module = "atomesh")]
pub struct Lattice {
    body: Shared,
    wishes: Mutex<RunConfig>,
    notes: Vec<String>,
}

#[pymethods]
impl Lattice {
    /// A lattice of one's own atoms.
    ///
    /// Parameters
    /// ----------
    /// points : array_like, shape (n, D)
    ///     World coordinates, x first. One must be at each corner of the image's box; those on its sides stay on them.
    /// image : Image, array or path-like
    ///     The image.
    /// **options
    ///     As of `mesh`. `size` is the distance at which atoms neither attract nor repel each other: give it as the points
    ///     have it; its default is for the image, whatever the points are.
    ///
    /// Returns
    /// -------
    /// Lattice
    #[classmethod]
    #[pyo3(signature = (points, image, **options))]
    fn of(
        _: &Bound<'_, PyType>,
        py: Python<'_>,
        points: &Bound<'_, PyAny>,
        image: &Bound<'_, PyAny>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let axes: usize = points
            .py()
            .import("numpy")?
            .call_method1("shape", (points,))?
            .get_item(1)
            .and_then(|axes| axes.extract())
            .map_err(|_| errors::input(py, "points of another shape than (n, D)"))?;
        let own = match axes {
            2 => Own::Flat(arrays::points(points)?),
            _ => Own::Volume(arrays::points(points)?),
        };
        made(py, "Lattice.of", image, options, Some(own))
    }

    /// World coordinates of the atoms, shape (n, D), float64.
    #[getter]
    fn atoms<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let (atoms, axes) = {
            let body = own(&self.body);
            (body.atoms(), body.dimension())
        };
        arrays::rows(py, atoms, axes)
    }

    /// Warnings and what was changed or not met.
    #[getter]
    fn notes(&self) -> Vec<String> {
        self.notes.clone()
    }

    /// Moves the atoms to lower their energy (Hale 2001, algorithm 3), step by step.
    ///
    /// The work goes on only while steps are asked for: leaving the loop stops it, and the atoms stay where the last step
    /// has them.
    ///
    /// Parameters
    /// ----------
    /// potential : Image or array, optional
    ///     b(x), -1 to 1, in place of the image's features.
    /// beta : float or image, optional
    ///     Weight of the image against regularity, 0 to 1.
    /// **options
    ///     As of `mesh`: `engine`, `tolerance`, `strict` ... There is no `progress`: the loop sees each step.
    ///
    /// Returns
    /// -------
    /// iterator of Step
    #[pyo3(signature = (**options))]
    fn optimize(&self, py: Python<'_>, options: Option<&Bound<'_, PyDict>>) -> PyResult<Steps> {
        let wishes = self.wishes(options)?;
        let body = Arc::clone(&self.body);
        let (threads, strict) =
            wishes.as_ref().map_or((None, false), |all| (all.how.threads, all.how.strict));
        if wishes.as_ref().is_some_and(|all| all.how.progress.is_some()) {
            let message = "optimize() has no progress: the loop sees each step; settle() has it";
            return Err(PyTypeError::new_err(message));
        }
        let how = How { threads, strict, progress: None };
        let job = move |session: &mut Session<'_>| restart(&body, wishes, session);
        let (moving, _) = work(py, &how, job)?;
        Steps::start(py, Arc::clone(&self.body), moving, threads)
    }

    /// Moves the atoms to the end, as `optimize` without a look at the steps.
    ///
    /// Parameters
    /// ----------
    /// **options
    ///     As of `optimize`; also `progress`, `threads`.
    ///
    /// Returns
    /// -------
    /// Lattice
    ///     Itself.
    #[pyo3(signature = (**options))]
    fn settle<'py>(
        slf: &Bound<'py, Self>,
        options: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, Self>> {
        let mut wishes = slf.get().wishes(options)?;
        let how = wishes.as_mut().map(|wishes| std::mem::take(&mut wishes.how)).unwrap_or_default();
        let body = Arc::clone(&slf.get().body);
        let job = move |session: &mut Session<'_>| {
            let moving = restart(&body, wishes, session)?;
            let settled = moving.run(session)?;
            own(&body).settle(settled);
            Ok(())
        };
        work(slf.py(), &how, job)?;
        Ok(slf.clone())
    }

    /// Connects the atoms by Delaunay's rule, where they are now.
    ///
    /// Where `align` is "conform", which is the default where there are features, some atoms are added on features so that
    /// facets follow them without a gap; with `align="swaps"` or "off" the points are the atoms.
    ///
    /// Returns
    /// -------
    /// Connected
    fn connect(&self, py: Python<'_>) -> PyResult<Connected> {
        let body = Arc::clone(&self.body);
        let job = move |session: &mut Session<'_>| {
            let copy = own(&body).copy();
            copy.connect(session)
        };
        let (connected, _) = work(py, &How::default(), job)?;
        Ok(Connected { body: Arc::new(connected) })
    }

    fn __len__(&self) -> usize {
        let body = own(&self.body);
        body.atoms().len() / body.dimension()
    }

    fn __repr__(&self) -> String {
        format!("Lattice({} atoms)", self.__len__())
    }
}

impl Lattice {
    /// The options of the run with these before them; `None` if none are given.
    fn wishes(&self, options: Option<&Bound<'_, PyDict>>) -> PyResult<Option<Wishes>> {
        let Some(options) = options.filter(|options| !options.is_empty()) else { return Ok(None) };
        let mut kept = self.wishes.lock().unwrap_or_else(PoisonError::into_inner);
        let before = Wishes { run: kept.clone(), ..Wishes::default() };
        let wishes = before.with("optimize", Some(options), MESH)?;
        *kept = wishes.run.clone();
        Ok(Some(wishes))
    }
}

/// Atoms of one's own.
enum Own {
    Flat(Vec<[f64; 2]>),
    Volume(Vec<[f64; 3]>),
}

/// A lattice of atoms that fill the box of an image, about d(x) apart, not yet moved by the image.
///
/// Parameters
/// ----------
/// image : Image, array or path-like
///     The image.
/// distance : float, (float, float) or image, optional
///     d(x): as `size` of `mesh`.
/// crystal : str, optional
///     "hexagonal" (in the plane), "bcc" or "fcc" (in space), or "random". Default: "hexagonal", "bcc".
/// **options
///     As of `mesh`.
///
/// Returns
/// -------
/// Lattice
///
/// Examples
/// --------
/// >>> import numpy as np, atomesh as am
/// >>> am.lattice(np.zeros((41, 61)), distance=10).atoms.shape[1]
/// 2
#[pyfunction]
#[pyo3(signature = (image, distance = None, crystal = None, **options))]
pub fn lattice(
    py: Python<'_>,
    image: &Bound<'_, PyAny>,
    distance: Option<&Bound<'_, PyAny>>,
    crystal: Option<&str>,
    options: Option<&Bound<'_, PyDict>>,
) -> PyResult<Lattice> {
    let all = options.map_or_else(|| Ok(PyDict::new(py)), |given| given.copy())?;
    if let Some(distance) = distance {
        all.set_item("size", distance)?;
    }
    if let Some(crystal) = crystal {
        all.set_item("lattice", crystal)?;
    }
    made(py, "lattice", image, Some(&all), None)
}

fn made(
    py: Python<'_>,
    function: &str,
    image: &Bound<'_, PyAny>,
    options: Option<&Bound<'_, PyDict>>,
    atoms: Option<Own>,
) -> PyResult<Lattice> {
    let mut wishes = Wishes::take(function, options, MESH)?;
    let source = Source::take(image, &mut wishes)?;
    let Wishes { mut run, fields, how } = wishes;
    let kept = run.clone();
    let (body, notes) = work(py, &how, move |session| {
        run.check()?;
        let Opened { image, world, is_potential } = source.open(&mut run, session)?;
        match image {
            AnyImage::Flat(image) => {
                let dimension = Dimension::plane();
                let shown = Shown { image, world, is_potential, fields };
                let images = shown.placed(&mut run, &dimension, session)?;
                let atoms = match atoms {
                    None => None,
                    Some(Own::Flat(atoms)) => Some(atoms),
                    Some(Own::Volume(_)) => return Err(other_dimension(3, 2)),
                };
                held(run, images, dimension, atoms, session)
            }
            AnyImage::Volume(image) => {
                let dimension = Dimension::space();
                let shown = Shown { image, world, is_potential, fields };
                let images = shown.placed(&mut run, &dimension, session)?;
                let atoms = match atoms {
                    None => None,
                    Some(Own::Volume(atoms)) => Some(atoms),
                    Some(Own::Flat(_)) => return Err(other_dimension(2, 3)),
                };
                held(run, images, dimension, atoms, session)
            }
        }
    })?;
    Ok(Lattice { body: Arc::new(Mutex::new(body)), wishes: Mutex::new(kept), notes })
}

fn other_dimension(found: usize, expected: usize) -> JobError {
    JobError::misuse(format!("points of {found} coordinates; expected {expected}, as the image"))
}

fn held<const D: usize>(
    run: RunConfig,
    images: MeshImages<D>,
    dimension: Dimension<D>,
    atoms: Option<Vec<[f64; D]>>,
    session: &mut Session<'_>,
) -> Result<Box<dyn LatticeBody>, JobError> {
    let (prepared, image) = prepare(&run, images.clone(), &dimension, session)?;
    let refused = |error| refusal(&run, error);
    let state = match atoms {
        None => State::Filled(prepared.fill(session).map_err(refused)?),
        Some(atoms) => {
            let (frame, units) = (prepared.frame(), prepared.options().units);
            let bounds = prepared.bounds();
            let place = |p: &[f64; D]| bounds.snap(&frame.world_to_lattice(units, p), 0.0);
            let atoms: Vec<[f64; D]> = atoms.iter().map(place).collect();
            State::Between(CoreLattice::from_atoms(bounds, atoms).map_err(JobError::misuse)?)
        }
    };
    let parts = Parts { images, run, image, prepared, dimension };
    Ok(Box::new(Held { parts, state }))
}

/// Atoms connected by Delaunay's rule, before facets are turned onto features. `Lattice.connect` gives it.
#[pyclass(frozen, module = "atomesh")]
pub struct Connected {
    body: Arc<Box<dyn ConnectedBody>>,
}

#[pymethods]
impl Connected {
    /// The points, shape (n, D), float64, world coordinates.
    #[getter]
    fn points<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        arrays::rows(py, self.body.points(), self.body.dimension())
    }

    /// The numbers of the points of each cell, shape (m, D + 1), uint32.
    #[getter]
    fn cells<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        arrays::rows(py, self.body.corners(), self.body.dimension() + 1)
    }

    /// Turns facets onto features and mends badly shaped cells; of Voronoi cells: divides the box among the atoms.
    ///
    /// Parameters
    /// ----------
    /// image : Image or array, optional
    ///     What the mesh is shown over and compared with, in the same place as the lattice's own image. Default: that.
    ///
    /// Returns
    /// -------
    /// Mesh
    #[pyo3(signature = (image = None))]
    fn improve(&self, py: Python<'_>, image: Option<&Bound<'_, PyAny>>) -> PyResult<Mesh> {
        let image = Mesh::image_for(image)?;
        let body = Arc::clone(&self.body);
        let job = move |session: &mut Session<'_>| body.improve(image, session);
        let (body, notes) = work(py, &How::default(), job)?;
        Mesh::new(py, body, notes)
    }

    fn __repr__(&self) -> String {
        let cells = self.body.corners().len() / (self.body.dimension() + 1);
        format!("Connected({cells} cells)")
    }
}
