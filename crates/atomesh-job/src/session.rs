//! What a job says while it works, and hears: phases and their times, notes, when files are written.

use std::fmt;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use atomesh::run::Warning;
use atomesh::watch::{AtomsView, Phase, Watch};
use atomesh_io::image::ReadNote;
use atomesh_io::output_group::OutputGroup;

use serde_json::{Value, json};

use crate::error::JobError;
use crate::files::unplaced;

/// Listens to a job: to more than a [`Watch`] does.
pub trait Listener: Watch {
    /// Called with each note as soon as it is known.
    fn note(&mut self, note: &Note);

    /// Called with true before files are written and with false after: in between, ending the process
    /// would leave a part of them.
    fn writing(&mut self, begins: bool);
}

/// What a note means for the result.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoteKind {
    /// It tells what was read, and nothing was changed or guessed.
    Remark,
    /// Something was changed, guessed, filled, left out or not met.
    Change,
    /// The result may not be what was wanted.
    Warning,
}

impl NoteKind {
    /// The name in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Remark => "remark",
            Self::Change => "change",
            Self::Warning => "warning",
        }
    }
}

impl From<&ReadNote> for NoteKind {
    fn from(note: &ReadNote) -> Self {
        match (note.is_warning(), note.is_remark()) {
            (true, _) => Self::Warning,
            (_, true) => Self::Remark,
            _ => Self::Change,
        }
    }
}

/// Something that the user should know and that is no error.
#[derive(Clone, Debug, PartialEq)]
pub struct Note {
    /// What it means for the result.
    pub kind: NoteKind,
    /// The file that it is about.
    pub file: Option<PathBuf>,
    /// What there is to know.
    pub text: String,
}

impl Note {
    /// The name of the file without its folder.
    fn file_name(&self) -> Option<String> {
        let path = self.file.as_deref()?;
        Some(path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned())
    }
}

impl fmt::Display for Note {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(if self.kind == NoteKind::Warning { "warning: " } else { "note: " })?;
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
    is_strict: bool,
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
        let started = Instant::now();
        Self { ear, started, phase: None, times, notes, writing: 0, is_strict: false }
    }

    /// The same; where `is_strict`, files are written only if there is no note but remarks.
    pub fn strict(mut self, is_strict: bool) -> Self {
        self.is_strict = is_strict;
        self
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
        let file = file.map(Path::to_path_buf);
        self.note(Note { kind: NoteKind::Warning, file, text: text.to_string() });
    }

    /// Something that was changed, guessed, left out or not met.
    pub fn change(&mut self, text: impl fmt::Display) {
        self.note(Note { kind: NoteKind::Change, file: None, text: text.to_string() });
    }

    /// What is odd about a run, as a warning or a change.
    pub(crate) fn say(&mut self, file: Option<&Path>, warning: &Warning) {
        let kind = if warning.is_note() { NoteKind::Change } else { NoteKind::Warning };
        self.note(Note { kind, file: file.map(Path::to_path_buf), text: warning.to_string() });
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
    pub fn begin(&mut self, phase: Phase) {
        let _ = self.step(phase, 0.0, None);
    }

    /// Does what writes files, while the listener knows.
    pub fn writing<T>(&mut self, write: impl FnOnce(&mut Self) -> T) -> T {
        self.set_writing(self.writing + 1);
        let written = write(self);
        self.set_writing(self.writing - 1);
        written
    }

    /// Writes files that appear together, or none of them. `write` stages each output in the group and writes to
    /// the path that it gets; errors name the outputs.
    ///
    /// # Errors
    /// [`JobError`] of `write`, if an output cannot take its place, or if the session is strict and not all notes
    /// are remarks. Then all files are as they were.
    pub fn write_together<T>(
        &mut self,
        write: impl FnOnce(&mut OutputGroup, &mut Self) -> Result<T, JobError>,
    ) -> Result<T, JobError> {
        self.check_notes()?;
        let mut group = OutputGroup::default();
        let written = self.writing(|session| {
            let written = write(&mut group, session);
            written.map_err(|e| e.renamed(|path| group.wanted(path).map(Path::to_path_buf)))
        });
        let written = written.and_then(|written| self.check_notes().map(|()| written));
        // a reader may be long in coming: the process may end meanwhile
        let handed = written.and_then(|w| group.hand_on().map(|()| w).map_err(unplaced));
        self.writing(|_| match handed {
            Ok(written) => group.place().map(|()| written).map_err(unplaced),
            Err(error) => {
                drop(group);
                Err(error)
            }
        })
    }

    /// Refuses notes that are more than remarks, if the session is strict.
    ///
    /// # Errors
    /// [`JobError`] names all of them.
    pub fn check_notes(&self) -> Result<(), JobError> {
        let is_odd = |note: &&Note| note.kind != NoteKind::Remark;
        let odd: Vec<_> = self.notes.iter().filter(is_odd).map(Note::to_string).collect();
        if !self.is_strict || odd.is_empty() {
            return Ok(());
        }
        let found = match odd.len() {
            1 => "a note".to_string(),
            count => format!("{count} notes"),
        };
        let message = format!(
            "{found}, which --strict does not accept; nothing is written\n{}",
            odd.join("\n")
        );
        Err(JobError::content(message).advise("mend what they say, or leave out --strict"))
    }

    /// The notes as reports hold them: kind, name of the file without its folder, and text.
    pub fn notes_json(&self) -> Value {
        let of = |note: &Note| json!({ "kind": note.kind.name(), "file": note.file_name(), "text": note.text });
        self.notes.iter().map(of).collect()
    }

    /// The notes as pages show them: kind, name of the file without its folder, and text.
    pub(crate) fn notes_in_words(&self) -> Vec<String> {
        let of = |note: &Note| {
            let file = note.file_name().map_or_else(String::new, |name| format!("{name}: "));
            format!("{}: {file}{}", note.kind.name(), note.text)
        };
        self.notes.iter().map(of).collect()
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

    fn atoms(&mut self, phase: Phase, atoms: AtomsView<'_>) {
        match &mut self.ear {
            Ear::Watch(watch) => watch.atoms(phase, atoms),
            Ear::Listener(listener) => listener.atoms(phase, atoms),
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

    /// A session with a remark, and one with a change too.
    fn noted(watch: &mut Heard, kind: NoteKind) -> Session<'_> {
        let mut session = Session::heard_by(watch).strict(true);
        let text = "coordinates are turned".into();
        session.note(Note { kind: NoteKind::Remark, file: None, text });
        let (file, text) = (Some("far/a.png".into()), "samples are reordered".into());
        session.note(Note { kind, file, text });
        session
    }

    #[test]
    fn a_strict_session_writes_files_if_all_notes_are_remarks() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.json");
        let write = |group: &mut OutputGroup, _: &mut Session<'_>| {
            std::fs::write(group.stage(&path).unwrap(), "new").unwrap();
            Ok(())
        };
        for kind in [NoteKind::Change, NoteKind::Warning] {
            let mut heard = Heard::default();
            let error = noted(&mut heard, kind).write_together(write).unwrap_err();
            let text = error.to_string();
            assert!(text.contains("a note, which --strict does not accept"), "{text}");
            assert!(text.contains("far/a.png: samples are reordered") && !text.contains("turned"));
            assert!(!path.exists());
        }
        let mut heard = Heard::default();
        noted(&mut heard, NoteKind::Remark).write_together(write).unwrap();
        assert!(path.exists());
        let mut heard = Heard::default();
        noted(&mut heard, NoteKind::Warning).strict(false).write_together(write).unwrap();
    }

    #[test]
    fn a_note_that_comes_while_files_are_written_leaves_none_behind() {
        let folder = tempfile::tempdir().unwrap();
        let mut heard = Heard::default();
        let mut session = Session::heard_by(&mut heard).strict(true);
        let written = session.write_together(|group, session| {
            std::fs::write(group.stage(&folder.path().join("a")).unwrap(), "new").unwrap();
            session.warn(None, "late");
            Ok(())
        });
        assert!(written.unwrap_err().to_string().contains("late"));
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    }

    #[test]
    fn errors_of_staged_files_name_the_outputs() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.json");
        let mut heard = Heard::default();
        let mut session = Session::heard_by(&mut heard);
        let failed: Result<(), _> = session.write_together(|group, _| {
            let staged = group.stage(&path).unwrap();
            Err(JobError::file("cannot be written").about(&staged))
        });
        assert_eq!(failed.unwrap_err().path(), Some(path.as_path()));
    }

    #[test]
    fn reports_hold_kinds_and_the_names_of_files_without_their_folders() {
        let mut heard = Heard::default();
        let notes = noted(&mut heard, NoteKind::Change).notes_json();
        assert_eq!(notes[0]["kind"], "remark");
        assert_eq!(notes[0]["file"], Value::Null);
        let change = json!({ "kind": "change", "file": "a.png", "text": "samples are reordered" });
        assert_eq!(notes[1], change);
    }
}
