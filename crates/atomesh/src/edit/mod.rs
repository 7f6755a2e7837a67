//! Editing a lattice and its mesh, atom by atom.
//!
//! An [`Editor`] holds atoms and their Delaunay mesh. Atoms are added, moved, removed and pinned, and the atoms
//! around a place are optimized again: hot near it, cooler farther off, frozen beyond (Hale 2002: a temperature for
//! each atom). Each edit says what it changed ([`Changes`]). The mesh is always the one that connecting all atoms
//! again would give.
//!
//! Cost: that of the change. The editor keeps the cells' neighbours (`Cells`), and which atoms are near a place.

mod changes;
mod error;
mod relax;
#[cfg(test)]
mod tests;

pub use changes::{AtomMove, Changes};
pub use error::EditError;

use std::fmt;

use crate::geometry::{Bins, Bounds, Point, distance_squared};
use crate::lattice::Lattice;
use crate::mesh::{AtomEdit, CellChanges, Cells, ConnectError, Delaunay, Mesh, in_order};
use crate::watch::Watch;

/// Names an atom as long as its editor lives.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct AtomId(u32);

impl fmt::Display for AtomId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

/// A lattice and its Delaunay mesh, edited atom by atom.
///
/// ```
/// use atomesh::edit::Editor;
/// use atomesh::image::Image;
/// use atomesh::mesh::Delaunay;
/// # use atomesh::fields::NominalDistance;
/// # use atomesh::lattice::{Crystal, GrowOptions, grow};
/// # use atomesh::image::Grid;
/// # use atomesh::watch::Silent;
/// # let grid = Grid { shape: [40, 30], step: [1.0; 2] };
/// # let d = NominalDistance::constant(&grid, 5.0)?;
/// # let options = GrowOptions::default();
/// let lattice = grow(&Crystal::hexagonal(), grid.bounds(), &d, &options, &mut Silent)?;
/// let mut editor = Editor::new(lattice, Delaunay::<2>::new(), &mut Silent)?;
/// let (well, _) = editor.add([12.3, 17.1])?;
/// let changes = editor.move_to(well, [12.8, 17.0])?;
/// assert_eq!(changes.moves().len(), 1);
/// let (mesh, atoms) = editor.mesh()?;
/// assert_eq!(mesh.points().len(), atoms.len());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Editor<const D: usize> {
    delaunay: Delaunay<D>,
    bounds: Bounds<D>,
    /// Atoms by name. The place of a removed atom stays, and its name is not used again.
    points: Vec<Point<D>>,
    states: Vec<State>,
    /// All atoms but the removed ones.
    bins: Bins<D>,
    cells: Cells<D>,
}

/// What is known of an atom besides its place.
#[derive(Clone, Copy, Debug)]
struct State {
    is_removed: bool,
    is_pinned: bool,
    /// Bit k: the box lets the atom move along axis k.
    freedom: u8,
    /// 0 (frozen) to 1 (free).
    temperature: f32,
}

impl State {
    fn temperature_now(&self) -> f32 {
        if self.is_pinned { 0.0 } else { self.temperature }
    }
}

impl<const D: usize> Editor<D> {
    /// Connects the atoms of a lattice. [`Self::atoms`] names them in the lattice's order. They keep their freedom
    /// and temperature.
    ///
    /// # Errors
    /// [`EditError::Connect`] if the atoms make no mesh, or the watch ends the work.
    pub fn new(
        lattice: Lattice<D>,
        delaunay: Delaunay<D>,
        watch: &mut dyn Watch,
    ) -> Result<Self, EditError> {
        let points = lattice.atoms().to_vec();
        let mesh = delaunay.connect(&points, watch).map_err(EditError::Connect)?;
        let state = |atom| State {
            is_removed: false,
            is_pinned: false,
            freedom: lattice.freedom_in_box(atom),
            temperature: lattice.temperature(atom),
        };
        Ok(Self {
            delaunay,
            bounds: *lattice.bounds(),
            states: (0..points.len()).map(state).collect(),
            bins: Bins::of(lattice.bounds(), 0.0, points.iter().copied()),
            cells: Cells::new(&mesh),
            points,
        })
    }

    /// The atoms and where they are, by name; those of the lattice first, in its order.
    pub fn atoms(&self) -> impl Iterator<Item = (AtomId, Point<D>)> {
        let atoms = self.points.iter().zip(&self.states).zip(0..);
        atoms.filter(|((_, state), _)| !state.is_removed).map(|((p, _), i)| (AtomId(i), *p))
    }

    /// Where an atom is.
    ///
    /// # Errors
    /// [`EditError::NoAtom`].
    pub fn place(&self, atom: AtomId) -> Result<Point<D>, EditError> {
        self.state(atom).map(|_| self.points[atom.0 as usize])
    }

    /// Adds an atom; on a side of the box it will stay there.
    ///
    /// # Errors
    /// [`EditError`] if the place is outside the box or another atom's.
    pub fn add(&mut self, at: Point<D>) -> Result<(AtomId, Changes<D>), EditError> {
        self.check_inside(&at)?;
        let atom = self.points.len() as u32;
        self.points.push(at);
        let cells = match self.follow(&[AtomEdit { atom, to: Some(at) }]) {
            Ok(cells) => cells,
            Err(error) => {
                self.points.pop();
                return Err(error);
            }
        };
        let freedom = self.bounds.freedom(&at);
        self.states.push(State { is_removed: false, is_pinned: false, freedom, temperature: 1.0 });
        self.bins.push(&at);
        Ok((AtomId(atom), Changes::new(cells, Vec::new())))
    }

    /// Removes an atom.
    ///
    /// # Errors
    /// [`EditError`] if there is no such atom, it is pinned, or it is a corner of the box.
    pub fn remove(&mut self, atom: AtomId) -> Result<Changes<D>, EditError> {
        let p = self.place_unpinned(atom)?;
        if self.bounds.is_corner(&p) {
            return Err(EditError::Corner { atom });
        }
        let cells = self.follow(&[AtomEdit { atom: atom.0, to: None }])?;
        self.states[atom.0 as usize].is_removed = true;
        self.bins.remove(atom.0 as usize, &p);
        Ok(Changes::new(cells, Vec::new()))
    }

    /// Moves an atom, whatever its temperature. One that lay inside the box and is put on a side stays there from
    /// then on.
    ///
    /// # Errors
    /// [`EditError`] if there is no such atom, it is pinned, the place is outside the box or another atom's, or the
    /// atom would leave its side of the box.
    pub fn move_to(&mut self, atom: AtomId, to: Point<D>) -> Result<Changes<D>, EditError> {
        let from = self.place_unpinned(atom)?;
        self.check_inside(&to)?;
        let held = self.bounds.held(&from);
        if let Some(axis) = (0..D).find(|&k| held >> k & 1 == 1 && to[k] != from[k]) {
            return Err(EditError::Held { atom, axis });
        }
        let unmoved = from == to;
        let edit = AtomEdit { atom: atom.0, to: Some(to) };
        let changes = self.make(if unmoved { &[] } else { std::slice::from_ref(&edit) })?;
        self.states[atom.0 as usize].freedom &= self.bounds.freedom(&to);
        Ok(changes)
    }

    /// Pins an atom where it is: until it is unpinned it is not moved by [`Self::relax`], and [`Self::move_to`] and
    /// [`Self::remove`] refuse it, so that no slip of the hand undoes a place that was chosen with care.
    ///
    /// # Errors
    /// [`EditError::NoAtom`].
    pub fn pin(&mut self, atom: AtomId) -> Result<(), EditError> {
        self.state(atom)?;
        self.states[atom.0 as usize].is_pinned = true;
        Ok(())
    }

    /// Lets a pinned atom go; it has the temperature again that it had.
    ///
    /// # Errors
    /// [`EditError::NoAtom`].
    pub fn unpin(&mut self, atom: AtomId) -> Result<(), EditError> {
        self.state(atom)?;
        self.states[atom.0 as usize].is_pinned = false;
        Ok(())
    }

    /// Whether an atom is pinned.
    ///
    /// # Errors
    /// [`EditError::NoAtom`].
    pub fn is_pinned(&self, atom: AtomId) -> Result<bool, EditError> {
        self.state(atom).map(|state| state.is_pinned)
    }

    /// The atoms as a lattice, in the order of [`Self::atoms`], so that a run can go on from them. They have the
    /// freedom and temperature that they came with; pinned ones are frozen, added ones free.
    pub fn lattice(&self) -> Lattice<D> {
        let mut lattice = Lattice::empty(self.bounds);
        for (AtomId(atom), p) in self.atoms() {
            let state = &self.states[atom as usize];
            lattice.push(p, state.freedom, state.temperature_now());
        }
        lattice
    }

    /// The mesh, and the atom at each of its points. It is what [`Delaunay::connect`] gives for these atoms.
    /// Cost: O(n log n).
    ///
    /// # Errors
    /// [`EditError::Connect`] if the atoms cannot be put in order: they are not finite.
    pub fn mesh(&self) -> Result<(Mesh<D>, Vec<AtomId>), EditError> {
        let (names, points): (Vec<AtomId>, Vec<Point<D>>) = self.atoms().unzip();
        let mut numbers = vec![u32::MAX; self.points.len()];
        names.iter().zip(0..).for_each(|(name, number)| numbers[name.0 as usize] = number);
        let corners = self.cells.all().flatten().map(|&atom| numbers[atom as usize]).collect();
        let mesh = self.delaunay.arrange(points, corners).map_err(EditError::Connect)?;
        Ok((mesh, names))
    }

    /// The corners of all cells, D + 1 a cell, in the order of [`Changes`]: what these are changes of.
    /// Cost: O(n log n).
    pub fn cells(&self) -> Vec<AtomId> {
        let mut corners: Vec<u32> = self.cells.all().flatten().copied().collect();
        let cells = in_order(&mut corners, D + 1);
        cells.into_iter().flatten().map(|&atom| AtomId(atom)).collect()
    }

    /// Moves atoms to where they may be.
    fn make(&mut self, edits: &[AtomEdit<D>]) -> Result<Changes<D>, EditError> {
        let cells = self.follow(edits)?;
        let mut moves = Vec::with_capacity(edits.len());
        for &AtomEdit { atom, to } in edits {
            let Some(to) = to else { continue };
            let from = std::mem::replace(&mut self.points[atom as usize], to);
            self.bins.remove(atom as usize, &from);
            self.bins.put_back(atom as usize, &to);
            moves.push(AtomMove { atom: AtomId(atom), from, to });
        }
        Ok(Changes::new(cells, moves))
    }

    /// Makes the cells follow.
    fn follow(&mut self, edits: &[AtomEdit<D>]) -> Result<CellChanges, EditError> {
        if edits.is_empty() {
            return Ok(CellChanges::default());
        }
        self.cells.follow(&self.delaunay, &self.points, edits).map_err(|error| match error {
            ConnectError::Duplicate { first, second } => {
                let is_edited = |atom: usize| edits.iter().any(|edit| edit.atom as usize == atom);
                let other = if is_edited(first) { second } else { first };
                EditError::Occupied { atom: AtomId(other as u32) }
            }
            error => EditError::Connect(error),
        })
    }

    /// The atoms nearer than `reach` to a place, ascending: in the same order whatever edits led here.
    fn within(&self, around: &Point<D>, reach: f64) -> Vec<u32> {
        let mut atoms = Vec::new();
        self.bins.near(around, reach, |atom| {
            if distance_squared(&self.points[atom], around).sqrt() < reach {
                atoms.push(atom as u32);
            }
        });
        atoms.sort_unstable();
        atoms
    }

    fn state(&self, atom: AtomId) -> Result<&State, EditError> {
        let state = self.states.get(atom.0 as usize).filter(|state| !state.is_removed);
        state.ok_or(EditError::NoAtom { atom })
    }

    /// Where an atom is that may be moved by hand.
    fn place_unpinned(&self, atom: AtomId) -> Result<Point<D>, EditError> {
        if self.state(atom)?.is_pinned {
            return Err(EditError::Pinned { atom });
        }
        Ok(self.points[atom.0 as usize])
    }

    fn check_inside(&self, p: &Point<D>) -> Result<(), EditError> {
        let Bounds { min, max } = self.bounds;
        if (0..D).all(|k| (min[k]..=max[k]).contains(&p[k])) {
            return Ok(());
        }
        Err(EditError::Outside { point: p.to_vec(), min: min.to_vec(), max: max.to_vec() })
    }
}
