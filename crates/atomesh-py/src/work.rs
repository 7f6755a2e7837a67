//! A job on threads of its own, while the caller's thread listens.
//!
//! Releasing the interpreter's lock is not enough for Ctrl-C: Python runs signal handlers on the main thread alone, when
//! that thread asks for them. So the job runs on a thread of a pool, and the caller's thread waits for it detached,
//! asks for signals every [`TICK`], and calls back. When it is to stop, the job's [`Watch`] says so at its next step; if
//! that is long in coming, the caller gets its exception after [`PATIENCE`] all the same, and the job ends by itself.

use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use atomesh::watch::{Phase, Watch};
use atomesh_job::{JobError, Note, Session};
use pyo3::exceptions::{PyRuntimeError, PyTypeError};
use pyo3::prelude::*;
use rayon::ThreadPool;

use crate::errors;

/// How often signals are asked for.
pub const TICK: Duration = Duration::from_millis(20);

/// How long the caller waits for a job that was told to stop.
const PATIENCE: Duration = Duration::from_millis(100);

/// How long a job waits for its callback before it looks for other work.
const TURN: Duration = Duration::from_millis(1);

/// The stack of a thread; nested parallel loops may do another's work on it.
const STACK: usize = 16 << 20;

/// Where the work is.
///
/// Attributes: `phase` (such as `"optimize"`), `done` (the share of the phase that is done, 0 to 1) and `energy` (the
/// lattice's energy, without unit, while atoms are moved, else None).
#[pyclass(frozen, module = "atomesh")]
#[derive(Clone, Debug)]
pub struct Event {
    /// The phase's name.
    #[pyo3(get)]
    phase: &'static str,
    /// The share of the phase that is done, 0…1.
    #[pyo3(get)]
    done: f64,
    /// The energy, where there is one.
    #[pyo3(get)]
    energy: Option<f64>,
}

#[pymethods]
impl Event {
    fn __repr__(&self) -> String {
        let energy = self.energy.map_or("None".into(), |energy| energy.to_string());
        format!("Event(phase={:?}, done={:.3}, energy={energy})", self.phase, self.done)
    }
}

/// How a job is done.
#[derive(Default)]
pub struct How {
    /// Called with each [`Event`]; False ends the work.
    pub progress: Option<Py<PyAny>>,
    /// How many threads; `None` for one a core.
    pub threads: Option<usize>,
    /// Whether notes and warnings are refusals.
    pub strict: bool,
}

impl How {
    /// Takes `progress` as callers give it: None, False, True for a line of progress, or something to call.
    pub fn progress_of(progress: Option<&Bound<'_, PyAny>>) -> PyResult<Option<Py<PyAny>>> {
        let Some(progress) = progress.filter(|given| !given.is_none()) else { return Ok(None) };
        if let Ok(wants_line) = progress.extract::<bool>() {
            if !wants_line {
                return Ok(None);
            }
            let line = progress.py().import("atomesh._progress")?.call_method0("line")?;
            return Ok(Some(line.unbind()));
        }
        if !progress.is_callable() {
            let message = "progress is neither None, True, False nor something to call";
            return Err(PyTypeError::new_err(message));
        }
        Ok(Some(progress.clone().unbind()))
    }
}

/// What the job says to the caller's thread.
enum Said<T> {
    /// It waits for an answer: whether to go on.
    Step(Event, Sender<bool>),
    Done(Result<T, JobError>, Vec<Note>),
    Panicked(String),
}

/// The job's ear.
struct Ear<T> {
    to: Sender<Said<T>>,
    stop: Arc<AtomicBool>,
    calls_back: bool,
}

impl<T: Send> Watch for Ear<T> {
    fn step(&mut self, phase: Phase, done: f64, energy: Option<f64>) -> ControlFlow<()> {
        if self.stop.load(Ordering::Relaxed) {
            return ControlFlow::Break(());
        }
        if !self.calls_back {
            return ControlFlow::Continue(());
        }
        let (answer, answered) = channel();
        let event = Event { phase: phase.name(), done, energy };
        let said = self.to.send(Said::Step(event, answer));
        if said.is_err() {
            return ControlFlow::Break(());
        }
        loop {
            match answered.recv_timeout(TURN) {
                Ok(true) => return ControlFlow::Continue(()),
                // the callback may have a job of its own for this very thread
                Err(RecvTimeoutError::Timeout) => drop(rayon::yield_now()),
                // a caller that is gone wants no more; where a phase begins nobody hears of it, so it is kept
                Ok(false) | Err(RecvTimeoutError::Disconnected) => {
                    self.stop.store(true, Ordering::Relaxed);
                    return ControlFlow::Break(());
                }
            }
        }
    }
}

/// Does a job and gives what it gave, with its notes in words; says these as warnings.
///
/// # Errors
/// The exception for the job's refusal, of a callback, or of a signal's handler.
pub fn work<T, J>(py: Python<'_>, how: &How, job: J) -> PyResult<(T, Vec<String>)>
where
    T: Send + 'static,
    J: FnOnce(&mut Session<'_>) -> Result<T, JobError> + Send + 'static,
{
    let (to, from) = channel();
    let stop = Arc::new(AtomicBool::new(false));
    let strict = how.strict;
    let mut ear =
        Ear { to: to.clone(), stop: Arc::clone(&stop), calls_back: how.progress.is_some() };
    pool(py, how.threads)?.spawn(move || {
        let done = catch_unwind(AssertUnwindSafe(|| {
            let mut session = Session::new(&mut ear).strict(strict);
            let done = job(&mut session).and_then(|done| session.check_notes().map(|()| done));
            Said::Done(done, session.notes().to_vec())
        }));
        let said = done.unwrap_or_else(|panic| Said::Panicked(panic_text(panic.as_ref())));
        let _ = to.send(said); // the caller may be gone
    });
    let listened = listen(py, how, &Mutex::new(from), &stop);
    if let Some(progress) = &how.progress
        && let Ok(close) = progress.getattr(py, "close")
    {
        close.call0(py)?;
    }
    let (done, notes) = listened?;
    let done = done.map_err(|error| errors::raise(py, &error))?;
    errors::warn(py, &notes)?;
    Ok((done, notes.iter().map(errors::words).collect()))
}

/// Waits for a job.
fn listen<T: Send>(
    py: Python<'_>,
    how: &How,
    from: &Mutex<Receiver<Said<T>>>,
    stop: &AtomicBool,
) -> PyResult<(Result<T, JobError>, Vec<Note>)> {
    let hear =
        |time| py.detach(|| from.lock().unwrap_or_else(PoisonError::into_inner).recv_timeout(time));
    loop {
        let called = match hear(TICK) {
            Ok(Said::Done(done, notes)) => return Ok((done, notes)),
            Ok(Said::Panicked(text)) => return Err(bug(&text)),
            Ok(Said::Step(event, answer)) => {
                let called = call_back(py, how, event);
                let _ = answer.send(matches!(called, Ok(true)));
                called.map(drop)
            }
            Err(RecvTimeoutError::Timeout) => Ok(()),
            Err(RecvTimeoutError::Disconnected) => return Err(bug("a job gave no answer")),
        };
        if let Err(error) = called.and_then(|()| py.check_signals()) {
            stop.store(true, Ordering::Relaxed);
            // files under way are removed by the job: it is given the time for it
            while let Ok(Said::Step(_, answer)) = hear(PATIENCE) {
                let _ = answer.send(false);
            }
            return Err(error);
        }
    }
}

/// Calls back; false ends the work.
fn call_back(py: Python<'_>, how: &How, event: Event) -> PyResult<bool> {
    let Some(progress) = &how.progress else { return Ok(true) };
    let said = progress.call1(py, (event,))?;
    // what returns nothing goes on
    Ok(said.extract::<bool>(py).unwrap_or(true))
}

fn bug(text: &str) -> PyErr {
    PyRuntimeError::new_err(format!("{text}; this is a bug in atomesh; please report it"))
}

/// What a panic said.
fn panic_text(panic: &(dyn std::any::Any + Send)) -> String {
    let text = panic.downcast_ref::<String>().map(String::as_str);
    text.or(panic.downcast_ref::<&str>().copied()).unwrap_or("a panic").to_owned()
}

/// Pools that were made, each with the process that made it and its number of threads.
static POOLS: Mutex<Vec<(u32, usize, Arc<ThreadPool>)>> = Mutex::new(Vec::new());

/// The threads that work is done on. A process that was forked has none of its parent's: it makes its own.
pub fn pool(py: Python<'_>, threads: Option<usize>) -> PyResult<Arc<ThreadPool>> {
    let threads = threads.unwrap_or(0);
    let process = std::process::id();
    let mut pools = POOLS.lock().unwrap_or_else(PoisonError::into_inner);
    // a parent's pool cannot be ended here: its threads are not
    pools.extract_if(.., |(of, _, _)| *of != process).for_each(std::mem::forget);
    if let Some((_, _, pool)) = pools.iter().find(|(_, of, _)| *of == threads) {
        return Ok(Arc::clone(pool));
    }
    let pool = Arc::new(own_pool(py, threads)?);
    pools.push((process, threads, Arc::clone(&pool)));
    Ok(pool)
}

/// Threads that no other job has; 0 for one a core.
pub fn own_pool(py: Python<'_>, threads: usize) -> PyResult<ThreadPool> {
    let made = py.detach(|| {
        let name = |number| format!("atomesh-{number}");
        let builder = rayon::ThreadPoolBuilder::new().num_threads(threads);
        builder.stack_size(STACK).thread_name(name).build()
    });
    made.map_err(|e| PyRuntimeError::new_err(format!("no threads: {e}")))
}
