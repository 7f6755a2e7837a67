//! The cells of a Delaunay mesh, replaced where atoms come, go or move.
//!
//! 1. The *hole* is made of the cells around atoms that go or move, and of those whose circumsphere has an
//!    atom that comes inside it or on it. Other cells have no new point inside and keep their corners, so they
//!    are cells of the new mesh.
//! 2. The atoms of the hole's cells, those that come among them, are connected alone. A cell of the new mesh
//!    within the hole has only such corners, and no other point inside its circumsphere; so it is among the
//!    cells of these alone, as the triangulation is unique, its ties broken by coordinates.
//! 3. Which of them lie in the hole is found from its rim: the facets between the hole and cells that stay.
//!
//! The cost is that of the hole, whatever the mesh's size.

use std::collections::{HashMap, HashSet};

use crate::geometry::{Point, Simplex};
use crate::mesh::{ConnectError, Delaunay, Mesh};
use crate::watch::Silent;

/// No cell: a facet of the hull.
const NONE: u32 = u32::MAX;

/// An atom that comes, goes (`None`) or moves.
pub(super) type Change<const D: usize> = (u32, Option<Point<D>>);

/// Cells with their neighbours, in places that are used again.
#[derive(Clone, Debug)]
pub(super) struct Cells<const D: usize> {
    /// D + 1 corners a place, and the cell beyond the facet that each is off.
    corners: Vec<u32>,
    neighbours: Vec<u32>,
    is_cell: Vec<bool>,
    free: Vec<u32>,
    /// A cell at each atom; `NONE` where there is no atom.
    at_atom: Vec<u32>,
    /// Where the last change was: the next one may be near.
    last: u32,
}

impl<const D: usize> Cells<D> {
    const CORNERS: usize = D + 1;

    /// Those of a Delaunay mesh.
    pub fn new(mesh: &Mesh<D>) -> Self {
        let mut cells = Self {
            corners: mesh.corners().to_vec(),
            neighbours: vec![NONE; mesh.corners().len()],
            is_cell: vec![true; mesh.cell_count()],
            free: Vec::new(),
            at_atom: vec![NONE; mesh.points().len()],
            last: 0,
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

    /// The corners of the facet that a corner of a cell is off, in the order in which a point on the cell's
    /// side makes a positive cell with them, put first.
    fn facet(corners: &[u32], off: usize) -> [u32; D] {
        let mut facet = std::array::from_fn(|k| corners[k + usize::from(k >= off)]);
        if off % 2 == 1 {
            facet.swap(0, 1);
        }
        facet
    }

    /// Replaces the cells where atoms change; `points` are where they were, in places for those that come.
    /// Gives the number of cells replaced.
    ///
    /// # Errors
    /// [`ConnectError::Duplicate`], by the atoms' numbers, if one would come to where another is; nothing has
    /// changed then.
    pub fn change(
        &mut self,
        delaunay: &Delaunay<D>,
        points: &[Point<D>],
        changes: &[Change<D>],
    ) -> Result<usize, ConnectError> {
        let hole = self.hole(points, changes);
        let (atoms, places) = self.atoms_within(&hole, points, changes);
        let mesh = match delaunay.connect(&places, &mut Silent) {
            Ok(mesh) => mesh,
            Err(ConnectError::Duplicate { first, second }) => {
                let [first, second] = [first, second].map(|at| atoms[at] as usize);
                return Err(ConnectError::Duplicate { first, second });
            }
            Err(error) => return Err(error),
        };
        let rim = self.rim(&hole);
        let inside = within(&mesh, &rim, &atoms);
        let count = hole.len();
        for &cell in &hole {
            self.is_cell[cell as usize] = false;
            self.free.push(cell);
        }
        self.at_atom.resize(points.len(), NONE);
        for &(atom, to) in changes {
            if to.is_none() {
                self.at_atom[atom as usize] = NONE;
            }
        }
        self.put(&mesh, &inside, &atoms, rim);
        Ok(count)
    }

    /// The cells that may go, ascending.
    fn hole(&mut self, points: &[Point<D>], changes: &[Change<D>]) -> Vec<u32> {
        let mut hole = HashSet::new();
        for &(atom, to) in changes {
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
        let mut hole: Vec<u32> = hole.into_iter().collect();
        hole.sort_unstable();
        hole
    }

    /// Adds the connected cells of a kind around one of them.
    fn spread(&self, from: u32, hole: &mut HashSet<u32>, is_of: impl Fn(&Self, u32) -> bool) {
        let (mut seen, mut front) = (HashSet::from([from]), vec![from]);
        while let Some(cell) = front.pop() {
            if is_of(self, cell) {
                hole.insert(cell);
                let next = self.neighbours(cell).iter().copied();
                front.extend(next.filter(|&next| next != NONE && seen.insert(next)));
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

    /// The atoms of a hole's cells once they are changed, ascending, and where they are then.
    fn atoms_within(
        &self,
        hole: &[u32],
        points: &[Point<D>],
        changes: &[Change<D>],
    ) -> (Vec<u32>, Vec<Point<D>>) {
        let changed: HashMap<u32, Option<Point<D>>> = changes.iter().copied().collect();
        let known = hole.iter().flat_map(|&cell| self.corners(cell)).copied();
        let mut atoms: Vec<u32> = known.chain(changes.iter().map(|change| change.0)).collect();
        atoms.sort_unstable();
        atoms.dedup();
        atoms.retain(|atom| changed.get(atom) != Some(&None));
        let place = |atom: &u32| changed.get(atom).copied().flatten();
        let at = |atom| place(atom).unwrap_or_else(|| points[*atom as usize]);
        let places = atoms.iter().map(at).collect();
        (atoms, places)
    }

    /// The facets between a hole, ascending, and the cells that stay: as seen from the hole, sorted by corners,
    /// and the cell that stays.
    fn rim(&self, hole: &[u32]) -> HashMap<[u32; D], Rim> {
        let mut rim = HashMap::new();
        for &cell in hole {
            for (off, &beyond) in self.neighbours(cell).iter().enumerate() {
                if beyond != NONE && hole.binary_search(&beyond).is_err() {
                    let (facet, odd) = sorted(Self::facet(self.corners(cell), off));
                    rim.insert(facet, Rim { odd, beyond });
                }
            }
        }
        rim
    }

    /// Puts new cells into places and joins them with each other and with the rim.
    fn put(&mut self, mesh: &Mesh<D>, inside: &[bool], atoms: &[u32], rim: HashMap<[u32; D], Rim>) {
        let mut open: HashMap<[u32; D], u32> =
            rim.into_iter().map(|(facet, rim)| (facet, rim.beyond)).collect();
        for (corners, _) in mesh.cells().zip(inside).filter(|(_, inside)| **inside) {
            let cell = self.free.pop().unwrap_or_else(|| {
                self.is_cell.push(false);
                self.corners.resize(self.corners.len() + Self::CORNERS, NONE);
                self.neighbours.resize(self.corners.len(), NONE);
                (self.is_cell.len() - 1) as u32
            });
            self.is_cell[cell as usize] = true;
            self.last = cell;
            for (k, &corner) in corners.iter().enumerate() {
                let (at, atom) = (cell as usize * Self::CORNERS + k, atoms[corner as usize]);
                (self.corners[at], self.neighbours[at]) = (atom, NONE);
                self.at_atom[atom as usize] = cell;
            }
            for off in 0..Self::CORNERS {
                let (facet, _) = sorted(Self::facet(self.corners(cell), off));
                match open.remove(&facet) {
                    Some(other) => self.join(cell, other, &facet),
                    None => {
                        open.insert(facet, cell);
                    }
                }
            }
        }
    }
}

/// A facet between a hole and a cell that stays.
struct Rim {
    /// Whether sorting its corners took an odd number of swaps, as seen from the hole.
    odd: bool,
    /// The cell that stays.
    beyond: u32,
}

/// Which cells of a mesh of a hole's atoms lie in the hole: all, if it has no rim.
fn within<const D: usize>(
    mesh: &Mesh<D>,
    rim: &HashMap<[u32; D], Rim>,
    atoms: &[u32],
) -> Vec<bool> {
    if rim.is_empty() {
        return vec![true; mesh.cell_count()];
    }
    let cells = Cells::new(mesh);
    let facet = |cell: u32, off: usize| {
        let facet = Cells::<D>::facet(cells.corners(cell), off);
        sorted(facet.map(|corner| atoms[corner as usize]))
    };
    let mut inside = vec![false; mesh.cell_count()];
    let mut front = Vec::new();
    for cell in 0..mesh.cell_count() as u32 {
        let at_rim = (0..=D).any(|off| {
            let (facet, odd) = facet(cell, off);
            rim.get(&facet).is_some_and(|rim| rim.odd == odd)
        });
        if at_rim {
            inside[cell as usize] = true;
            front.push(cell);
        }
    }
    while let Some(cell) = front.pop() {
        for (off, &next) in cells.neighbours(cell).iter().enumerate() {
            if next != NONE && !inside[next as usize] && !rim.contains_key(&facet(cell, off).0) {
                inside[next as usize] = true;
                front.push(next);
            }
        }
    }
    inside
}

/// The corners of a facet in ascending order, and whether this took an odd number of swaps.
fn sorted<const D: usize>(mut facet: [u32; D]) -> ([u32; D], bool) {
    let mut odd = false;
    for end in (1..D).rev() {
        for k in 0..end {
            if facet[k] > facet[k + 1] {
                facet.swap(k, k + 1);
                odd = !odd;
            }
        }
    }
    (facet, odd)
}
