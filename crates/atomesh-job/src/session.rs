//! What a job says while it works, and hears: phases and their times, notes, when files are written.

use std::fmt;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use atomesh::run::Warning;
use atomesh::watch::{Phase, Watch};

/// Listens to a job: to more than a [`Watch`] does.
pub trait Listener: Watch {
    /// Called with each note as soon as it is known.
    fn note(&mut self, note: &Note);

    /// Called with true before files are written and with false after: in between, ending the process
    /// would leave a part of them.
    fn writing(&mut self, begins: bool);
}

/// Something that the user should know and that is no error.
#[derive(Clone, Debug, PartialEq)]
pub struct Note {
    /// Whether the result may not be what was wanted.
    pub is_warning: bool,
    /// The file that it is about.
    pub file: Option<PathBuf>,
    /// What there is to know.
    pub text: String,
}

impl fmt::Display for Note {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(if self.is_warning { "warning: " } else { "note: " })?;
        if let Some(file) = &self.file {
            write!(f, "{}: ", file.display())?;
        }
        f.write_str(&self.text)
    }
}

/// Who listens.
enum Ear<'w> {
    Watch(&'w mut dyn Watch),
    Listener(&'w mut dyn Listener),
}

/// One job under way: who listens to it, its notes, and the time that each phase took.
///
/// Jobs take a session where the core takes a [`Watch`], which a session is too.
pub struct Session<'w> {
    ear: Ear<'w>,
    started: Instant,
    phase: Option<(Phase, Instant)>,
    times: Vec<(Phase, Duration)>,
    notes: Vec<Note>,
    writing: u32,
}

impl<'w> Session<'w> {
    /// Starts the clock.
    pub fn new(watch: &'w mut dyn Watch) -> Self {
        Self::of(Ear::Watch(watch))
    }

    /// The same with one who hears notes at once, and when files are written.
    pub fn heard_by(listener: &'w mut dyn Listener) -> Self {
        Self::of(Ear::Listener(listener))
    }

    fn of(ear: Ear<'w>) -> Self {
        let (times, notes) = (Vec::new(), Vec::new());
        Self { ear, started: Instant::now(), phase: None, times, notes, writing: 0 }
    }

    /// All notes so far.
    pub fn notes(&self) -> &[Note] {
        &self.notes
    }

    /// The time that each phase took, in the order in which they began; without that under way.
    pub fn times(&self) -> &[(Phase, Duration)] {
        &self.times
    }

    /// The time since the start.
    pub fn elapsed(&self) -> Duration {
        self.started.elapsed()
    }

    /// A warning, about a file if there is one.
    pub(crate) fn warn(&mut self, file: Option<&Path>, text: impl fmt::Display) {
        self.note(Note {
            is_warning: true,
            file: file.map(Path::to_path_buf),
            text: text.to_string(),
        });
    }

    /// What is odd about a run, as a warning or a note.
    pub(crate) fn say(&mut self, file: Option<&Path>, warning: &Warning) {
        let (is_warning, text) = (!warning.is_note(), warning.to_string());
        self.note(Note { is_warning, file: file.map(Path::to_path_buf), text });
    }

    pub(crate) fn note(&mut self, note: Note) {
        if let Ear::Listener(listener) = &mut self.ear {
            listener.note(&note);
        }
        self.notes.push(note);
    }

    /// Ends the phase under way, whose time is up to now.
    pub(crate) fn end_phase(&mut self) {
        let Some((phase, since)) = self.phase.take() else { return };
        let time = since.elapsed();
        match self.times.iter_mut().find(|(p, _)| *p == phase) {
            Some((_, sum)) => *sum += time,
            None => self.times.push((phase, time)),
        }
    }

    /// Begins a phase that is not to be ended before its first file is whole.
    pub(crate) fn begin(&mut self, phase: Phase) {
        let _ = self.step(phase, 0.0, None);
    }

    /// Does what writes files, while the listener knows.
    pub fn writing<T>(&mut self, write: impl FnOnce(&mut Self) -> T) -> T {
        self.set_writing(self.writing + 1);
        let written = write(self);
        self.set_writing(self.writing - 1);
        written
    }

    fn set_writing(&mut self, depth: u32) {
        let was = std::mem::replace(&mut self.writing, depth);
        if let (Ear::Listener(listener), true) = (&mut self.ear, (was == 0) != (depth == 0)) {
            listener.writing(depth > 0);
        }
    }
}

impl Watch for Session<'_> {
    fn step(&mut self, phase: Phase, done: f64, energy: Option<f64>) -> ControlFlow<()> {
        if self.phase.is_none_or(|(p, _)| p != phase) {
            self.end_phase();
            self.phase = Some((phase, Instant::now()));
        }
        match &mut self.ear {
            Ear::Watch(watch) => watch.step(phase, done, energy),
            Ear::Listener(listener) => listener.step(phase, done, energy),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Default)]
    struct Heard(Vec<String>);

    impl Watch for Heard {
        fn step(&mut self, phase: Phase, _: f64, _: Option<f64>) -> ControlFlow<()> {
            self.0.push(phase.name().into());
            ControlFlow::Continue(())
        }
    }

    impl Listener for Heard {
        fn note(&mut self, note: &Note) {
            self.0.push(note.to_string());
        }

        fn writing(&mut self, begins: bool) {
            self.0.push(if begins { "writes" } else { "has written" }.into());
        }
    }

    #[test]
    fn a_phase_that_comes_back_adds_to_its_time() {
        let mut watch = atomesh::watch::Silent;
        let mut session = Session::new(&mut watch);
        for phase in [Phase::Read, Phase::Read, Phase::Grow, Phase::Read] {
            assert_eq!(session.step(phase, 0.5, None), ControlFlow::Continue(()));
        }
        session.end_phase();
        let phases: Vec<_> = session.times().iter().map(|(phase, _)| *phase).collect();
        assert_eq!(phases, [Phase::Read, Phase::Grow]);
    }

    #[test]
    fn a_listener_hears_notes_and_the_outermost_writing() {
        let mut heard = Heard::default();
        let mut session = Session::heard_by(&mut heard);
        session.warn(Some(Path::new("a.png")), "is odd");
        session.writing(|session| {
            session.begin(Phase::Write);
            session.writing(|_| ());
        });
        assert_eq!(session.notes().len(), 1);
        assert_eq!(heard.0, ["warning: a.png: is odd", "writes", "write", "has written"]);
    }
}
