//! What the work is busy with: a bar on a terminal, times for the report, and Ctrl-C.

use std::io::IsTerminal;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use atomesh::watch::{Phase, Watch};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::failure::Failure;

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
        let failure = Failure::cancelled();
        eprintln!("{clear}{failure}");
        std::process::exit(failure.code().into());
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
    /// A bar on a terminal, warnings, a summary.
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
    started: Instant,
    phase: Option<(Phase, Instant)>,
    times: Vec<(Phase, Duration)>,
}

impl Progress {
    /// Starts the clock. The bar shows if standard error is a terminal.
    pub fn new(verbosity: Verbosity) -> Self {
        let target = match verbosity {
            Verbosity::Quiet => ProgressDrawTarget::hidden(),
            _ => ProgressDrawTarget::stderr_with_hz(10),
        };
        let bar = ProgressBar::with_draw_target(Some(STEPS), target);
        let style = ProgressStyle::with_template("{prefix:>10} [{bar:30}] {percent:>3} % {msg}");
        bar.set_style(style.expect("a valid template").progress_chars("=> "));
        Self { verbosity, bar, started: Instant::now(), phase: None, times: Vec::new() }
    }

    /// How much is said.
    pub fn verbosity(&self) -> Verbosity {
        self.verbosity
    }

    /// Ends the phase under way, whose time is up to now.
    pub fn finish(&mut self) {
        if let Some((phase, since)) = self.phase.take() {
            let time = since.elapsed();
            match self.times.iter_mut().find(|(p, _)| *p == phase) {
                Some((_, sum)) => *sum += time,
                None => self.times.push((phase, time)),
            }
            if self.verbosity == Verbosity::Verbose {
                self.say(&format!("{:>10} {:8.3} s", phase.name(), time.as_secs_f64()));
            }
        }
        self.bar.finish_and_clear();
    }

    /// Begins a phase, ending the one under way.
    pub fn begin(&mut self, phase: Phase) {
        if self.phase.is_none_or(|(p, _)| p != phase) {
            self.finish();
            self.phase = Some((phase, Instant::now()));
            self.bar.reset();
            self.bar.set_prefix(phase.name());
            self.bar.set_message("");
        }
    }

    /// Prints a line on standard error, unless all is to be quiet.
    pub fn say(&self, line: &str) {
        if self.verbosity != Verbosity::Quiet {
            self.bar.suspend(|| eprintln!("{line}"));
        }
    }

    /// The time that each phase took, in the order in which they began.
    pub fn times(&self) -> &[(Phase, Duration)] {
        &self.times
    }

    /// The time since the start.
    pub fn elapsed(&self) -> Duration {
        self.started.elapsed()
    }

    /// Whether the user wants the work to end.
    pub fn interrupted(&self) -> bool {
        INTERRUPTED.load(Ordering::Relaxed)
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
        if self.interrupted() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_phase_that_comes_back_adds_to_its_time() {
        let mut progress = Progress::new(Verbosity::Quiet);
        for phase in [Phase::Read, Phase::Read, Phase::Grow, Phase::Read] {
            assert_eq!(progress.step(phase, 0.5, None), ControlFlow::Continue(()));
        }
        progress.finish();
        let phases: Vec<_> = progress.times().iter().map(|(phase, _)| *phase).collect();
        assert_eq!(phases, [Phase::Read, Phase::Grow]);
    }
}
