//! What the work is busy with: a bar on a terminal, lines for phases and notes, and Ctrl-C.

use std::io::IsTerminal;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicU8, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use atomesh::watch::{Phase, Watch};
use atomesh_io::output_group::remove_unfinished;
use atomesh_job::{JobError, Listener, Note, Session};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::words::{exit_code, refusal, say};

/// The signal that asked the process to end; 0: none has.
static SIGNAL: AtomicU8 = AtomicU8::new(0);

/// The signal of Ctrl-C.
const INTERRUPT: u8 = 2;

/// The signal that asked the process to end; that of Ctrl-C before one has.
pub fn signal() -> u8 {
    match SIGNAL.load(Ordering::Relaxed) {
        0 => INTERRUPT,
        signal => signal,
    }
}

/// Whether a signal has asked the process to end.
#[cfg(feature = "studio")]
pub fn is_signalled() -> bool {
    SIGNAL.load(Ordering::Relaxed) != 0
}

/// Held while files are written.
static WRITING: Mutex<()> = Mutex::new(());

/// How long the work may take to its next look.
const PATIENCE: Duration = Duration::from_millis(500);

/// Lets Ctrl-C, a request to terminate and the end of the terminal end the work at the next look, so that files are
/// removed that are not finished. If that look is long in coming, as in one iteration on millions of atoms,
/// the process ends without it, though never while files are written.
#[cfg(unix)]
pub fn catch_signals() {
    use std::sync::Arc;
    use std::sync::atomic::AtomicBool;

    use signal_hook::consts::{SIGABRT, SIGHUP, SIGINT, SIGTERM, SIGXFSZ};
    // a file that grows past the system's limit is then an error of the write
    let _ = signal_hook::flag::register(SIGXFSZ, Arc::<AtomicBool>::default());
    // an allocation that fails aborts, once it has said how many bytes it wanted: a failure as others
    let always = Arc::new(AtomicBool::new(true));
    let _ = signal_hook::flag::register_conditional_shutdown(SIGABRT, 1, always);
    // `nohup` lets the work outlive its terminal
    let hangup = (!is_ignored(SIGHUP)).then_some(SIGHUP);
    // without a handler the system ends the process, which is no worse than failing to start
    let Ok(mut signals) =
        signal_hook::iterator::Signals::new([SIGINT, SIGTERM].into_iter().chain(hangup))
    else {
        return;
    };
    std::thread::spawn(move || signals.forever().next().map(|signal| end(signal as u8)));
}

/// Lets Ctrl-C end the work.
#[cfg(not(unix))]
pub fn catch_signals() {
    let _ = ctrlc::set_handler(|| end(INTERRUPT));
}

/// Whether the process was started with a signal ignored, where the system says so.
#[cfg(unix)]
fn is_ignored(signal: i32) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    mask.is_some_and(|mask| mask >> (signal - 1) & 1 == 1)
}

/// Ends the process after a signal.
fn end(signal: u8) -> ! {
    SIGNAL.store(signal, Ordering::Relaxed);
    std::thread::sleep(PATIENCE);
    let _files_are_whole = writing();
    remove_unfinished();
    let clear = if std::io::stderr().is_terminal() { "\r\x1b[2K" } else { "" };
    let error = JobError::cancelled();
    say(format_args!("{clear}{}", refusal(&error)));
    std::process::exit(exit_code(&error).into());
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
    is_strict: bool,
}

impl Progress {
    /// The bar shows if standard error is a terminal. Where `is_strict`, jobs write files only if there is no note
    /// but remarks.
    pub fn new(verbosity: Verbosity, is_strict: bool) -> Self {
        let target = match verbosity {
            Verbosity::Quiet => ProgressDrawTarget::hidden(),
            _ => ProgressDrawTarget::stderr_with_hz(10),
        };
        let bar = ProgressBar::with_draw_target(Some(STEPS), target);
        let style = ProgressStyle::with_template("{prefix:>10} [{bar:30}] {percent:>3} % {msg}");
        bar.set_style(style.expect("a valid template").progress_chars("=> "));
        Self { verbosity, bar, phase: None, writing: None, is_strict }
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
        let is_strict = self.is_strict;
        let mut session = Session::heard_by(self).strict(is_strict);
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

    /// Tells what became of the work, unless all is to be quiet.
    #[cfg(feature = "studio")]
    pub fn tell(&self, line: &str) {
        self.say(line);
    }

    /// Prints a line on standard error, unless all is to be quiet.
    fn say(&self, line: &str) {
        if !self.is_quiet() {
            self.bar.suspend(|| say(line));
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
        match SIGNAL.load(Ordering::Relaxed) {
            0 => ControlFlow::Continue(()),
            _ => ControlFlow::Break(()),
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
