//! The engine: one thread that owns the session, does what pages ask for, and makes what is missing.
//!
//! Between requests it works towards a mesh of all that was done: the mesh first, then regions, figures, barriers and flow.
//! A request that changes anything ends the work under way at its next look; the newest counts. What is on the screen
//! stays there until the new is made.

mod attention;
mod request;
mod state;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::JoinHandle;

use atomesh_job::options::{InputOptions, RunConfig};
use atomesh_job::{ErrorKind, JobError};
use serde_json::Value;

use crate::exhibit::{Exhibit, Shown, Surfaces};
use crate::gesture::Gesture;
use crate::hub::{Frame, Hub};
use crate::log::Source;
use crate::model::{AnyModel, Model, each, sha256};
use crate::protocol::{Command, Kind};
use crate::region_view;
use crate::session::Session;
use crate::view::{self, Dragged};
use attention::Attention;
pub use request::{Export, Request};

/// Speaks to the engine.
#[derive(Clone, Debug)]
pub struct Handle(Sender<Request>);

impl Handle {
    /// Asks for something; the reply is dropped unanswered if the engine has ended.
    pub fn ask(&self, request: Request) {
        let _ = self.0.send(request);
    }
}

/// A drag that has not ended.
struct Drag {
    atom: u32,
    path: Vec<Vec<f64>>,
    reach: f64,
    dragged: Dragged,
}

/// The thread's state.
struct Engine {
    session: Session,
    hub: Arc<Hub>,
    attention: Attention,
    /// Counts everything that pages could see change.
    revision: u32,
    /// Counts exhibits.
    shown: u32,
    /// Counts images, and says which one it is by its place in memory.
    image: (u32, usize),
    /// The revision of the atoms that pages show.
    atoms_revision: u32,
    /// Whether pages show atoms.
    shows_atoms: bool,
    /// The level of the parts that pages show, if they do.
    level: Option<usize>,
    /// The part of each cell at that level.
    parts: Option<Arc<Vec<i32>>>,
    drag: Option<Drag>,
    made: Made,
    figures: Value,
    hash: Option<String>,
    error: Option<String>,
    is_busy: bool,
}

/// What of the present model has been published.
#[derive(Clone, Copy, Debug, Default)]
struct Made {
    fields: bool,
    mesh: bool,
    atoms: bool,
    regions: bool,
    figures: bool,
    flow: bool,
    /// Nothing more is made: it failed, or was ended by hand.
    halted: bool,
}

/// Starts the engine on a session.
pub fn start(session: Session, hub: Arc<Hub>) -> (Handle, JoinHandle<()>) {
    let (sender, receiver) = channel();
    let thread = std::thread::spawn(move || Engine::new(session, hub, receiver).run());
    (Handle(sender), thread)
}

impl Engine {
    fn new(session: Session, hub: Arc<Hub>, requests: Receiver<Request>) -> Self {
        Self {
            session,
            attention: Attention::new(requests, hub.clone()),
            hub,
            revision: 0,
            shown: 0,
            image: (0, 0),
            atoms_revision: 0,
            shows_atoms: false,
            level: None,
            parts: None,
            drag: None,
            made: Made::default(),
            figures: Value::Null,
            hash: None,
            error: None,
            is_busy: false,
        }
    }

    fn run(mut self) {
        self.changed();
        loop {
            let has_work = self.has_work();
            if has_work != self.is_busy {
                self.is_busy = has_work;
                self.publish_state();
            }
            match self.attention.next(!has_work) {
                Some(Request::End) => return,
                Some(request) => self.answer(request),
                None if has_work => self.work(),
                None => return, // nobody is left who could ask
            }
        }
    }

    fn has_work(&self) -> bool {
        let Made { mesh, atoms, regions, figures, flow, halted, .. } = self.made;
        let wanted = [mesh, atoms || !self.shows_atoms, regions, figures, flow];
        self.session.model().is_some() && !halted && self.drag.is_none() && wanted.contains(&false)
    }

    fn answer(&mut self, request: Request) {
        match request {
            Request::Command(command, reply) => {
                let done = self.command(command);
                reply(done.map_err(|e| words(&e)));
            }
            Request::OpenDropped { name, run, reply } => {
                let opened = self.open_dropped(&name, *run);
                reply(opened.map(|()| None).map_err(|e| words(&e)));
            }
            Request::Export { format, reply } => {
                let written = self.export(format);
                reply(written.map_err(|e| words(&e)));
            }
            Request::End => {}
        }
    }

    fn command(&mut self, command: Command) -> Result<Option<String>, JobError> {
        if !matches!(command, Command::Drag { .. }) {
            self.drop_atom()?;
        }
        match command {
            Command::Ack { .. } => {}
            Command::Do { gesture } => {
                self.act(gesture)?;
            }
            Command::Drag { atom, to, reach, revision } => self.drag(atom, &to, reach, revision)?,
            Command::Drop => {}
            Command::Undo => {
                self.session.undo(&mut self.attention.firm())?;
                self.changed();
            }
            Command::Redo => {
                self.session.redo(&mut self.attention.firm())?;
                self.changed();
            }
            Command::Cancel => {
                self.made.halted = true;
                self.error =
                    self.has_unmade().then(|| "the work was ended; any change goes on".into());
                self.publish_state();
            }
            Command::Atoms { shown } => self.shows_atoms = shown,
            Command::Parts { count } => {
                if self.level != count {
                    self.level = count;
                    self.made.regions = false;
                }
            }
            Command::Scene { name, seed } => {
                let source = Source::Scene { name, seed };
                let run = RunConfig::default();
                self.session.open_image(source, run, &mut self.attention.firm())?;
                self.changed();
            }
            Command::CommandLine => {
                let folder = self.session.folder().to_path_buf();
                let model = self.session.model_mut().ok_or_else(nothing_open)?;
                let words = model.command_line(&folder, &mut self.attention.firm())?;
                return Ok(Some(quoted(&words)));
            }
        }
        Ok(None)
    }

    fn act(&mut self, gesture: Gesture) -> Result<(), JobError> {
        let kept = match gesture {
            Gesture::Facet { .. }
            | Gesture::Well { .. }
            | Gesture::MoveWell { .. }
            | Gesture::RemoveWell { .. } => Some(Made { flow: false, ..self.made }),
            Gesture::Region { .. }
            | Gesture::NameRegion { .. }
            | Gesture::MergeParts { .. }
            | Gesture::SplitPart { .. } => Some(Made { regions: false, ..self.made }),
            _ => None,
        };
        self.session.act(gesture, &mut self.attention.firm())?;
        match kept {
            Some(made) => {
                self.made = Made { halted: false, ..made };
                self.error = None;
                self.revision += 1;
                self.publish_state();
            }
            None => self.changed(),
        }
        Ok(())
    }

    fn open_dropped(&mut self, name: &str, mut run: RunConfig) -> Result<(), JobError> {
        let path = self.session.folder().join(name);
        let found = sha256(&path)?;
        let sha256 = found.ok_or_else(|| JobError::content("is a folder").about(&path))?;
        run.input = InputOptions::default();
        let source = Source::Dropped { name: name.into(), sha256 };
        self.session.open_image(source, run, &mut self.attention.firm())?;
        self.changed();
        Ok(())
    }

    fn export(&mut self, format: Export) -> Result<PathBuf, JobError> {
        self.drop_atom()?;
        let path = self.session.folder().join(format.file_name());
        let model = self.session.model_mut().ok_or_else(nothing_open)?;
        model.write(&path, &mut self.attention.firm())?;
        Ok(path)
    }

    /// Something else is to be made and shown.
    fn changed(&mut self) {
        self.made = Made::default();
        self.error = None;
        self.revision += 1;
        self.figures = Value::Null;
        self.hub.retract(Kind::Drag);
        let image = self.session.model().map_or(0, |model| each!(model, m => m.opened_at()));
        if image != self.image.1 {
            self.image = (self.image.0 + 1, image);
            // what was made of another image is not shown over this one
            let kinds = [Kind::Mesh, Kind::Atoms, Kind::Facets, Kind::Flow];
            kinds.into_iter().for_each(|kind| self.hub.retract(kind));
        }
        self.exhibit();
        self.publish_state();
    }

    fn has_unmade(&self) -> bool {
        self.session.model().is_some_and(|model| each!(model, m => m.stages().outcome().is_none()))
    }

    // Drags.

    fn drag(&mut self, atom: u32, to: &[f64], reach: f64, revision: u32) -> Result<(), JobError> {
        let is_new = self.drag.as_ref().is_none_or(|drag| drag.atom != atom || drag.reach != reach);
        if is_new {
            self.drop_atom()?;
            if revision != self.atoms_revision || !self.made.atoms {
                return Err(JobError::misuse("the atoms have changed since; try again"));
            }
            self.session.begin_editing();
            let dragged = Dragged::default();
            self.drag = Some(Drag { atom, path: Vec::new(), reach, dragged });
        }
        let revision = self.atoms_revision;
        let (Some(model), Some(drag)) = (self.session.model_mut(), self.drag.as_mut()) else {
            return Err(nothing_open());
        };
        let frame =
            each!(model, model => step(model, drag, to, revision, &mut self.attention.firm()))?;
        drag.path.push(to.to_vec());
        self.hub.publish(Kind::Drag, Frame::Binary(frame.into()));
        Ok(())
    }

    /// Ends a drag, if there is one.
    fn drop_atom(&mut self) -> Result<(), JobError> {
        let Some(Drag { atom, path, reach, .. }) = self.drag.take() else { return Ok(()) };
        if !path.is_empty() {
            self.session.record(Gesture::Move { atom, path, reach })?;
            self.changed();
        }
        Ok(())
    }

    // Work.

    fn work(&mut self) {
        match self.make() {
            Ok(()) => {}
            Err(e) if e.kind() == ErrorKind::Cancelled => {}
            Err(e) => {
                self.error = Some(words(&e));
                self.made.halted = true;
                self.publish_state();
            }
        }
    }

    /// Makes the next thing that is missing, and shows it.
    fn make(&mut self) -> Result<(), JobError> {
        let Some(model) = self.session.model_mut() else { return Ok(()) };
        let watch = &mut self.attention;
        let revision = self.revision;
        if !self.made.fields {
            each!(model, model => model.prepare(watch))?;
            self.made.fields = true;
            self.exhibit();
            self.publish_state();
        } else if !self.made.mesh {
            let (frame, hash) = each!(model, model => make_mesh(model, revision, watch))?;
            self.hash = Some(hash);
            match frame {
                Some(frame) => self.hub.publish(Kind::Mesh, Frame::Binary(frame.into())),
                None => self.hub.retract(Kind::Mesh),
            }
            self.made.mesh = true;
            self.exhibit();
            self.publish_state();
        } else if self.shows_atoms && !self.made.atoms {
            let frame = each!(model, model => make_atoms(model, revision, watch))?;
            self.hub.publish(Kind::Atoms, Frame::Binary(frame.into()));
            self.made.atoms = true;
            self.atoms_revision = revision;
            self.publish_state();
        } else if !self.made.regions {
            let level = self.level;
            self.parts = each!(model, model => make_regions(model, level, watch))?;
            self.made.regions = true;
            self.exhibit();
            self.publish_state();
        } else if !self.made.figures {
            self.figures = each!(model, model => state::figures(model, watch))?;
            self.made.figures = true;
            self.publish_state();
        } else if !self.made.flow {
            let (facets, flow) = each!(model, model => make_flow(model, revision, watch))?;
            self.hub.publish(Kind::Facets, Frame::Binary(facets.into()));
            self.hub.publish(Kind::Flow, Frame::Binary(flow.into()));
            self.made.flow = true;
            self.publish_state();
        }
        Ok(())
    }

    fn exhibit(&mut self) {
        self.shown += 1;
        let parts = self.parts.clone().filter(|_| self.made.regions);
        let shown: Option<Arc<dyn Exhibit>> = self.session.model().and_then(|model| match model {
            AnyModel::Flat(model) => shown(model, self.revision, parts, |_, _| Vec::new()),
            AnyModel::Volume(model) => shown(model, self.revision, parts, region_view::surfaces),
        });
        self.hub.exhibit(shown);
    }

    fn publish_state(&self) {
        let told = state::Told {
            revision: self.revision,
            shown: self.shown,
            image: self.image.0,
            atoms_revision: self.atoms_revision,
            is_busy: self.has_work(),
            has_atoms: self.made.atoms,
            parts: self.parts.as_deref().filter(|_| self.made.regions).map(|parts| count_of(parts)),
            figures: &self.figures,
            hash: self.hash.as_deref().filter(|_| self.made.mesh),
            error: self.error.as_deref(),
        };
        let state = state::state(&self.session, &told);
        self.hub.publish(Kind::State, Frame::Text(state.to_string().into()));
    }
}

fn step<const D: usize>(
    model: &mut Model<D>,
    drag: &mut Drag,
    to: &[f64],
    revision: u32,
    watch: &mut dyn atomesh::watch::Watch,
) -> Result<Vec<u8>, JobError> {
    let changes = model.drag(drag.atom, to, drag.reach, watch)?;
    changes.iter().for_each(|changes| drag.dragged.add(changes));
    let edited = model.edited().ok_or_else(nothing_open)?;
    Ok(drag.dragged.frame(edited, &model.grid(), revision))
}

fn make_mesh<const D: usize>(
    model: &mut Model<D>,
    revision: u32,
    watch: &mut dyn atomesh::watch::Watch,
) -> Result<(Option<Vec<u8>>, String), JobError> {
    let outcome = model.refresh(watch)?;
    let frame = (D == 2).then(|| view::mesh(&outcome, revision));
    Ok((frame, state::hash(&outcome)))
}

fn make_atoms<const D: usize>(
    model: &mut Model<D>,
    revision: u32,
    watch: &mut dyn atomesh::watch::Watch,
) -> Result<Vec<u8>, JobError> {
    let grid = model.grid();
    Ok(view::atoms(model.editor(watch)?, &grid, revision))
}

fn make_flow<const D: usize>(
    model: &mut Model<D>,
    revision: u32,
    watch: &mut dyn atomesh::watch::Watch,
) -> Result<(Vec<u8>, Vec<u8>), JobError> {
    let flow = model.flow(watch)?;
    let grid = model.grid();
    Ok((view::facets(&flow, &grid, revision), view::flow(&flow, &grid, revision)))
}

/// The regions, and the parts of a level if one is shown.
fn make_regions<const D: usize>(
    model: &mut Model<D>,
    level: Option<usize>,
    watch: &mut dyn atomesh::watch::Watch,
) -> Result<Option<Arc<Vec<i32>>>, JobError> {
    model.on_mesh(watch)?;
    level.map(|level| model.parts(level, watch).map(Arc::new)).transpose()
}

fn shown<const D: usize>(
    model: &Model<D>,
    revision: u32,
    parts: Option<Arc<Vec<i32>>>,
    surfaces: Surfaces<D>,
) -> Option<Arc<dyn Exhibit>>
where
    Shown<D>: Exhibit,
{
    let stages = model.stages();
    Some(Arc::new(Shown {
        revision,
        images: stages.images_shared()?,
        grid: model.grid(),
        prepared: stages.prepared().cloned(),
        outcome: stages.outcome(),
        playback: stages.playback(),
        regions: stages.regions(),
        parts,
        surfaces,
    }))
}

fn nothing_open() -> JobError {
    JobError::misuse("no image is open")
}

/// How many parts there are.
fn count_of(parts: &[i32]) -> usize {
    parts.iter().collect::<std::collections::BTreeSet<_>>().len()
}

/// What the user is told.
fn words(error: &JobError) -> String {
    match error.advice() {
        Some(advice) => format!("{error}; {advice}"),
        None => error.to_string(),
    }
}

/// The words of a command, quoted where a shell would part or expand them.
fn quoted(words: &[String]) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_./=,:+".contains(c);
    let quote = |word: &String| match word.chars().all(is_plain) && !word.is_empty() {
        true => word.clone(),
        false => format!("'{}'", word.replace('\'', r"'\''")),
    };
    words.iter().map(quote).collect::<Vec<_>>().join(" ")
}

/// A name that a dropped file may have: letters, digits and `._-`, no dot first, 64 at most.
pub fn plain_name(name: &str) -> String {
    let last = Path::new(name).file_name().map_or_else(Default::default, |n| n.to_string_lossy());
    let is_plain = |c: &char| c.is_ascii_alphanumeric() || "._-".contains(*c);
    let plain: Vec<char> = last.chars().filter(is_plain).collect();
    // what tells the format stands at the end
    let plain: String = plain[plain.len().saturating_sub(64)..].iter().collect();
    plain.trim_start_matches(['.', '-']).to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_dropped_files_are_names_and_no_paths() {
        for (given, plain) in [
            ("faults.png", "faults.png"),
            ("../../etc/passwd", "passwd"),
            (r"C:\x\..\y.png", "Cx..y.png"),
            ("...", ""),
            (".hidden.png", "hidden.png"),
            ("-o.png", "o.png"),
            ("a b\n.png", "ab.png"),
            ("", ""),
        ] {
            assert_eq!(plain_name(given), plain, "{given:?}");
        }
        assert!(plain_name(&("x".repeat(500) + ".nii.gz")).ends_with(".nii.gz"));
    }

    #[test]
    fn a_shell_takes_the_words_as_they_are() {
        let words = ["a", "b c", "it's", "--size=6..18", ""].map(String::from);
        assert_eq!(quoted(&words), r"a 'b c' 'it'\''s' --size=6..18 ''");
    }
}
