//! A session: what was done, in order, and the model that it makes; undo, redo, and the log.
//!
//! The model is a function of what was done. Undo goes back to a model that was kept, at or before the place wanted, and
//! does again what lies between: the same bytes, since every gesture is deterministic. A model is kept before an atom or
//! a region is edited for the first time in a mesh, and every so many gestures; they share what they can, and the oldest are thinned out
//! when there are many.

use std::path::{Path, PathBuf};

use atomesh::watch::Watch;
use atomesh_job::JobError;
use atomesh_job::options::{InputOptions, RunConfig};

use crate::gesture::Gesture;
use crate::log::{Entry, Log, Source};
use crate::model::{AnyModel, AnyOpened, Axes, Model, each, open, sha256};

/// The name of the log in the session's folder.
pub const LOG_FILE: &str = "log.jsonl";

/// Gestures from one model that is kept to the next.
const GESTURES_APART: usize = 16;

/// Bytes that all kept models may take, about.
const MOST_KEPT: usize = 1 << 29;

/// Models that are kept at most.
const MOST_MODELS: usize = 64;

/// What was done.
#[derive(Clone, Debug, PartialEq)]
enum Step {
    Open { source: Source, run: Box<RunConfig> },
    Do(Gesture),
}

/// What was done, and what it makes.
#[derive(Debug)]
pub struct Session {
    folder: PathBuf,
    log: Option<Log>,
    steps: Vec<Step>,
    done: usize,
    model: Option<AnyModel>,
    kept: Vec<(usize, AnyModel)>,
}

impl Session {
    /// Opens a session's folder, or begins one. What its log holds is done again.
    ///
    /// # Errors
    /// [`JobError`] if the folder cannot be used, its log is none, or an image is not what it was.
    pub fn open(folder: &Path, watch: &mut dyn Watch) -> Result<Self, JobError> {
        std::fs::create_dir_all(folder).map_err(|e| JobError::unwritable(&e).about(folder))?;
        let (log, entries) = Log::open(&folder.join(LOG_FILE))?;
        let mut session = Self::of(folder, entries, watch)?;
        session.log = Some(log);
        Ok(session)
    }

    /// Does again what a log holds, and adds nothing to it.
    ///
    /// # Errors
    /// As [`Session::open`].
    pub fn replay(log: &Path, watch: &mut dyn Watch) -> Result<Self, JobError> {
        let entries = Log::read_file(log)?;
        let folder = log.parent().filter(|folder| !folder.as_os_str().is_empty());
        Self::of(folder.unwrap_or(Path::new(".")), entries, watch)
    }

    fn of(folder: &Path, entries: Vec<Entry>, watch: &mut dyn Watch) -> Result<Self, JobError> {
        let (mut steps, mut done) = (Vec::new(), 0);
        for entry in entries {
            let step = match entry {
                Entry::Log { .. } => continue,
                Entry::Undo if done > 1 => {
                    done -= 1;
                    continue;
                }
                Entry::Redo if done < steps.len() => {
                    done += 1;
                    continue;
                }
                Entry::Undo | Entry::Redo => {
                    return Err(JobError::content("the log takes back what was not done"));
                }
                Entry::Open { source, run } => Step::Open { source, run },
                Entry::Do(gesture) => Step::Do(gesture),
            };
            steps.truncate(done);
            steps.push(step);
            done += 1;
        }
        let folder = folder.to_path_buf();
        let mut session = Self { folder, log: None, steps, done: 0, model: None, kept: Vec::new() };
        session.go_to(done, watch)?;
        Ok(session)
    }

    /// The session's folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// What was opened first, if anything was.
    pub fn source(&self) -> Option<&Source> {
        match self.steps.first()? {
            Step::Open { source, .. } => Some(source),
            Step::Do(_) => None,
        }
    }

    /// The model, if anything is open.
    pub(crate) fn model(&self) -> Option<&AnyModel> {
        self.model.as_ref()
    }

    /// The model, to make what is missing of it.
    pub(crate) fn model_mut(&mut self) -> Option<&mut AnyModel> {
        self.model.as_mut()
    }

    /// How many atoms there are to edit, removed ones too; 0 before any were asked for.
    pub fn atom_count(&self) -> usize {
        let model = self.model.as_ref();
        model.map_or(0, |model| each!(model, m => m.edited().map_or(0, |e| e.atoms().len())))
    }

    /// Writes the mesh.
    ///
    /// # Errors
    /// [`JobError`] if nothing is open, or the mesh cannot be made or written.
    pub fn write(&mut self, path: &Path, watch: &mut dyn Watch) -> Result<(), JobError> {
        self.model.as_mut().ok_or_else(nothing_open)?.write(path, watch)
    }

    /// How many things can be taken back, and done again. What was opened first stays.
    pub fn counts(&self) -> [usize; 2] {
        [self.done.saturating_sub(1), self.steps.len() - self.done]
    }

    /// Opens an image.
    ///
    /// # Errors
    /// [`JobError`] if it cannot be opened; nothing has changed then.
    pub fn open_image(
        &mut self,
        source: Source,
        run: RunConfig,
        watch: &mut dyn Watch,
    ) -> Result<(), JobError> {
        let step = Step::Open { source: source.clone(), run: Box::new(run.clone()) };
        let mut model = None;
        self.apply(&step, &mut model, watch)?;
        self.log(&Entry::Open { source, run: Box::new(run) })?;
        self.model = model;
        self.push(step);
        Ok(())
    }

    /// Opens a file as the command line names it.
    ///
    /// # Errors
    /// As [`Session::open_image`].
    pub fn open_file(&mut self, mut run: RunConfig, watch: &mut dyn Watch) -> Result<(), JobError> {
        make_absolute(&mut run.input)?;
        let path = run.input.shown().map(Path::to_path_buf);
        let path = path.ok_or_else(|| JobError::misuse("no image to open; expected FILE"))?;
        let source = Source::File { sha256: sha256(&path)?, path };
        self.open_image(source, run, watch)
    }

    /// Does something.
    ///
    /// # Errors
    /// [`JobError`] if it cannot be done; nothing has changed then.
    pub fn act(&mut self, gesture: Gesture, watch: &mut dyn Watch) -> Result<(), JobError> {
        self.keep_before(needs_mesh(&gesture));
        // what one step does is done whole or not at all; of a longer path a part might be
        let is_path = matches!(&gesture, Gesture::Move { path, .. } if path.len() > 1);
        let before = is_path.then(|| self.model.clone());
        let step = Step::Do(gesture);
        let mut model = self.model.take();
        let applied = self.apply(&step, &mut model, watch);
        self.model = model;
        if let Err(error) = applied {
            self.model = before.unwrap_or(self.model.take());
            return Err(error);
        }
        if let Step::Do(gesture) = &step {
            self.log(&Entry::Do(gesture.clone()))?;
        }
        self.push(step);
        Ok(())
    }

    /// Moves an atom a step, with those in reach, without recording it: what a page does while a hand drags. Places are
    /// in samples, the reach is over the nominal distance.
    ///
    /// # Errors
    /// [`JobError`] if nothing is open, or the atom may not be there; nothing has changed then.
    pub fn drag(
        &mut self,
        atom: u32,
        to: &[f64],
        reach: f64,
        watch: &mut dyn Watch,
    ) -> Result<(), JobError> {
        let model = self.model.as_mut().ok_or_else(nothing_open)?;
        each!(model, model => model.drag(atom, to, reach, watch).map(drop))
    }

    /// Keeps the model before atoms are edited bit by bit; [`Session::record`] says in the end what was done.
    pub fn begin_editing(&mut self) {
        self.keep_before(true);
    }

    /// Records what was done to the model already.
    ///
    /// # Errors
    /// [`JobError`] if the log cannot be written.
    pub fn record(&mut self, gesture: Gesture) -> Result<(), JobError> {
        self.log(&Entry::Do(gesture.clone()))?;
        self.push(Step::Do(gesture));
        Ok(())
    }

    /// Takes the last thing back.
    ///
    /// # Errors
    /// [`JobError`] if nothing was done; also if the watch ended the work, and then nothing has changed.
    pub fn undo(&mut self, watch: &mut dyn Watch) -> Result<(), JobError> {
        if self.done <= 1 {
            return Err(JobError::misuse("nothing was done"));
        }
        self.go_to(self.done - 1, watch)?;
        self.log(&Entry::Undo)
    }

    /// Does again what was taken back.
    ///
    /// # Errors
    /// As [`Session::undo`].
    pub fn redo(&mut self, watch: &mut dyn Watch) -> Result<(), JobError> {
        if self.done == self.steps.len() {
            return Err(JobError::misuse("nothing was taken back"));
        }
        self.go_to(self.done + 1, watch)?;
        self.log(&Entry::Redo)
    }

    /// Makes the model after so many steps.
    fn go_to(&mut self, done: usize, watch: &mut dyn Watch) -> Result<(), JobError> {
        let before = (self.done, self.model.take());
        let went = self.try_go_to(done, before.0, &before.1, watch);
        if went.is_err() {
            (self.done, self.model) = before;
        }
        went
    }

    fn try_go_to(
        &mut self,
        done: usize,
        now: usize,
        current: &Option<AnyModel>,
        watch: &mut dyn Watch,
    ) -> Result<(), JobError> {
        self.kept.retain(|(at, _)| *at <= done.max(now));
        let kept = self.kept.iter().rev().find(|(at, _)| *at <= done);
        let (at, model) = match kept {
            Some((at, _)) if now <= done && now > *at => (now, current.clone()),
            Some((at, model)) => (*at, Some(model.clone())),
            None if now <= done => (now, current.clone()),
            None => (0, None),
        };
        (self.done, self.model) = (at, model);
        while self.done < done {
            let step = self.steps[self.done].clone();
            self.keep_before(matches!(&step, Step::Do(gesture) if needs_mesh(gesture)));
            let mut model = self.model.take();
            self.apply(&step, &mut model, watch)?;
            self.model = model;
            self.done += 1;
        }
        Ok(())
    }

    fn apply(
        &self,
        step: &Step,
        model: &mut Option<AnyModel>,
        watch: &mut dyn Watch,
    ) -> Result<(), JobError> {
        match step {
            Step::Open { source, run } => {
                let mut run = (**run).clone();
                if let Source::Dropped { name, .. } = source {
                    run.input = InputOptions { image: Some(self.folder.join(name)), ..run.input };
                }
                let opened = open(source, &run, &self.folder, watch)?;
                *model = Some(model_of(opened, run, watch)?);
                Ok(())
            }
            Step::Do(gesture) => model.as_mut().ok_or_else(nothing_open)?.apply(gesture, watch),
        }
    }

    fn push(&mut self, step: Step) {
        self.steps.truncate(self.done);
        self.kept.retain(|(at, _)| *at <= self.done);
        self.steps.push(step);
        self.done += 1;
    }

    /// Keeps the model as it is, if it is time to.
    fn keep_before(&mut self, is_edit: bool) {
        let Some(model) = &self.model else { return };
        let last = self.kept.iter().rev().find(|(at, _)| *at <= self.done);
        let is_due = match last {
            None => true,
            Some((at, _)) if self.done - at >= GESTURES_APART => true,
            // to go back into a mesh that has to be made again takes as long as that
            Some((_, kept)) => is_edit && model.made_count() > kept.made_count(),
        };
        if !is_due {
            return;
        }
        let model = model.clone();
        self.kept.retain(|(at, _)| *at != self.done);
        self.kept.push((self.done, model));
        self.kept.sort_by_key(|(at, _)| *at);
        self.thin();
    }

    /// Lets every second of the kept models go, if there are too many; those after something was opened stay.
    fn thin(&mut self) {
        let bytes: usize = self.kept.iter().map(|(_, model)| model.bytes()).sum();
        if self.kept.len() <= MOST_MODELS && (bytes <= MOST_KEPT || self.kept.len() < 4) {
            return;
        }
        let steps = &self.steps;
        let mut number = 0;
        self.kept.retain(|(at, _)| {
            number += 1;
            let is_opened = *at > 0 && matches!(steps.get(at - 1), Some(Step::Open { .. }));
            is_opened || number % 2 == 0
        });
    }

    fn log(&mut self, entry: &Entry) -> Result<(), JobError> {
        self.log.as_mut().map_or(Ok(()), |log| log.append(entry))
    }
}

fn nothing_open() -> JobError {
    JobError::misuse("no image is open")
}

/// Whether a gesture is done to the mesh, or its atoms, as they are.
fn needs_mesh(gesture: &Gesture) -> bool {
    use Gesture::{Add, MergeParts, Move, Pin, Region, Remove, SplitPart};
    matches!(
        gesture,
        Add { .. }
            | Move { .. }
            | Remove { .. }
            | Pin { .. }
            | Region { .. }
            | MergeParts { .. }
            | SplitPart { .. }
    )
}

/// Names of files that hold wherever the log is replayed on this machine.
fn make_absolute(input: &mut InputOptions) -> Result<(), JobError> {
    let is_live = input.masks_absent();
    let InputOptions { image, potential, size_field, beta_field, mask, labels } = input;
    let mask = if is_live { &mut None } else { mask };
    for path in [image, potential, size_field, beta_field, mask, labels].into_iter().flatten() {
        *path = std::path::absolute(&*path).map_err(|e| JobError::unreadable(&e).about(path))?;
        if path.to_str().is_none() {
            return Err(
                JobError::misuse("the name is not UTF-8, which a log cannot hold").about(path)
            );
        }
    }
    Ok(())
}

/// A model of either dimension from what was opened.
fn model_of(
    opened: AnyOpened,
    run: RunConfig,
    watch: &mut dyn Watch,
) -> Result<AnyModel, JobError> {
    Ok(match opened {
        AnyOpened::Flat(opened) => AnyModel::Flat(Model::new(Axes::plane(), opened, run, watch)?),
        AnyOpened::Volume(opened) => {
            AnyModel::Volume(Model::new(Axes::space(), opened, run, watch)?)
        }
    })
}
