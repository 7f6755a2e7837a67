//! Edges that cross features, and what is done about them.

use crate::parallel::prelude::*;

use crate::crests::Pieces;
use crate::fields::NominalDistance;
use crate::geometry::{Bins, Point, distance_squared};
use crate::lattice::Lattice;

use super::atoms::{ON_SIDE, onto_sides};
use super::connect::Atoms;

/// A new atom is as far as this from the atoms of its piece, over d.
const CLEAR: f64 = 0.45;
/// New atoms are as far as this from each other, over d.
const THINNED: f64 = 0.6;
/// An end of an edge nearer to a piece than this is brought onto it, over d.
const BROUGHT: f64 = 1.0 / 3.0;
/// An atom of a piece keeps as far as this from other pieces, over d: where they cross they share theirs.
const OTHER: f64 = 0.35;
/// A new atom at a crossing is as far as this from all others, over d.
const ALONE: f64 = 0.3;
/// An end of an edge within this of a piece is on it, in mean steps.
const ON: f64 = 0.35;
/// Points nearer to a piece than this, over d, may be ends of edges that cross it.
const NEAR: f64 = 1.2;
/// Ends of crossing edges farther from a piece than this, over d, are not taken away.
const FAR: f64 = 0.75;

/// An edge that crosses a piece.
#[derive(Clone, Copy, Debug)]
pub(super) struct Crossing<const D: usize> {
    pub ends: [u32; 2],
    /// How far the ends are from the piece.
    pub heights: [f64; 2],
    pub piece: u32,
    pub place: Point<D>,
}

/// The piece and the signed distance for each piece near each point.
pub(super) fn heights<const D: usize>(
    points: &[Point<D>],
    pieces: &Pieces<D>,
    distance: &NominalDistance<D>,
) -> Vec<Vec<(u32, f64)>> {
    let of = |p: &Point<D>| {
        let reach = NEAR * distance.at(p) + 3.0 * pieces.step();
        let height = |piece: u32| {
            let foot = pieces.foot_on(piece, p, reach)?;
            Some((piece, foot.signed_distance(p)))
        };
        pieces.near(p, reach).into_iter().filter_map(height).collect()
    };
    points.par_iter().with_min_len(1 << 6).map(of).collect()
}

/// The edges of cells whose ends lie on two sides of a piece, ascending by ends.
pub(super) fn edges_across<'a, const D: usize>(
    cells: impl Parallel<Item = &'a [u32]>,
    heights: &[Vec<(u32, f64)>],
    pieces: &Pieces<D>,
) -> Vec<[u32; 2]> {
    let on = ON * pieces.step();
    let is_across =
        |a: u32, b: u32| is_between(&heights[a as usize], &heights[b as usize], on).is_some();
    let of = |cell: &'a [u32]| {
        let pairs =
            cell.iter().enumerate().flat_map(|(i, &a)| cell[..i].iter().map(move |&b| (a, b)));
        pairs.filter(|&(a, b)| is_across(a, b)).map(|(a, b)| [a.min(b), a.max(b)])
    };
    let mut edges: Vec<[u32; 2]> = cells.flat_map_iter(of).collect();
    edges.par_sort_unstable();
    edges.dedup();
    edges
}

/// The crossings of edges and pieces between the edges' ends, in the order of the edges.
pub(super) fn crossings<const D: usize>(
    edges: Vec<[u32; 2]>,
    atoms: &Atoms<D>,
    pieces: &Pieces<D>,
) -> Vec<Crossing<D>> {
    let on = ON * pieces.step();
    let crossing = |ends: &[u32; 2]| {
        let [a, b] = ends.map(|end| &atoms.heights[end as usize]);
        let (piece, heights) = is_between(a, b, on)?;
        let ends_at = ends.map(|end| &atoms.lattice.atoms()[end as usize]);
        let place = crossing_place(ends_at, heights, piece, pieces)?;
        Some(Crossing { ends: *ends, heights, piece, place })
    };
    edges.par_iter().with_min_len(1 << 6).filter_map(crossing).collect()
}

/// The first piece that lies between two points, and how far they are from it.
fn is_between(a: &[(u32, f64)], b: &[(u32, f64)], on: f64) -> Option<(u32, [f64; 2])> {
    a.iter().find_map(|&(piece, first)| {
        let &(_, second) = b.iter().find(|(other, _)| *other == piece)?;
        let is_between = first * second < 0.0 && first.abs() > on && second.abs() > on;
        is_between.then_some((piece, [first, second]))
    })
}

/// Where the line between two points on the two sides of a piece meets it, by false position; `None` beyond its end.
pub(super) fn crossing_place<const D: usize>(
    [a, b]: [&Point<D>; 2],
    heights: [f64; 2],
    piece: u32,
    pieces: &Pieces<D>,
) -> Option<Point<D>> {
    let step = pieces.step();
    let far = distance_squared(a, b).sqrt() + 3.0 * step;
    let (mut low, mut high) = ((0.0, heights[0]), (1.0, heights[1]));
    for _ in 0..4 {
        let share = low.0 + (high.0 - low.0) * low.1 / (low.1 - high.1);
        let place = std::array::from_fn(|k| a[k] + share * (b[k] - a[k]));
        let foot = pieces.foot_on(piece, &place, far)?;
        let here = foot.signed_distance(&place);
        if here.abs() < 0.05 * step {
            let is_there = foot.beyond == 0.0
                && distance_squared(&foot.position, &place) < (0.5 * step).powi(2);
            return is_there.then_some(foot.position);
        }
        if here * low.1 > 0.0 {
            low = (share, here);
        } else {
            high = (share, here);
        }
    }
    None
}

/// What is done about crossings.
#[derive(Clone, Debug)]
pub(super) struct Mended<const D: usize> {
    /// Where each atom is now.
    pub places: Vec<Point<D>>,
    /// Whether each goes.
    pub goes: Vec<bool>,
    /// New atoms.
    pub new: Vec<Point<D>>,
}

/// Brings free ends of crossing edges that are near onto the piece, or puts atoms at the crossings, where they are far
/// enough from the piece's atoms; where nothing can be brought or put, takes away the free ends nearer to the pieces.
/// What an edge has been mended at stays for this round.
pub(super) fn mended<const D: usize>(
    atoms: &Atoms<D>,
    crossings: &[Crossing<D>],
    pieces: &Pieces<D>,
    distance: &NominalDistance<D>,
) -> Mended<D> {
    let mut mending = Mending::new(atoms, pieces, distance);
    let stuck: Vec<Crossing<D>> =
        crossings.iter().filter(|crossing| !mending.mend(crossing)).copied().collect();
    let Mending { places, is_touched, new, .. } = mending;
    let goes = ends_that_go(&atoms.lattice, &stuck, &is_touched, distance);
    Mended { places, goes, new }
}

/// What is done about crossings, one after another.
struct Mending<'a, const D: usize> {
    lattice: &'a Lattice<D>,
    pieces: &'a Pieces<D>,
    distance: &'a NominalDistance<D>,
    /// The pieces of each atom.
    of_atoms: &'a [Vec<u32>],
    all: Bins<D>,
    on: OnPieces<D>,
    /// Where each atom is now.
    places: Vec<Point<D>>,
    /// Whether an edge of the atom has been mended.
    is_touched: Vec<bool>,
    /// New atoms.
    new: Vec<Point<D>>,
}

impl<'a, const D: usize> Mending<'a, D> {
    fn new(atoms: &'a Atoms<D>, pieces: &'a Pieces<D>, distance: &'a NominalDistance<D>) -> Self {
        let Atoms { lattice, of_atoms, .. } = atoms;
        let places = lattice.atoms().iter().copied();
        Self {
            all: Bins::of(lattice.bounds(), distance.least(), places),
            on: OnPieces::new(lattice, of_atoms, distance),
            places: lattice.atoms().to_vec(),
            is_touched: vec![false; lattice.len()],
            new: Vec::new(),
            lattice,
            pieces,
            distance,
            of_atoms,
        }
    }

    /// Brings the nearer end onto the piece, or else puts an atom at the crossing. Whether something was done, here or at
    /// an edge beside it.
    fn mend(&mut self, crossing: &Crossing<D>) -> bool {
        let Crossing { ends, piece, .. } = *crossing;
        if ends.iter().any(|&end| self.is_touched[end as usize]) {
            return true;
        }
        if let Some((end, place)) = self.end_to_bring(crossing) {
            self.on.add(&place, piece);
            (self.places[end], self.is_touched[end]) = (place, true);
        } else if let Some(place) = self.place_for_an_atom(crossing) {
            self.on.add(&place, piece);
            ends.iter().for_each(|&end| self.is_touched[end as usize] = true);
            self.new.push(place);
        } else {
            return false;
        }
        true
    }

    /// The nearer end and where it comes, if it is free, near the piece, and there is a place.
    fn end_to_bring(&self, crossing: &Crossing<D>) -> Option<(usize, Point<D>)> {
        let Crossing { ends, heights, piece, place } = crossing;
        let (d, bounds) = (self.distance.at(place), self.lattice.bounds());
        let nearer = usize::from(heights[1].abs() < heights[0].abs());
        let end = ends[nearer] as usize;
        let is_inner = |freedom: u8| freedom.count_ones() as usize == D;
        let is_free =
            self.lattice.temperature(end) > 0.0 && is_inner(self.lattice.freedom_in_box(end));
        if !is_free || heights[nearer].abs() >= BROUGHT * d {
            return None;
        }
        let foot = self.pieces.foot_on(*piece, &self.places[end], d)?;
        let to = foot.position;
        let is_good = foot.beyond == 0.0
            && bounds.contains(&to)
            && is_inner(bounds.freedom(&to))
            && !is_near_other(&to, *piece, self.pieces, OTHER * d)
            && self.on.is_clear(&to, *piece, d);
        is_good.then_some((end, to))
    }

    /// The crossing, if an atom there is far enough from all others.
    fn place_for_an_atom(&self, crossing: &Crossing<D>) -> Option<Point<D>> {
        let Crossing { ends, piece, place, .. } = crossing;
        let d = self.distance.at(place);
        // a foot beside a side of the box may be within a rounding of it
        let (bounds, near) = (self.lattice.bounds(), ON_SIDE * self.pieces.step());
        let place = onto_sides(&bounds.clamp(place), bounds, near);
        let mut is_alone = true;
        self.all.near(&place, ALONE * d, |i| {
            let squared = distance_squared(&self.lattice.atoms()[i], &place);
            is_alone &= squared >= (ALONE * d).powi(2);
        });
        // where the edge lies in another piece, the two must share an atom
        let [a, b] = ends.map(|end| &self.of_atoms[end as usize]);
        let is_clear = a.iter().any(|piece| b.contains(piece))
            || self.on.is_clear(&place, *piece, d)
                && !is_near_other(&place, *piece, self.pieces, OTHER * d);
        (is_alone && is_clear).then_some(place)
    }
}

/// Which atoms go: of each crossing edge the nearer end, or the other one, that is free and not far from the piece. Edges
/// at which something was touched wait.
fn ends_that_go<const D: usize>(
    lattice: &Lattice<D>,
    crossings: &[Crossing<D>],
    is_touched: &[bool],
    distance: &NominalDistance<D>,
) -> Vec<bool> {
    let mut goes = vec![false; lattice.len()];
    for Crossing { ends, heights, place, .. } in crossings {
        let nearer = usize::from(heights[1].abs() < heights[0].abs());
        let is_far = heights[nearer].abs() > FAR * distance.at(place);
        if is_far || ends.iter().any(|&end| goes[end as usize] || is_touched[end as usize]) {
            continue;
        }
        let may_go = |end: u32| {
            lattice.temperature(end as usize) > 0.0 && lattice.freedom_in_box(end as usize) != 0
        };
        let end = [ends[nearer], ends[1 - nearer]].into_iter().find(|&end| may_go(end));
        if let Some(end) = end {
            goes[end as usize] = true;
        }
    }
    goes
}

/// Whether another piece than its own is nearer to a place than `clear`.
fn is_near_other<const D: usize>(
    place: &Point<D>,
    own: u32,
    pieces: &Pieces<D>,
    clear: f64,
) -> bool {
    pieces.near(place, clear).into_iter().filter(|&piece| piece != own).any(|piece| {
        let foot = pieces.foot_on(piece, place, clear + 2.0 * pieces.step());
        foot.is_some_and(|foot| foot.beyond == 0.0 && foot.signed_distance(place).abs() < clear)
    })
}

/// Puts free atoms that are nearly on a piece onto it, and freezes them: as free ones they would be on neither side.
/// `heights` are those of the atoms.
pub(super) fn brought_near<const D: usize>(
    mut lattice: Lattice<D>,
    of_atoms: &mut [Vec<(u32, f64)>],
    pieces: &Pieces<D>,
    distance: &NominalDistance<D>,
) -> Lattice<D> {
    let (bounds, step) = (*lattice.bounds(), pieces.step());
    let to = |i: usize| -> Option<Point<D>> {
        let atom = &lattice.atoms()[i];
        if of_atoms[i].iter().all(|(_, height)| height.abs() > ON * step)
            || lattice.temperature(i) == 0.0
            || bounds.freedom(atom).count_ones() as usize != D
        {
            return None;
        }
        let near = pieces.near(atom, 1.0);
        let mut feet = near.into_iter().filter_map(|piece| pieces.foot_on(piece, atom, 2.0 * step));
        let foot =
            feet.find(|foot| foot.beyond == 0.0 && foot.signed_distance(atom).abs() <= ON * step)?;
        let to = foot.position;
        let is_inner = bounds.contains(&to) && bounds.freedom(&to).count_ones() as usize == D;
        is_inner.then_some(to)
    };
    let moved: Vec<(usize, Point<D>)> = (0..lattice.len())
        .into_par_iter()
        .with_min_len(1 << 8)
        .filter_map(|i| Some((i, to(i)?)))
        .collect();
    let places: Vec<Point<D>> = moved.iter().map(|(_, place)| *place).collect();
    let mut atoms = lattice.atoms().to_vec();
    for ((i, place), heights) in moved.into_iter().zip(heights(&places, pieces, distance)) {
        (atoms[i], of_atoms[i]) = (place, heights);
        lattice.set_temperature(i, 0.0);
    }
    lattice.moved_to(atoms)
}

/// The atoms on pieces.
struct OnPieces<const D: usize> {
    bins: Bins<D>,
    /// Where they are, on which pieces, and whether they are new.
    atoms: Vec<(Point<D>, Vec<u32>, bool)>,
}

impl<const D: usize> OnPieces<D> {
    fn new(lattice: &Lattice<D>, of_atoms: &[Vec<u32>], distance: &NominalDistance<D>) -> Self {
        let mut bins = Bins::new(lattice.bounds(), distance.least(), lattice.len());
        let mut atoms = Vec::new();
        for (atom, pieces) in lattice.atoms().iter().zip(of_atoms) {
            if !pieces.is_empty() {
                bins.push(atom);
                atoms.push((*atom, pieces.clone(), false));
            }
        }
        Self { bins, atoms }
    }

    /// Whether a new atom of a piece is far enough from all others on pieces.
    fn is_clear(&self, place: &Point<D>, piece: u32, d: f64) -> bool {
        let mut is_clear = true;
        self.bins.near(place, THINNED * d, |i| {
            let (other, pieces, is_new) = &self.atoms[i];
            let least = if *is_new && pieces.contains(&piece) { THINNED } else { CLEAR };
            is_clear &= distance_squared(other, place) >= (least * d).powi(2);
        });
        is_clear
    }

    fn add(&mut self, place: &Point<D>, piece: u32) {
        self.bins.push(place);
        self.atoms.push((*place, vec![piece], true));
    }
}
