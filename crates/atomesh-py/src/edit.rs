//! Editing atoms one by one, in world coordinates.

use std::sync::{Mutex, MutexGuard, PoisonError};

use atomesh::edit::{AtomId, Changes, EditError, Editor as CoreEditor};
use atomesh::image::{Frame, Image as CoreImage, Units};
use atomesh::lattice::Lattice;
use atomesh::mesh::ConnectError;
use atomesh::optimize::{OptimizeError, OptimizeOptions};
use atomesh::run::{Method, Prepared};
use atomesh_io::mesh::World;
use atomesh_job::mesh::refusal;
use atomesh_job::options::RunConfig;
use atomesh_job::{Dimension, JobError, Session};
use pyo3::prelude::*;
use std::sync::Arc;

use crate::mesh::{Body, Made, Mesh};
use crate::work::{How, work};
use crate::{arrays, errors};

/// An editor of either dimension. Atoms are numbered as they come: those of the mesh first.
pub trait EditorBody: Send {
    /// 2 or 3.
    fn dimension(&self) -> usize;
    /// Names and places of all atoms.
    fn atoms(&self) -> (Vec<u32>, Vec<f64>);
    /// Adds one.
    ///
    /// # Errors
    /// [`JobError`] if the place is outside or another's.
    fn add(&mut self, at: &[f64]) -> Result<u32, JobError>;
    /// Moves one.
    ///
    /// # Errors
    /// [`JobError`] as [`EditorBody::add`], or if there is no such atom, or it is pinned.
    fn move_to(&mut self, atom: u32, to: &[f64]) -> Result<(), JobError>;
    /// Removes one.
    ///
    /// # Errors
    /// [`JobError`] if there is no such atom, it is pinned, or a corner of the box.
    fn remove(&mut self, atom: u32) -> Result<(), JobError>;
    /// Pins one, or lets it go.
    ///
    /// # Errors
    /// [`JobError`] if there is no such atom.
    fn pin(&mut self, atom: u32, is_pinned: bool) -> Result<(), JobError>;
    /// Optimizes the atoms within reach of one again.
    ///
    /// # Errors
    /// [`JobError`] if there is no such atom, or the reach is not a length.
    fn relax(
        &mut self,
        atom: u32,
        reach: f64,
        session: &mut Session<'_>,
    ) -> Result<usize, JobError>;
    /// The mesh of the atoms as they are, improved.
    ///
    /// # Errors
    /// [`JobError`] if the atoms make no mesh.
    fn mesh(&self, session: &mut Session<'_>) -> Result<Box<dyn Body>, JobError>;
}

struct Held<const D: usize> {
    editor: CoreEditor<D>,
    names: Vec<AtomId>,
    prepared: Prepared<D>,
    run: RunConfig,
    image: CoreImage<D>,
    world: World,
    dimension: Dimension<D>,
}

/// An editor of the atoms of a mesh that was made, in lattice coordinates, over an image.
///
/// # Errors
/// [`JobError`] if the mesh ends within the box, or the watch ends the work.
pub fn editor<const D: usize>(
    made: &Made<D>,
    image: CoreImage<D>,
    atoms: &[[f64; D]],
    dimension: Dimension<D>,
    session: &mut Session<'_>,
) -> Result<Box<dyn EditorBody>, JobError> {
    let Made { run, outcome, world, .. } = made;
    let prepared = outcome.run().clone();
    if prepared.outline().is_some() {
        let message =
            "a mesh within a mask cannot be edited atom by atom; expected one that fills the box";
        return Err(JobError::misuse(message));
    }
    let lattice = Lattice::from_atoms(prepared.bounds(), atoms.to_vec());
    let lattice = lattice.map_err(JobError::content)?;
    let method: &Method<D> = &dimension.method;
    let editor = CoreEditor::new(lattice, *method.delaunay(), session).map_err(refused)?;
    let names = editor.atoms().map(|(name, _)| name).collect();
    Ok(Box::new(Held {
        editor,
        names,
        prepared,
        run: run.clone(),
        image,
        world: world.clone(),
        dimension,
    }))
}

fn refused(error: EditError) -> JobError {
    match error {
        EditError::Optimize(OptimizeError::Cancelled(_))
        | EditError::Connect(ConnectError::Cancelled(_)) => JobError::cancelled(),
        _ => JobError::misuse(error),
    }
}

impl<const D: usize> Held<D> {
    fn name(&self, atom: u32) -> Result<AtomId, JobError> {
        let name = self.names.get(atom as usize).copied();
        name.ok_or_else(|| JobError::misuse(format!("there is no atom {atom}")))
    }

    /// A place in lattice coordinates. What is meant to be on a side may come back a rounding from it.
    fn place(&self, at: &[f64]) -> Result<[f64; D], JobError> {
        let world = <[f64; D]>::try_from(at).map_err(|_| {
            JobError::misuse(format!("a place of {} coordinates; expected {D}", at.len()))
        })?;
        let place = self.frame().world_to_lattice(self.units(), &world);
        Ok(self.prepared.bounds().snap(&place, 0.0))
    }

    fn frame(&self) -> &Frame<D> {
        self.prepared.frame()
    }

    fn units(&self) -> Units {
        self.prepared.options().units
    }
}

impl<const D: usize> EditorBody for Held<D> {
    fn dimension(&self) -> usize {
        D
    }

    fn atoms(&self) -> (Vec<u32>, Vec<f64>) {
        let (frame, units) = (self.frame(), self.units());
        let number = |name: &AtomId| {
            self.names.binary_search(name).expect("names come in ascending order") as u32
        };
        let all = self.editor.atoms();
        let all = all.map(|(name, p)| (number(&name), frame.lattice_to_world(units, &p)));
        let (names, places): (Vec<u32>, Vec<[f64; D]>) = all.unzip();
        (names, places.into_flattened())
    }

    fn add(&mut self, at: &[f64]) -> Result<u32, JobError> {
        let place = self.place(at)?;
        let (name, _) = self.editor.add(place).map_err(refused)?;
        self.names.push(name);
        Ok(self.names.len() as u32 - 1)
    }

    fn move_to(&mut self, atom: u32, to: &[f64]) -> Result<(), JobError> {
        let (name, place) = (self.name(atom)?, self.place(to)?);
        self.editor.move_to(name, place).map(drop).map_err(refused)
    }

    fn remove(&mut self, atom: u32) -> Result<(), JobError> {
        let name = self.name(atom)?;
        self.editor.remove(name).map(drop).map_err(refused)
    }

    fn pin(&mut self, atom: u32, is_pinned: bool) -> Result<(), JobError> {
        let name = self.name(atom)?;
        let pinned = if is_pinned { self.editor.pin(name) } else { self.editor.unpin(name) };
        pinned.map_err(refused)
    }

    fn relax(
        &mut self,
        atom: u32,
        reach: f64,
        session: &mut Session<'_>,
    ) -> Result<usize, JobError> {
        let name = self.name(atom)?;
        let around = self.editor.place(name).map_err(refused)?;
        let options =
            OptimizeOptions { perturbation: 0.0, ..self.prepared.options().optimize.clone() };
        let fields = self.prepared.fields();
        let relaxed = self.editor.relax(&around, reach, fields, &options, session);
        let (_, changes): (_, Changes<D>) = relaxed.map_err(refused)?;
        Ok(changes.moves().len())
    }

    fn mesh(&self, session: &mut Session<'_>) -> Result<Box<dyn Body>, JobError> {
        let Self { prepared, run, image, world, .. } = self;
        let outcome = (|| {
            let settled = prepared.with_settled(self.editor.lattice())?;
            match run.is_voronoi() {
                true => settled.divide(session)?.finish(session),
                false => settled.connect(session)?.improve(session)?.finish(session),
            }
        })();
        let outcome = outcome.map_err(|e| refusal(run, e))?;
        let (run, image, world) = (run.clone(), image.clone(), world.clone());
        Made { run, outcome, image, world }.into_body(self.dimension.clone())
    }
}

/// Edits the atoms of a mesh one by one; the mesh follows. `Mesh.edit` makes it.
///
/// Atoms are named by integers: those of the mesh 0, 1 ... in the order of its points (of Voronoi cells: of their sites),
/// added ones after them. Places are world coordinates, x first.
///
/// Examples
/// --------
/// >>> import numpy as np, atomesh as am
/// >>> ed = am.mesh(np.zeros((40, 60)), size=8).edit()
/// >>> well = ed.add((30.2, 20.1))
/// >>> ed.move(well, (31.0, 20.0)); ed.pin(well)
/// >>> ed.relax(well, reach=20) > 0
/// True
/// >>> mesh = ed.mesh()
/// >>> bool((abs(mesh.points - (31.0, 20.0)).sum(axis=1) < 1e-9).any())
/// True
#[pyclass(frozen, module = "atomesh")]
pub struct Editor {
    body: Arc<Mutex<Box<dyn EditorBody>>>,
}

/// The editor, whoever else had it.
fn own(body: &Mutex<Box<dyn EditorBody>>) -> MutexGuard<'_, Box<dyn EditorBody>> {
    body.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Editor {
    /// An editor for Python.
    pub fn new(body: Box<dyn EditorBody>) -> Self {
        Self { body: Arc::new(Mutex::new(body)) }
    }

    /// Does what takes no time.
    fn at_once<T: Send>(
        &self,
        py: Python<'_>,
        edit: impl FnOnce(&mut dyn EditorBody) -> Result<T, JobError> + Send,
    ) -> PyResult<T> {
        let done = py.detach(|| edit(&mut **own(&self.body)));
        done.map_err(|error| errors::raise(py, &error))
    }
}

#[pymethods]
impl Editor {
    /// The names of the atoms, shape (n,), uint32, and their places, shape (n, D), float64.
    #[getter]
    fn atoms<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
        let (names, places, axes) = self.at_once(py, |body| {
            let (names, places) = body.atoms();
            Ok((names, places, body.dimension()))
        })?;
        let places = arrays::rows(py, places, axes)?;
        Ok((numpy::PyArray1::from_vec(py, names).into_any(), places))
    }

    /// The atom nearest to a place.
    ///
    /// Parameters
    /// ----------
    /// at : sequence of float
    ///     World coordinates.
    ///
    /// Returns
    /// -------
    /// int
    fn nearest(&self, py: Python<'_>, at: &Bound<'_, PyAny>) -> PyResult<u32> {
        let at = arrays::numbers(at)?;
        self.at_once(py, |body| {
            let (names, places) = body.atoms();
            let axes = body.dimension();
            if at.len() != axes {
                let message = format!("a place of {} coordinates; expected {axes}", at.len());
                return Err(JobError::misuse(message));
            }
            let far = |p: &[f64]| p.iter().zip(&at).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
            let all = names.iter().zip(places.chunks_exact(axes));
            let nearest = all.min_by(|a, b| far(a.1).total_cmp(&far(b.1)));
            Ok(*nearest.expect("an editor has the corners of the box").0)
        })
    }

    /// Adds an atom and gives its name; on a side of the box it stays there.
    ///
    /// Parameters
    /// ----------
    /// at : sequence of float
    ///     World coordinates.
    ///
    /// Returns
    /// -------
    /// int
    fn add(&self, py: Python<'_>, at: &Bound<'_, PyAny>) -> PyResult<u32> {
        let at = arrays::numbers(at)?;
        self.at_once(py, |body| body.add(&at))
    }

    /// Moves an atom to a place.
    ///
    /// Parameters
    /// ----------
    /// atom : int
    ///     Its name.
    /// to : sequence of float
    ///     World coordinates.
    #[pyo3(name = "move")]
    fn move_to(&self, py: Python<'_>, atom: u32, to: &Bound<'_, PyAny>) -> PyResult<()> {
        let to = arrays::numbers(to)?;
        self.at_once(py, |body| body.move_to(atom, &to))
    }

    /// Removes an atom.
    ///
    /// Parameters
    /// ----------
    /// atom : int
    ///     Its name.
    fn remove(&self, py: Python<'_>, atom: u32) -> PyResult<()> {
        self.at_once(py, |body| body.remove(atom))
    }

    /// Pins an atom: until `unpin` it is neither moved nor removed.
    ///
    /// Parameters
    /// ----------
    /// atom : int
    ///     Its name.
    fn pin(&self, py: Python<'_>, atom: u32) -> PyResult<()> {
        self.at_once(py, |body| body.pin(atom, true))
    }

    /// Lets a pinned atom go.
    ///
    /// Parameters
    /// ----------
    /// atom : int
    ///     Its name.
    fn unpin(&self, py: Python<'_>, atom: u32) -> PyResult<()> {
        self.at_once(py, |body| body.pin(atom, false))
    }

    /// Optimizes the atoms around one again, less and less up to `reach`.
    ///
    /// Parameters
    /// ----------
    /// atom : int
    ///     Its name.
    /// reach : float
    ///     How far, in lattice units.
    ///
    /// Returns
    /// -------
    /// int
    ///     How many atoms moved.
    fn relax(&self, py: Python<'_>, atom: u32, reach: f64) -> PyResult<usize> {
        let body = Arc::clone(&self.body);
        let job = move |session: &mut Session<'_>| own(&body).relax(atom, reach, session);
        Ok(work(py, &How::default(), job)?.0)
    }

    /// The mesh of the atoms as they are, improved as the options of the mesh ask.
    ///
    /// Returns
    /// -------
    /// Mesh
    fn mesh(&self, py: Python<'_>) -> PyResult<Mesh> {
        let body = Arc::clone(&self.body);
        let job = move |session: &mut Session<'_>| own(&body).mesh(session);
        let (body, notes) = work(py, &How::default(), job)?;
        Mesh::new(py, body, notes)
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let count = self.at_once(py, |body| Ok(body.atoms().0.len()))?;
        Ok(format!("Editor({count} atoms)"))
    }
}
