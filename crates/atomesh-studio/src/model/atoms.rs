//! Atoms edited by hand (Hale 2002): added, moved, removed, pinned, while those around follow.

use atomesh::edit::{AtomId, Changes, EditError, Editor};
use atomesh::fields::FieldsView;
use atomesh::geometry::{Bounds, Point};
use atomesh::lattice::Lattice;
use atomesh::mesh::Delaunay;
use atomesh::optimize::OptimizeOptions;
use atomesh::watch::{Silent, Watch};
use atomesh_job::JobError;

/// The farthest reach of a drag, over the nominal distance.
const MOST_REACH: f64 = 50.0;

/// Iterations after each step of a drag: the next step goes on from there.
const ITERATIONS: usize = 20;

/// How near to a side of the box an atom may be dragged, over the nominal distance.
const MARGIN: f64 = 0.1;

/// What pulls on atoms.
#[derive(Clone, Copy)]
pub struct Pull<'a, const D: usize> {
    /// The fields.
    pub fields: FieldsView<'a, D>,
    /// How atoms are moved.
    pub options: &'a OptimizeOptions,
}

/// Atoms and their Delaunay mesh, by numbers that pages know.
///
/// An atom's number is its place in the order in which atoms came: those that settled first. Numbers of removed atoms are
/// not used again.
#[derive(Clone, Debug)]
pub struct Edited<const D: usize> {
    editor: Editor<D>,
    bounds: Bounds<D>,
    names: Vec<AtomId>,
    is_edited: bool,
}

impl<const D: usize> Edited<D> {
    /// Atoms that have settled.
    ///
    /// # Errors
    /// [`JobError`] if they cannot be connected, or the watch ends the work.
    pub fn new(
        lattice: Lattice<D>,
        delaunay: Delaunay<D>,
        watch: &mut dyn Watch,
    ) -> Result<Self, JobError> {
        let bounds = *lattice.bounds();
        let editor = Editor::new(lattice, delaunay, watch).map_err(refused)?;
        let names = editor.atoms().map(|(name, _)| name).collect();
        Ok(Self { editor, bounds, names, is_edited: false })
    }

    /// Whether anything was edited.
    pub fn is_edited(&self) -> bool {
        self.is_edited
    }

    /// The atoms as a lattice.
    pub fn lattice(&self) -> Lattice<D> {
        self.editor.lattice()
    }

    /// Where each atom is, by its number, and whether it is pinned; `None` for one that was removed.
    pub fn atoms(&self) -> impl ExactSizeIterator<Item = Option<(Point<D>, bool)>> {
        self.names.iter().map(|name| {
            let place = self.editor.place(*name).ok()?;
            Some((place, self.editor.is_pinned(*name).unwrap_or(false)))
        })
    }

    /// Where an atom is; `None` for one that was removed, or that there is not.
    pub fn place(&self, atom: u32) -> Option<Point<D>> {
        self.names.get(atom as usize).and_then(|name| self.editor.place(*name).ok())
    }

    /// The corners of all cells, D + 1 numbers a cell.
    pub fn cells(&self) -> Vec<u32> {
        self.editor.cells().into_iter().map(|name| self.number(name)).collect()
    }

    /// The number of an atom.
    pub fn number(&self, name: AtomId) -> u32 {
        self.names.partition_point(|own| *own < name) as u32
    }

    pub(super) fn add(&mut self, at: Point<D>) -> Result<(), JobError> {
        let (name, _) = self.editor.add(at).map_err(refused)?;
        self.names.push(name);
        self.is_edited = true;
        Ok(())
    }

    pub(super) fn remove(&mut self, atom: u32) -> Result<(), JobError> {
        self.editor.remove(self.name(atom)?).map_err(refused)?;
        self.is_edited = true;
        Ok(())
    }

    pub(super) fn pin(&mut self, atom: u32, pinned: bool) -> Result<(), JobError> {
        let name = self.name(atom)?;
        let done = if pinned { self.editor.pin(name) } else { self.editor.unpin(name) };
        done.map_err(refused)?;
        self.is_edited = true;
        Ok(())
    }

    /// Moves an atom, and lets those nearer than `reach` nominal distances follow; what changed by the one and the other.
    /// An atom on a side of the box stays on it, and no other comes nearer to a side than a tenth of the nominal distance.
    ///
    /// # Errors
    /// [`JobError`] if it may not be there; nothing has changed then.
    pub(super) fn step(
        &mut self,
        atom: u32,
        to: &Point<D>,
        reach: f64,
        pull: Pull<'_, D>,
    ) -> Result<Vec<Changes<D>>, JobError> {
        if !(0.0..=MOST_REACH).contains(&reach) {
            let message = format!("a reach of {reach} edges; expected 0 to {MOST_REACH}");
            return Err(JobError::misuse(message));
        }
        let name = self.name(atom)?;
        let from = self.editor.place(name).map_err(refused)?;
        let distance = pull.fields.distance.at(to);
        let to = self.allowed(&from, to, MARGIN * distance);
        let moved = self.editor.move_to(name, to).map_err(refused)?;
        let mut changes = vec![moved];
        if reach > 0.0 {
            // the hand holds it
            self.editor.pin(name).map_err(refused)?;
            let options = OptimizeOptions {
                perturbation: 0.0,
                outer_limit: 0,
                inner_limit: pull.options.inner_limit.min(ITERATIONS),
                ..pull.options.clone()
            };
            let reach = reach * distance;
            let relaxed = self.editor.relax(&to, reach, pull.fields, &options, &mut Silent);
            self.editor.unpin(name).map_err(refused)?;
            match relaxed {
                Ok((_, followed)) => changes.push(followed),
                Err(error) => {
                    self.editor.move_to(name, from).map_err(refused)?;
                    return Err(refused(error));
                }
            }
        }
        self.is_edited = true;
        Ok(changes)
    }

    /// The place nearest to `to` where an atom at `from` may be put.
    fn allowed(&self, from: &Point<D>, to: &Point<D>, margin: f64) -> Point<D> {
        let Bounds { min, max } = self.bounds;
        let held = self.bounds.held(from);
        std::array::from_fn(|k| {
            let room = margin.min((max[k] - min[k]) / 4.0);
            if held >> k & 1 == 1 { from[k] } else { to[k].clamp(min[k] + room, max[k] - room) }
        })
    }

    fn name(&self, atom: u32) -> Result<AtomId, JobError> {
        let name = self.names.get(atom as usize).copied();
        name.ok_or_else(|| JobError::misuse(format!("there is no atom {atom}")))
    }
}

fn refused(error: EditError) -> JobError {
    use atomesh::mesh::ConnectError;
    use atomesh::optimize::OptimizeError;
    match error {
        EditError::Connect(ConnectError::Cancelled(_))
        | EditError::Optimize(OptimizeError::Cancelled(_)) => JobError::cancelled(),
        error => JobError::misuse(error),
    }
}
