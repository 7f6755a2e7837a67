//! What the work is busy with: a bar on a terminal, lines for phases and notes, and Ctrl-C.

use std::io::IsTerminal;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use atomesh::watch::{Phase, Watch};
use atomesh_job::{JobError, Listener, Note, Session};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::words::{exit_code, refusal};

/// Whether Ctrl-C was pressed.
static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// Held while files are written.
static WRITING: Mutex<()> = Mutex::new(());

/// How long the work may take to its next look.
const PATIENCE: Duration = Duration::from_millis(500);

/// Lets Ctrl-C (and a request to terminate) end the work at the next look, so that files are removed
/// that are not finished. If that look is long in coming, as in one iteration on millions of atoms,
/// the process ends without it, though never while files are written.
pub fn catch_interrupts() {
    let end = || {
        INTERRUPTED.store(true, Ordering::Relaxed);
        std::thread::sleep(PATIENCE);
        let _files_are_whole = writing();
        let clear = if std::io::stderr().is_terminal() { "\r\x1b[2K" } else { "" };
        let error = JobError::cancelled();
        eprintln!("{clear}{}", refusal(&error));
        std::process::exit(exit_code(&error).into());
    };
    // without a handler the system ends the process, which is no worse than failing to start
    let _ = ctrlc::set_handler(end);
}

/// To be held while files are written: until it is dropped, only the work itself ends the process.
pub fn writing() -> MutexGuard<'static, ()> {
    WRITING.lock().unwrap_or_else(PoisonError::into_inner)
}

/// How much is said on the way.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Verbosity {
    /// Errors alone.
    Quiet,
    /// A bar on a terminal, notes, a summary.
    #[default]
    Normal,
    /// A line a phase besides.
    Verbose,
}

/// Steps of the bar.
const STEPS: u64 = 1000;

/// Listens to the work.
#[derive(Debug)]
pub struct Progress {
    verbosity: Verbosity,
    bar: ProgressBar,
    phase: Option<(Phase, Instant)>,
    writing: Option<MutexGuard<'static, ()>>,
}

impl Progress {
    /// The bar shows if standard error is a terminal.
    pub fn new(verbosity: Verbosity) -> Self {
        let target = match verbosity {
            Verbosity::Quiet => ProgressDrawTarget::hidden(),
            _ => ProgressDrawTarget::stderr_with_hz(10),
        };
        let bar = ProgressBar::with_draw_target(Some(STEPS), target);
        let style = ProgressStyle::with_template("{prefix:>10} [{bar:30}] {percent:>3} % {msg}");
        bar.set_style(style.expect("a valid template").progress_chars("=> "));
        Self { verbosity, bar, phase: None, writing: None }
    }

    /// Whether nothing but errors is said.
    pub fn is_quiet(&self) -> bool {
        self.verbosity == Verbosity::Quiet
    }

    /// Does a job and says what became of it, in the words that `words` finds.
    ///
    /// # Errors
    /// The job's.
    pub fn job<T>(
        &mut self,
        job: impl FnOnce(&mut Session<'_>) -> Result<T, JobError>,
        words: impl FnOnce(&T, Duration) -> String,
    ) -> Result<T, JobError> {
        let mut session = Session::heard_by(self);
        let done = job(&mut session)?;
        let elapsed = session.elapsed();
        self.finish();
        let text = words(&done, elapsed);
        text.lines().for_each(|line| self.say(line));
        Ok(done)
    }

    /// Ends the phase under way.
    pub fn finish(&mut self) {
        if let Some((phase, since)) = self.phase.take()
            && self.verbosity == Verbosity::Verbose
        {
            self.say(&format!("{:>10} {:8.3} s", phase.name(), since.elapsed().as_secs_f64()));
        }
        self.bar.finish_and_clear();
    }

    /// Begins a phase, ending the one under way.
    fn begin(&mut self, phase: Phase) {
        if self.phase.is_none_or(|(p, _)| p != phase) {
            self.finish();
            self.phase = Some((phase, Instant::now()));
            self.bar.reset();
            self.bar.set_prefix(phase.name());
            self.bar.set_message("");
        }
    }

    /// Prints a line on standard error, unless all is to be quiet.
    fn say(&self, line: &str) {
        if !self.is_quiet() {
            self.bar.suspend(|| eprintln!("{line}"));
        }
    }
}

impl Watch for Progress {
    fn step(&mut self, phase: Phase, done: f64, energy: Option<f64>) -> ControlFlow<()> {
        self.begin(phase);
        if !self.bar.is_hidden() {
            self.bar.set_position((done.clamp(0.0, 1.0) * STEPS as f64) as u64);
            if let Some(energy) = energy {
                self.bar.set_message(format!("energy {energy:.6e}"));
            }
        }
        match INTERRUPTED.load(Ordering::Relaxed) {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        }
    }
}

impl Listener for Progress {
    fn note(&mut self, note: &Note) {
        self.say(&note.to_string());
    }

    fn writing(&mut self, begins: bool) {
        self.writing = begins.then(writing);
    }
}
