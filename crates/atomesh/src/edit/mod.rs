//! Editing a lattice and its mesh, atom by atom.
//!
//! An [`Editor`] holds atoms and their Delaunay mesh. Atoms are added, moved and removed, and those around a
//! place are optimized again: hot near it, cooler farther off, frozen beyond (Hale 2002: a temperature for each
//! atom). The mesh follows at the cost of the change, and is always what connecting all atoms anew would give.

mod cells;
#[cfg(test)]
mod tests;

use crate::energy::pair;
use crate::fields::FieldsView;
use crate::geometry::{Bounds, Point, distance_squared};
use crate::lattice::Lattice;
use crate::mesh::{ConnectError, Delaunay, Mesh};
use crate::optimize::{OptimizeError, OptimizeOptions, OptimizeReport, optimize};
use crate::watch::Watch;

use cells::{Cells, Change};

/// Names an atom as long as its editor lives.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct AtomId(u32);

/// Why an edit was not made; nothing has changed then.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum EditError {
    /// There is no such atom, or no longer.
    #[error("there is no atom {}; it may have been removed", .atom.0)]
    NoAtom {
        /// The name used.
        atom: AtomId,
    },
    /// A place outside the box, or not finite.
    #[error("the place {point:?} is outside the box from {min:?} to {max:?}")]
    Outside {
        /// The place.
        point: Vec<f64>,
        /// The box's low corner.
        min: Vec<f64>,
        /// The box's high corner.
        max: Vec<f64>,
    },
    /// An atom would leave the corner, edge or side of the box that it keeps.
    #[error(
        "atom {} would move along {}; the box holds it there", .atom.0, ["x", "y", "z"][*axis]
    )]
    Held {
        /// The atom.
        atom: AtomId,
        /// 0 for x, 1 for y, 2 for z.
        axis: usize,
    },
    /// A corner of the box would be without an atom.
    #[error("atom {} is a corner of the box; the mesh needs it", .atom.0)]
    Corner {
        /// The atom.
        atom: AtomId,
    },
    /// Another atom is there.
    #[error("atom {} is at this place already", .atom.0)]
    Occupied {
        /// The other atom.
        atom: AtomId,
    },
    /// The reach of an optimization is no length.
    #[error("the reach is {value}; expected a length above 0")]
    Reach {
        /// The length asked for.
        value: f64,
    },
    /// The atoms could not be optimized.
    #[error(transparent)]
    Optimize(#[from] OptimizeError),
    /// The atoms could not be connected.
    #[error(transparent)]
    Connect(ConnectError),
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
/// let well = editor.add([12.3, 17.1])?;
/// editor.move_to(well, [12.8, 17.0])?;
/// let (mesh, atoms) = editor.mesh()?;
/// assert_eq!(mesh.points().len(), atoms.len());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Editor<const D: usize> {
    delaunay: Delaunay<D>,
    bounds: Bounds<D>,
    /// Atoms by name; where one has been removed its place stays, and is not used again.
    points: Vec<Point<D>>,
    is_atom: Vec<bool>,
    /// Bit k: the box lets the atom move along axis k; 0 for an atom that is fixed otherwise too.
    freedom: Vec<u8>,
    cells: Cells<D>,
}

impl<const D: usize> Editor<D> {
    /// Connects the atoms of a lattice. Atom i of the lattice has the name `names[i]` of
    /// [`Self::atoms`]; those that its temperature freezes stay fixed.
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
        let own: Vec<u32> = (0..points.len() as u32).collect();
        Ok(Self {
            delaunay,
            bounds: *lattice.bounds(),
            freedom: lattice.freedom_of(&own, points.len()),
            is_atom: vec![true; points.len()],
            cells: Cells::new(&mesh),
            points,
        })
    }

    /// The atoms and where they are, by name; those of the lattice first, in its order.
    pub fn atoms(&self) -> impl Iterator<Item = (AtomId, Point<D>)> {
        let atoms = self.points.iter().zip(&self.is_atom).zip(0..);
        atoms.filter(|((_, is_atom), _)| **is_atom).map(|((p, _), i)| (AtomId(i), *p))
    }

    /// Where an atom is.
    ///
    /// # Errors
    /// [`EditError::NoAtom`].
    pub fn place(&self, atom: AtomId) -> Result<Point<D>, EditError> {
        match self.is_atom.get(atom.0 as usize) {
            Some(true) => Ok(self.points[atom.0 as usize]),
            _ => Err(EditError::NoAtom { atom }),
        }
    }

    /// Adds an atom; on a side of the box it will stay there.
    ///
    /// # Errors
    /// [`EditError`] if the place is outside the box or another atom's.
    pub fn add(&mut self, at: Point<D>) -> Result<AtomId, EditError> {
        self.check_inside(&at)?;
        let atom = self.points.len() as u32;
        self.points.push(at);
        if let Err(error) = self.change(&[(atom, Some(at))]) {
            self.points.pop();
            return Err(error);
        }
        self.is_atom.push(true);
        self.freedom.push(self.bounds.freedom(&at));
        Ok(AtomId(atom))
    }

    /// Removes an atom.
    ///
    /// # Errors
    /// [`EditError`] if there is no such atom, or it is a corner of the box.
    pub fn remove(&mut self, atom: AtomId) -> Result<(), EditError> {
        let p = self.place(atom)?;
        if self.bounds.is_corner(&p) {
            return Err(EditError::Corner { atom });
        }
        self.change(&[(atom.0, None)])?;
        self.is_atom[atom.0 as usize] = false;
        Ok(())
    }

    /// Moves an atom. One that lay inside the box and is put on a side stays there from then on.
    ///
    /// # Errors
    /// [`EditError`] if there is no such atom, the place is outside the box or another atom's, or the atom
    /// would leave its side of the box.
    pub fn move_to(&mut self, atom: AtomId, to: Point<D>) -> Result<(), EditError> {
        let from = self.place(atom)?;
        self.check_inside(&to)?;
        let held = self.bounds.held(&from);
        if let Some(axis) = (0..D).find(|&k| held >> k & 1 == 1 && to[k] != from[k]) {
            return Err(EditError::Held { atom, axis });
        }
        if from != to {
            self.change(&[(atom.0, Some(to))])?;
            self.points[atom.0 as usize] = to;
            self.freedom[atom.0 as usize] &= self.bounds.freedom(&to);
        }
        Ok(())
    }

    /// Optimizes the atoms around a place again. With s = r/reach at a distance r, an atom's temperature is
    /// 1 − 3s² + 2s³, falling smoothly from 1 to 0 at `reach` (Hale 2002); beyond it atoms are frozen, and those
    /// near enough are felt. Cost: that of the atoms within reach.
    ///
    /// # Errors
    /// [`EditError`] if the reach is no length, an option is out of range, or the watch ends the work.
    pub fn relax(
        &mut self,
        around: &Point<D>,
        reach: f64,
        fields: FieldsView<'_, D>,
        options: &OptimizeOptions,
        watch: &mut dyn Watch,
    ) -> Result<OptimizeReport, EditError> {
        if !(reach > 0.0 && reach.is_finite()) {
            return Err(EditError::Reach { value: reach });
        }
        // atoms at the rim may move by as much again before they meet one that is left out
        let felt = reach + 2.0 * pair::CUTOFF * fields.distance.greatest();
        let mut part = Lattice::empty(self.bounds);
        let mut names = Vec::new();
        for (AtomId(atom), p) in self.atoms() {
            let r = distance_squared(&p, around).sqrt();
            if r < felt {
                let s = (r / reach).min(1.0);
                let temperature = (1.0 - s * s * (3.0 - 2.0 * s)) as f32;
                part.push(p, self.freedom[atom as usize], temperature.clamp(0.0, 1.0));
                names.push(atom);
            }
        }
        let (part, report) = optimize(part, fields, options, watch)?.into_parts();
        let moved = |(&atom, to): (&u32, &Point<D>)| {
            (self.points[atom as usize] != *to).then_some((atom, Some(*to)))
        };
        let changes: Vec<Change<D>> = names.iter().zip(part.atoms()).filter_map(moved).collect();
        self.change(&changes)?;
        for (atom, to) in changes {
            self.points[atom as usize] = to.unwrap_or(self.points[atom as usize]);
        }
        Ok(report)
    }

    /// The mesh, and the atom at each of its points. It is what [`Delaunay::connect`] gives for these atoms.
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

    fn change(&mut self, changes: &[Change<D>]) -> Result<(), EditError> {
        if changes.is_empty() {
            return Ok(());
        }
        match self.cells.change(&self.delaunay, &self.points, changes) {
            Ok(_) => Ok(()),
            Err(ConnectError::Duplicate { first, second }) => {
                let changed = |atom: usize| changes.iter().any(|c| c.0 as usize == atom);
                let other = if changed(first) { second } else { first };
                Err(EditError::Occupied { atom: AtomId(other as u32) })
            }
            Err(error) => Err(EditError::Connect(error)),
        }
    }

    fn check_inside(&self, p: &Point<D>) -> Result<(), EditError> {
        if self.bounds.contains(p) {
            return Ok(());
        }
        let Bounds { min, max } = self.bounds;
        Err(EditError::Outside { point: p.to_vec(), min: min.to_vec(), max: max.to_vec() })
    }
}
