//! The optimisation of a lattice step by step: atoms move on a thread of their own, which waits until the next step is
//! asked for.

use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};

use atomesh::watch::{AtomsView, Phase, Watch};
use atomesh_job::JobError;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;

use super::{Moving, Shared, own};
use crate::work::{TICK, own_pool};
use crate::{arrays, errors};

/// Atoms between two iterations of the optimiser.
///
/// Attributes: `number` of the step from 1, `energy` of all (without unit), `energy_atomic` and `energy_image`, the parts of
/// the pairs and of the image.
#[pyclass(frozen, module = "atomesh")]
pub struct Step {
    /// The number of the step, from 1.
    #[pyo3(get)]
    number: usize,
    /// The energy.
    #[pyo3(get)]
    energy: f64,
    /// (1 − β) A.
    #[pyo3(get)]
    energy_atomic: f64,
    /// β B.
    #[pyo3(get)]
    energy_image: f64,
    dimension: usize,
    atoms: Arc<Vec<f64>>,
}

#[pymethods]
impl Step {
    /// World coordinates of the atoms, shape (n, D), float64; read-only.
    #[getter]
    fn atoms<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let shape = [self.atoms.len() / self.dimension, self.dimension];
        Ok(arrays::view(py, &self.atoms, |atoms| atoms, &shape)?.into_any())
    }

    fn __repr__(&self) -> String {
        let count = self.atoms.len() / self.dimension;
        format!("Step({}: energy {:.6}, {count} atoms)", self.number, self.energy)
    }
}

/// What the moving atoms say.
enum Said {
    Moved { atoms: Vec<f64>, atomic: f64, image: f64 },
    Done(Result<Box<dyn std::any::Any + Send>, JobError>),
}

/// Says where the atoms are, and waits until somebody wants to know where they are next.
struct Teller {
    to: SyncSender<Said>,
    wanted: Receiver<()>,
    is_gone: bool,
}

impl Watch for Teller {
    fn step(&mut self, _: Phase, _: f64, _: Option<f64>) -> ControlFlow<()> {
        if self.is_gone { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }

    fn atoms(&mut self, _: Phase, view: AtomsView<'_>) {
        let moved = Said::Moved {
            atoms: view.coordinates.to_vec(),
            atomic: view.energy_atomic,
            image: view.energy_image,
        };
        self.is_gone |= self.to.send(moved).is_err() || self.wanted.recv().is_err();
    }
}

/// The ends of the channels to atoms that move.
struct Channels {
    from: Receiver<Said>,
    wants: SyncSender<()>,
    count: usize,
}

/// Steps of `Lattice.optimize`, one after another.
#[pyclass(frozen, module = "atomesh")]
pub struct Steps {
    body: Shared,
    channels: Mutex<Option<Channels>>,
}

impl Steps {
    /// Starts moving atoms; they wait for the first step to be asked for.
    pub(super) fn start(
        py: Python<'_>,
        body: Shared,
        moving: Box<dyn Moving>,
        threads: Option<usize>,
    ) -> PyResult<Self> {
        let (to, from) = sync_channel(1);
        let (wants, wanted) = sync_channel(1);
        // threads of its own: those of others would be blocked while nobody asks
        let pool = own_pool(py, threads.unwrap_or(0))?;
        let work = move || {
            if wanted.recv().is_err() {
                return;
            }
            let mut teller = Teller { to: to.clone(), wanted, is_gone: false };
            let done = catch_unwind(AssertUnwindSafe(|| pool.install(|| moving.run(&mut teller))));
            let _ = to.send(Said::Done(done.unwrap_or_else(|_| Err(bug()))));
        };
        let named = std::thread::Builder::new().name("atomesh-steps".into());
        named.spawn(work).map_err(|e| PyRuntimeError::new_err(format!("no thread: {e}")))?;
        Ok(Self { body, channels: Mutex::new(Some(Channels { from, wants, count: 0 })) })
    }
}

fn bug() -> JobError {
    JobError::content("a panic; this is a bug in atomesh; please report it")
}

#[pymethods]
impl Steps {
    fn __iter__(slf: Py<Self>) -> Py<Self> {
        slf
    }

    fn __next__(&self, py: Python<'_>) -> PyResult<Option<Step>> {
        let taken = self.channels.lock().unwrap_or_else(PoisonError::into_inner).take();
        let Some(mut channels) = taken else { return Ok(None) };
        let _ = channels.wants.send(());
        let channels_of = Mutex::new(channels.from);
        let said = loop {
            let heard = py.detach(|| {
                channels_of.lock().unwrap_or_else(PoisonError::into_inner).recv_timeout(TICK)
            });
            match heard {
                Ok(said) => break said,
                // without its channels the work ends at its next step
                Err(RecvTimeoutError::Timeout) => py.check_signals()?,
                Err(RecvTimeoutError::Disconnected) => break Said::Done(Err(bug())),
            }
        };
        channels.from = channels_of.into_inner().unwrap_or_else(PoisonError::into_inner);
        match said {
            Said::Done(done) => {
                let settled = done.map_err(|error| errors::raise(py, &error))?;
                own(&self.body).settle(settled);
                Ok(None)
            }
            Said::Moved { atoms, atomic, image } => {
                let (world, dimension) = {
                    let mut body = own(&self.body);
                    body.put(&atoms).map_err(|error| errors::raise(py, &error))?;
                    (body.in_world(&atoms), body.dimension())
                };
                channels.count += 1;
                let step = Step {
                    number: channels.count,
                    energy: atomic + image,
                    energy_atomic: atomic,
                    energy_image: image,
                    dimension,
                    atoms: Arc::new(world),
                };
                *self.channels.lock().unwrap_or_else(PoisonError::into_inner) = Some(channels);
                Ok(Some(step))
            }
        }
    }
}
