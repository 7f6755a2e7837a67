//! Cells replaced where many atoms move a little.
//!
//! As long as all cells keep a positive orientation they fill the box as before. Then they are Delaunay's if of each two
//! neighbours neither has the other's corner inside its circumsphere or on it (Delaunay's lemma); only cells around moved
//! atoms need be looked at. The hole is made of the cells of which this does not hold, and of those next to them. It is filled
//! as in [`Cells::follow`]; where the filling does not end at the hole's rim, or a cell beyond it is no longer Delaunay's, the
//! hole grows and is filled again. What has not come to an end soon, or where an atom has left the hole, is left to the other
//! way.
//!
//! Cost: one test for each cell around a moved atom and each of its facets; what is connected is a small part of them.

use std::collections::HashMap;

use super::{Cells, Filling, NONE, Rim};
use crate::geometry::{Point, Simplex};
use crate::mesh::cell_changes::CellChanges;
use crate::mesh::cells::AtomEdit;
use crate::mesh::{ConnectError, Delaunay};

/// From so many edits on most cells around them stay.
const MANY: usize = 8;

/// How often a hole may grow.
const ROUNDS: usize = 12;

/// Where atoms are after the edits.
struct Places<'a, const D: usize> {
    points: &'a [Point<D>],
    edits: &'a [AtomEdit<D>],
    edit_of: &'a [u32],
}

impl<const D: usize> Places<'_, D> {
    fn of(&self, atom: u32) -> Point<D> {
        match self.edit_of[atom as usize] {
            NONE => self.points[atom as usize],
            edit => self.edits[edit as usize].to.unwrap_or(self.points[atom as usize]),
        }
    }

    fn simplex(&self, corners: &[u32]) -> Simplex<D> {
        let at = |k: usize| self.of(corners[k]);
        Simplex { first: at(0), others: std::array::from_fn(|k| at(k + 1)) }
    }
}

impl<const D: usize> Cells<D> {
    /// [`Cells::follow`] of many small moves; `None`, and nothing changed, if they are few, not moves alone, or not small.
    pub(super) fn mend(
        &mut self,
        delaunay: &Delaunay<D>,
        points: &[Point<D>],
        edits: &[AtomEdit<D>],
    ) -> Result<Option<CellChanges>, ConnectError> {
        let is_move = |edit: &AtomEdit<D>| {
            let known = self.at_atom.get(edit.atom as usize).is_some_and(|cell| *cell != NONE);
            known && edit.to.is_some()
        };
        if edits.len() < MANY || !edits.iter().all(is_move) {
            return Ok(None);
        }
        let mut edit_of = std::mem::take(&mut self.edit_of);
        edit_of.resize(points.len().max(edit_of.len()), NONE);
        for (edit, number) in edits.iter().zip(0..) {
            edit_of[edit.atom as usize] = number;
        }
        let mended = self.mend_at(delaunay, &Places { points, edits, edit_of: &edit_of });
        for edit in edits {
            edit_of[edit.atom as usize] = NONE;
        }
        self.edit_of = edit_of;
        mended
    }

    fn mend_at(
        &mut self,
        delaunay: &Delaunay<D>,
        places: &Places<'_, D>,
    ) -> Result<Option<CellChanges>, ConnectError> {
        let around = self.around(places.edits);
        let mut more = self.not_delaunay(&around, places);
        if more.is_empty() {
            return Ok(Some(CellChanges::default()));
        }
        let mut hole = Vec::new();
        self.in_hole.begin(self.is_cell.len());
        for _ in 0..ROUNDS {
            for cell in more {
                if self.in_hole.mark(cell) {
                    hole.push(cell);
                }
            }
            hole.sort_unstable();
            let rim = self.rim(&hole);
            let mut atoms: Vec<u32> =
                hole.iter().flat_map(|&cell| self.corners(cell)).copied().collect();
            atoms.sort_unstable();
            atoms.dedup();
            let at: Vec<Point<D>> = atoms.iter().map(|&atom| places.of(atom)).collect();
            let filling = match Filling::of_atoms(delaunay, atoms, &at, &rim) {
                Ok(filling) => filling,
                Err(error @ ConnectError::Duplicate { .. }) => return Err(error),
                Err(_) => return Ok(None),
            };
            more = self.beyond_reach(&filling, &rim, places);
            if more.is_empty() {
                // an atom may have left the hole
                let is_whole = filling.has_all_atoms();
                return Ok(is_whole.then(|| self.refill(&hole, &rim, &filling)));
            }
        }
        Ok(None)
    }

    /// The cells around moved atoms, each once.
    fn around(&mut self, edits: &[AtomEdit<D>]) -> Vec<u32> {
        let mut around = Vec::new();
        self.in_hole.begin(self.is_cell.len());
        for edit in edits {
            let known = self.at_atom[edit.atom as usize];
            self.spread(known, &mut around, |cells, cell| cells.corners(cell).contains(&edit.atom));
        }
        around
    }

    /// Of these cells those that are not Delaunay's any more, and all cells next to such; some may come twice.
    fn not_delaunay(&self, around: &[u32], places: &Places<'_, D>) -> Vec<u32> {
        let mut found = Vec::new();
        let mut add = |cell: u32| {
            found.push(cell);
            found.extend(self.neighbours(cell).iter().filter(|next| **next != NONE));
        };
        for &cell in around {
            let simplex = places.simplex(self.corners(cell));
            if simplex.orientation() <= 0.0 {
                add(cell);
                continue;
            }
            for &next in self.neighbours(cell) {
                if next == NONE {
                    continue;
                }
                let corners = self.corners(cell);
                let opposite = self.corners(next).iter().find(|atom| !corners.contains(atom));
                if opposite.is_none_or(|&atom| simplex.in_sphere(&places.of(atom)) >= 0.0) {
                    add(cell);
                    add(next);
                }
            }
        }
        found
    }

    /// The cells beyond a rim by which the hole has to grow: where the filling has no cell at the rim, or one whose corner
    /// lies in the circumsphere of the cell beyond.
    fn beyond_reach(&self, filling: &Filling<D>, rim: &Rim<D>, places: &Places<'_, D>) -> Vec<u32> {
        // the corner of the filling opposite each facet of the rim
        let mut opposite: HashMap<[u32; D], u32> = HashMap::new();
        for cell in filling.cells_inside() {
            for off in 0..=D {
                let (facet, odd) = filling.facet(cell, off);
                if rim.get(&facet).is_some_and(|rim| rim.odd == odd) {
                    let corner = filling.cells.corners(cell)[off];
                    opposite.insert(facet, filling.atoms[corner as usize]);
                }
            }
        }
        let is_reached = |facet: &[u32; D], beyond: u32| {
            let simplex = places.simplex(self.corners(beyond));
            let corner = opposite.get(facet);
            corner.is_some_and(|&atom| simplex.in_sphere(&places.of(atom)) < 0.0)
        };
        let facets = rim.iter().filter(|(facet, rim)| !is_reached(facet, rim.beyond));
        let mut more: Vec<u32> = facets.map(|(_, rim)| rim.beyond).collect();
        more.sort_unstable();
        more.dedup();
        more
    }
}

impl<const D: usize> Filling<D> {
    /// Whether each of its atoms is a corner of a cell in the hole.
    fn has_all_atoms(&self) -> bool {
        let mut is_corner = vec![false; self.atoms.len()];
        for cell in self.cells_inside() {
            for &corner in self.cells.corners(cell) {
                is_corner[corner as usize] = true;
            }
        }
        is_corner.into_iter().all(|is| is)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Mesh;
    use crate::mesh::cell_changes::in_order;
    use crate::watch::Silent;
    use proptest::prelude::*;
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    /// A grid of points over a box, rows shifted so that cells are not those of cubes; sides are kept.
    fn grid<const D: usize>(side: usize) -> Vec<Point<D>> {
        let last = (side - 1) as f64;
        let place = |i: usize| -> Point<D> {
            let index: [usize; D] = std::array::from_fn(|k| i / side.pow(k as u32) % side);
            std::array::from_fn(|k| {
                let x = index[k] as f64;
                let is_inside = 0.0 < x && x < last;
                let shift = if is_inside && index[(k + 1) % D] % 2 == 1 { 0.31 } else { 0.0 };
                x + shift
            })
        };
        (0..side.pow(D as u32)).map(place).collect()
    }

    /// Moves many points again and again, within the box and along its sides; after each step the cells have to be those of
    /// connecting all points anew. Gives how many of the steps were mended.
    fn follow_moves<const D: usize>(
        delaunay: &Delaunay<D>,
        side: usize,
        reach: f64,
        seed: u64,
    ) -> usize {
        let mut points = grid::<D>(side);
        let last = (side - 1) as f64;
        let connect = |points: &[Point<D>]| -> Mesh<D> {
            delaunay.connect(points, &mut Silent).expect("distinct points")
        };
        let mut cells = Cells::new(&connect(&points));
        let mut random = Pcg64Mcg::seed_from_u64(seed);
        let mut mended = 0;
        for _ in 0..6 {
            let moved = (0..points.len() as u32).filter(|_| random.random::<f64>() < 0.4);
            let moved: Vec<u32> = moved.collect();
            let edits: Vec<AtomEdit<D>> = moved
                .iter()
                .map(|&atom| {
                    let p = points[atom as usize];
                    let to = std::array::from_fn(|k| {
                        let off = reach * (random.random::<f64>() - 0.5);
                        let is_held = p[k] == 0.0 || p[k] == last;
                        if is_held { p[k] } else { (p[k] + off).clamp(0.01, last - 0.01) }
                    });
                    AtomEdit { atom, to: Some(to) }
                })
                .collect();
            let before: Vec<u32> = cells.all().flatten().copied().collect();
            let trial = cells.clone().mend(delaunay, &points, &edits).expect("distinct places");
            mended += usize::from(trial.is_some());
            let changes = cells.follow(delaunay, &points, &edits).expect("distinct places");
            for AtomEdit { atom, to } in edits {
                points[atom as usize] = to.expect("a move");
            }
            let mut now: Vec<u32> = cells.all().flatten().copied().collect();
            let mut anew = connect(&points).corners().to_vec();
            assert_eq!(CellChanges::between(before, now.clone(), D + 1), changes);
            assert_eq!(in_order(&mut now, D + 1), in_order(&mut anew, D + 1));
            for cell in (0..cells.is_cell.len() as u32).filter(|&c| cells.is_cell[c as usize]) {
                for &next in cells.neighbours(cell).iter().filter(|next| **next != NONE) {
                    assert!(cells.neighbours(next).contains(&cell), "neighbours know each other");
                }
            }
        }
        mended
    }

    #[test]
    fn small_moves_are_mended() {
        // steps of a tenth of the distance flip some cells and leave most
        assert!(follow_moves(&Delaunay::<2>::new(), 12, 0.1, 1) >= 5);
        assert!(follow_moves(&Delaunay::<3>::new(), 7, 0.1, 1) >= 5);
    }

    #[test]
    fn an_atom_that_passes_another_along_a_side_is_not_lost() {
        follow_moves(&Delaunay::<2>::new(), 10, 1.024_906_303_227_129_3, 199);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]
        #[test]
        fn moves_of_any_size_give_what_connecting_anew_gives(
            reach in 0.0..2.0_f64, seed in 0..1000_u64, side in 4..9_usize
        ) {
            follow_moves(&Delaunay::<2>::new(), side + 3, reach, seed);
            follow_moves(&Delaunay::<3>::new(), side / 2 + 2, reach, seed);
        }
    }
}
