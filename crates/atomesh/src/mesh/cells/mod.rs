//! The cells of a Delaunay mesh, replaced where atoms come, go or move.
//!
//! 1. The *hole* is made of the cells around atoms that go or move, and of the cells whose circumsphere has an
//!    atom that comes inside it or on it. All other cells keep their corners and have no new point inside their
//!    circumsphere, so they are cells of the new mesh.
//! 2. The atoms of the hole's cells, and those that come, are connected alone. A cell of the new mesh
//!    within the hole has only such corners, and no other point inside its circumsphere; so it is among the
//!    cells of these alone, as the triangulation is unique, its ties broken by coordinates.
//! 3. The hole's *rim*, the facets between the hole and cells that stay, tells which of the new cells lie in it.
//!
//! Where many atoms move a little, most cells stay Delaunay's, and the hole is found otherwise (`mend`).
//!
//! Cost: O(cells of the hole), whatever the mesh's size.

mod mend;

use std::collections::HashMap;

use crate::parallel::prelude::*;

use crate::geometry::{Point, Simplex};
use crate::watch::Silent;

use super::cell_changes::{CellChanges, sort_by_swaps};
use super::{ConnectError, Delaunay, Mesh};

/// No cell: a facet of the hull.
const NONE: u32 = u32::MAX;

/// What happens to one atom: it comes, moves or goes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AtomEdit<const D: usize> {
    pub atom: u32,
    /// Where it is afterwards; `None` if it goes.
    pub to: Option<Point<D>>,
}

/// Cells with their neighbours, in places that are used again.
#[derive(Clone, Debug)]
pub(crate) struct Cells<const D: usize> {
    /// D + 1 corners a place, and the cell beyond the facet opposite each.
    corners: Vec<u32>,
    neighbours: Vec<u32>,
    is_cell: Vec<bool>,
    free: Vec<u32>,
    /// A cell at each atom; `NONE` where there is no atom.
    at_atom: Vec<u32>,
    /// Where the last edit was: the next one may be near.
    last: u32,
    seen: Marks,
    in_hole: Marks,
    /// Which of the edits at hand moves each atom; `NONE` between calls.
    edit_of: Vec<u32>,
}

impl<const D: usize> Cells<D> {
    const CORNERS: usize = D + 1;

    /// The cells of a Delaunay mesh.
    pub fn new(mesh: &Mesh<D>) -> Self {
        let mut cells = Self {
            corners: mesh.corners().to_vec(),
            neighbours: vec![NONE; mesh.corners().len()],
            is_cell: vec![true; mesh.cell_count()],
            free: Vec::new(),
            at_atom: vec![NONE; mesh.points().len()],
            last: 0,
            seen: Marks::default(),
            in_hole: Marks::default(),
            edit_of: Vec::new(),
        };
        for facet in mesh.facets() {
            if let Some(neighbour) = facet.neighbour {
                cells.join(facet.cell, neighbour, &facet.corners);
            }
        }
        for (at, &atom) in mesh.corners().iter().enumerate() {
            cells.at_atom[atom as usize] = (at / Self::CORNERS) as u32;
        }
        cells
    }

    /// The corners of all cells, in no particular order.
    pub fn all(&self) -> impl Iterator<Item = &[u32]> {
        let cells = self.corners.chunks_exact(Self::CORNERS).zip(&self.is_cell);
        cells.filter(|(_, is_cell)| **is_cell).map(|(corners, _)| corners)
    }

    /// [`Self::all`], on all threads.
    pub fn par_all(&self) -> impl Parallel<Item = &[u32]> {
        let cells = self.corners.par_chunks_exact(Self::CORNERS).zip(&self.is_cell);
        cells.filter(|(_, is_cell)| **is_cell).map(|(corners, _)| corners)
    }

    fn corners(&self, cell: u32) -> &[u32] {
        &self.corners[cell as usize * Self::CORNERS..][..Self::CORNERS]
    }

    fn neighbours(&self, cell: u32) -> &[u32] {
        &self.neighbours[cell as usize * Self::CORNERS..][..Self::CORNERS]
    }

    /// Makes two cells neighbours across a facet.
    fn join(&mut self, a: u32, b: u32, facet: &[u32]) {
        for (one, other) in [(a, b), (b, a)] {
            let off = self.corners(one).iter().position(|corner| !facet.contains(corner));
            let off = off.expect("a cell has a corner off each facet");
            self.neighbours[one as usize * Self::CORNERS + off] = other;
        }
    }

    fn simplex(&self, points: &[Point<D>], cell: u32) -> Simplex<D> {
        let corners = self.corners(cell);
        let at = |k: usize| points[corners[k] as usize];
        Simplex { first: at(0), others: std::array::from_fn(|k| at(k + 1)) }
    }

    /// The corners of the facet opposite corner `off` of a cell, in the order that makes (p, facet) a positive
    /// cell for any point p on the cell's side.
    fn facet(corners: &[u32], off: usize) -> [u32; D] {
        let mut facet = std::array::from_fn(|k| corners[k + usize::from(k >= off)]);
        if off % 2 == 1 {
            facet.swap(0, 1);
        }
        facet
    }

    /// Makes the mesh follow some edits of its atoms; `points` are where the atoms were, with room for those
    /// that come. Gives the cells that are no more and those that are new.
    ///
    /// # Errors
    /// [`ConnectError::Duplicate`], by the atoms' numbers, if an atom would come to where another is; nothing
    /// has changed then.
    pub fn follow(
        &mut self,
        delaunay: &Delaunay<D>,
        points: &[Point<D>],
        edits: &[AtomEdit<D>],
    ) -> Result<CellChanges, ConnectError> {
        if let Some(changes) = self.mend(delaunay, points, edits)? {
            return Ok(changes);
        }
        let hole = self.hole(points, edits);
        let rim = self.rim(&hole);
        let (atoms, places) = self.atoms_within(&hole, points, edits);
        let filling = Filling::of_atoms(delaunay, atoms, &places, &rim)?;
        self.at_atom.resize(points.len(), NONE);
        for edit in edits.iter().filter(|edit| edit.to.is_none()) {
            self.at_atom[edit.atom as usize] = NONE;
        }
        Ok(self.refill(&hole, &rim, &filling))
    }

    /// Puts a filling in place of a hole; what has changed.
    fn refill(&mut self, hole: &[u32], rim: &Rim<D>, filling: &Filling<D>) -> CellChanges {
        let removed = hole.iter().flat_map(|&cell| self.corners(cell)).copied().collect();
        for &cell in hole {
            self.is_cell[cell as usize] = false;
            self.free.push(cell);
        }
        self.fill(filling, rim);
        CellChanges::between(removed, filling.added(), Self::CORNERS)
    }

    /// The cells that may go, ascending.
    fn hole(&mut self, points: &[Point<D>], edits: &[AtomEdit<D>]) -> Vec<u32> {
        let mut hole = Vec::new();
        self.in_hole.begin(self.is_cell.len());
        for &AtomEdit { atom, to } in edits {
            let known = self.at_atom.get(atom as usize).copied().unwrap_or(NONE);
            if known != NONE {
                self.last = known;
                self.spread(known, &mut hole, |cells, cell| cells.corners(cell).contains(&atom));
            }
            if let Some(to) = to {
                let holder = self.locate(points, &to);
                self.last = holder;
                self.spread(holder, &mut hole, |cells, cell| {
                    cells.simplex(points, cell).in_sphere(&to) >= 0.0
                });
            }
        }
        hole.sort_unstable();
        hole
    }

    /// Adds the connected cells of a kind around one of them to the hole.
    fn spread(&mut self, from: u32, hole: &mut Vec<u32>, is_of: impl Fn(&Self, u32) -> bool) {
        self.seen.begin(self.is_cell.len());
        self.seen.mark(from);
        let mut front = vec![from];
        while let Some(cell) = front.pop() {
            if !is_of(self, cell) {
                continue;
            }
            if self.in_hole.mark(cell) {
                hole.push(cell);
            }
            for at in cell as usize * Self::CORNERS..(cell as usize + 1) * Self::CORNERS {
                let next = self.neighbours[at];
                if next != NONE && self.seen.mark(next) {
                    front.push(next);
                }
            }
        }
    }

    /// A cell that has the point, of the box, inside it or on its boundary. Walks from cell to cell, always
    /// through a facet that the point is beyond: in a Delaunay mesh no cell comes twice (Edelsbrunner 1990).
    fn locate(&self, points: &[Point<D>], p: &Point<D>) -> u32 {
        let mut cell = self.last;
        loop {
            let corners = self.corners(cell);
            let beyond = (0..Self::CORNERS).find(|&off| {
                let facet = Self::facet(corners, off).map(|corner| points[corner as usize]);
                let side = Simplex { first: *p, others: facet };
                side.orientation() < 0.0 && self.neighbours(cell)[off] != NONE
            });
            match beyond {
                Some(off) => cell = self.neighbours(cell)[off],
                None => return cell,
            }
        }
    }

    /// The atoms of a hole's cells after the edits, ascending, and where they are then.
    fn atoms_within(
        &self,
        hole: &[u32],
        points: &[Point<D>],
        edits: &[AtomEdit<D>],
    ) -> (Vec<u32>, Vec<Point<D>>) {
        let edited: HashMap<u32, Option<Point<D>>> = edits.iter().map(|e| (e.atom, e.to)).collect();
        let known = hole.iter().flat_map(|&cell| self.corners(cell)).copied();
        let mut atoms: Vec<u32> = known.chain(edits.iter().map(|edit| edit.atom)).collect();
        atoms.sort_unstable();
        atoms.dedup();
        atoms.retain(|atom| edited.get(atom) != Some(&None));
        let place = |atom: &u32| edited.get(atom).copied().flatten();
        let at = |atom| place(atom).unwrap_or_else(|| points[*atom as usize]);
        let places = atoms.iter().map(at).collect();
        (atoms, places)
    }

    /// The rim of the hole.
    fn rim(&self, hole: &[u32]) -> Rim<D> {
        let mut rim = HashMap::new();
        for &cell in hole {
            for (off, &beyond) in self.neighbours(cell).iter().enumerate() {
                if beyond != NONE && !self.in_hole.has(beyond) {
                    let (facet, odd) = sorted(Self::facet(self.corners(cell), off));
                    rim.insert(facet, RimFacet { odd, beyond });
                }
            }
        }
        rim
    }

    /// Puts a filling's cells into places, and joins them with each other and across the rim.
    fn fill(&mut self, filling: &Filling<D>, rim: &Rim<D>) {
        let mut places = vec![NONE; filling.inside.len()];
        for (place, _) in places.iter_mut().zip(&filling.inside).filter(|(_, inside)| **inside) {
            *place = self.place();
        }
        for (new, &cell) in (0..).zip(&places).filter(|(_, cell)| **cell != NONE) {
            self.last = cell;
            let start = cell as usize * Self::CORNERS;
            for (off, &corner) in filling.cells.corners(new).iter().enumerate() {
                let atom = filling.atoms[corner as usize];
                self.corners[start + off] = atom;
                self.at_atom[atom as usize] = cell;
            }
            for (off, &next) in filling.cells.neighbours(new).iter().enumerate() {
                let next = if next == NONE { NONE } else { places[next as usize] };
                self.neighbours[start + off] = next;
                if next == NONE {
                    let (facet, _) = sorted(Self::facet(self.corners(cell), off));
                    if let Some(RimFacet { beyond, .. }) = rim.get(&facet) {
                        self.join(cell, *beyond, &facet);
                    }
                }
            }
        }
    }

    /// A place for a new cell.
    fn place(&mut self) -> u32 {
        let cell = self.free.pop().unwrap_or_else(|| {
            self.is_cell.push(false);
            self.corners.resize(self.corners.len() + Self::CORNERS, NONE);
            self.neighbours.resize(self.corners.len(), NONE);
            (self.is_cell.len() - 1) as u32
        });
        self.is_cell[cell as usize] = true;
        cell
    }
}

/// The facets between a hole and the cells that stay, by their corners in ascending order.
type Rim<const D: usize> = HashMap<[u32; D], RimFacet>;

/// A facet between a hole and a cell that stays.
struct RimFacet {
    /// Whether sorting its corners took an odd number of swaps, as seen from the hole.
    odd: bool,
    /// The cell that stays.
    beyond: u32,
}

/// The Delaunay cells of a hole's atoms.
struct Filling<const D: usize> {
    /// The atom at each of their points.
    atoms: Vec<u32>,
    cells: Cells<D>,
    /// Which of the cells lie in the hole.
    inside: Vec<bool>,
}

impl<const D: usize> Filling<D> {
    /// Connects the atoms of a hole, which are at these places.
    ///
    /// # Errors
    /// As [`Cells::follow`].
    fn of_atoms(
        delaunay: &Delaunay<D>,
        atoms: Vec<u32>,
        places: &[Point<D>],
        rim: &Rim<D>,
    ) -> Result<Self, ConnectError> {
        match delaunay.connect(places, &mut Silent) {
            Ok(mesh) => Ok(Self::new(&mesh, atoms, rim)),
            Err(ConnectError::Duplicate { first, second }) => {
                let [first, second] = [first, second].map(|at| atoms[at] as usize);
                Err(ConnectError::Duplicate { first, second })
            }
            Err(error) => Err(error),
        }
    }

    /// The cells of a mesh of `atoms`; all lie in the hole if it has no rim.
    fn new(mesh: &Mesh<D>, atoms: Vec<u32>, rim: &Rim<D>) -> Self {
        let inside = vec![rim.is_empty(); mesh.cell_count()];
        let mut filling = Self { atoms, cells: Cells::new(mesh), inside };
        filling.spread_from(rim);
        filling
    }

    /// Marks the cells at the rim that lie on the hole's side of it, and those connected with them.
    fn spread_from(&mut self, rim: &Rim<D>) {
        let mut on_rim = vec![false; self.atoms.len()];
        for atom in rim.keys().flatten() {
            if let Ok(point) = self.atoms.binary_search(atom) {
                on_rim[point] = true;
            }
        }
        let mut front = Vec::new();
        for cell in 0..self.inside.len() as u32 {
            let corners = self.cells.corners(cell);
            let at_rim = (0..=D).any(|off| {
                let may_be = (0..=D).all(|k| k == off || on_rim[corners[k] as usize]);
                may_be && {
                    let (facet, odd) = self.facet(cell, off);
                    rim.get(&facet).is_some_and(|rim| rim.odd == odd)
                }
            });
            if at_rim {
                self.inside[cell as usize] = true;
                front.push(cell);
            }
        }
        while let Some(cell) = front.pop() {
            for off in 0..=D {
                let next = self.cells.neighbours(cell)[off];
                let is_new = next != NONE && !self.inside[next as usize];
                if is_new && !rim.contains_key(&self.facet(cell, off).0) {
                    self.inside[next as usize] = true;
                    front.push(next);
                }
            }
        }
    }

    /// A facet's atoms in ascending order, and whether sorting them took an odd number of swaps.
    fn facet(&self, cell: u32, off: usize) -> ([u32; D], bool) {
        let facet = Cells::<D>::facet(self.cells.corners(cell), off);
        sorted(facet.map(|corner| self.atoms[corner as usize]))
    }

    /// The cells that lie in the hole.
    fn cells_inside(&self) -> impl Iterator<Item = u32> {
        (0..self.inside.len() as u32).filter(|&cell| self.inside[cell as usize])
    }

    /// The corners of the cells in the hole, as atoms.
    fn added(&self) -> Vec<u32> {
        let corners = self.cells_inside().flat_map(|cell| self.cells.corners(cell));
        corners.map(|&corner| self.atoms[corner as usize]).collect()
    }
}

/// The cells met in a search; a new search forgets them all at once.
#[derive(Clone, Debug, Default)]
struct Marks {
    /// The last search that met each cell.
    met: Vec<u32>,
    search: u32,
}

impl Marks {
    /// Begins a search among so many cells.
    fn begin(&mut self, cell_count: usize) {
        if self.search == u32::MAX {
            self.met.fill(0);
            self.search = 0;
        }
        self.search += 1;
        self.met.resize(cell_count, 0);
    }

    /// Marks a cell; whether it had not been marked yet.
    fn mark(&mut self, cell: u32) -> bool {
        std::mem::replace(&mut self.met[cell as usize], self.search) != self.search
    }

    fn has(&self, cell: u32) -> bool {
        self.met[cell as usize] == self.search
    }
}

/// The corners of a facet in ascending order, and whether this took an odd number of swaps.
fn sorted<const D: usize>(mut facet: [u32; D]) -> ([u32; D], bool) {
    let odd = sort_by_swaps(&mut facet);
    (facet, odd)
}
