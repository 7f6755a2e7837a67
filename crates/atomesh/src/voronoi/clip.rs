//! Cutting the loops by the sides of the box.
//!
//! Only loops with a corner on or beyond a side are touched. A point within the tolerance of a side is on it, and is
//! moved there. An edge from inside to outside is cut once, by the loop that comes first. The edges of a cell's faces on
//! a side that no other of its faces runs back along are the border of the face that closes the cell there. This holds
//! for cells however thin, and whatever the rounding, since it depends on no coordinates.

use std::collections::HashMap;

use super::dual::{Domain, Dual, Loops, NONE};
use crate::geometry::Point;

/// A loop that meets a side of the box, with its cells as in [`Loops`]. The second cell of a loop on a side is
/// [`of_side`].
pub(super) struct Rim {
    pub corners: Vec<u32>,
    pub cells: [u32; 2],
}

/// The complex within the box.
pub(super) struct Cut<const D: usize> {
    pub points: Vec<Point<D>>,
    /// Bit s of a point: it is on side s.
    pub sides: Vec<u8>,
    /// Loops that meet no side.
    pub inner: Loops,
    pub rim: Vec<Rim>,
}

/// The number that stands for a side of the box in place of a cell. Sides are 2 · axis, and 1 more at the axis' end.
pub(super) fn of_side(side: usize) -> u32 {
    NONE - 1 - side as u32
}

/// The side for which a cell's number stands, if it does.
pub(super) fn side_of<const D: usize>(cell: u32) -> Option<usize> {
    let side = (NONE - 1).wrapping_sub(cell) as usize;
    (side < 2 * D).then_some(side)
}

/// Where a point is, relative to a side.
#[derive(Clone, Copy, PartialEq, Eq)]
enum State {
    Inside,
    On,
    Beyond,
}

/// Cuts the complex by all sides of the box.
pub(super) fn clip<const D: usize>(dual: Dual<D>, domain: &Domain<D>) -> Cut<D> {
    let sides = vec![0; dual.points.len()];
    let mut cutter = Cutter { points: dual.points, sides, domain };
    let meets: Vec<bool> = (0..cutter.points.len() as u32)
        .map(|p| (0..2 * D).any(|s| cutter.state(p, s) != State::Inside))
        .collect();
    let (mut inner, mut rim) = (Loops::default(), Vec::new());
    for (corners, cells) in dual.loops.iter() {
        if corners.iter().any(|&c| meets[c as usize]) {
            rim.push(Rim { corners: corners.to_vec(), cells });
        } else {
            inner.push(corners.iter().copied(), cells);
        }
    }
    for side in 0..2 * D {
        rim = cutter.cut(rim, side);
        if D == 3 {
            let lids = lids(&rim, &cutter.sides, side, dual.site_count);
            rim.extend(lids);
        }
    }
    Cut { points: cutter.points, sides: cutter.sides, inner, rim }
}

struct Cutter<'a, const D: usize> {
    points: Vec<Point<D>>,
    sides: Vec<u8>,
    domain: &'a Domain<D>,
}

impl<const D: usize> Cutter<'_, D> {
    fn state(&self, point: u32, side: usize) -> State {
        if self.sides[point as usize] >> side & 1 == 1 {
            return State::On;
        }
        let above = self.points[point as usize][side / 2] - self.domain.bounds.level(side);
        let beyond = if side.is_multiple_of(2) { -above } else { above };
        match beyond {
            b if b > self.domain.tolerance => State::Beyond,
            b if b < -self.domain.tolerance => State::Inside,
            _ => State::On,
        }
    }

    /// The parts of the loops inside of a side.
    fn cut(&mut self, loops: Vec<Rim>, side: usize) -> Vec<Rim> {
        let mut crossings = HashMap::new();
        let mut kept = Vec::with_capacity(loops.len());
        let mut states = Vec::new();
        for mut rim in loops {
            states.clear();
            states.extend(rim.corners.iter().map(|&c| self.state(c, side)));
            if states.contains(&State::Beyond) {
                rim.corners = self.cut_one(&rim.corners, &states, side, &mut crossings);
            }
            for &corner in &rim.corners {
                if self.state(corner, side) == State::On {
                    self.points[corner as usize][side / 2] = self.domain.bounds.level(side);
                    self.sides[corner as usize] |= 1 << side;
                }
            }
            if rim.corners.len() > 2 {
                kept.push(rim);
            }
        }
        kept
    }

    /// The part of one loop inside of a side; `crossings` holds the points at which edges were cut before.
    fn cut_one(
        &mut self,
        corners: &[u32],
        states: &[State],
        side: usize,
        crossings: &mut HashMap<[u32; 2], u32>,
    ) -> Vec<u32> {
        let mut left = Vec::with_capacity(corners.len() + 1);
        for at in 0..corners.len() {
            let next = (at + 1) % corners.len();
            if states[at] != State::Beyond {
                left.push(corners[at]);
            }
            let edge = [corners[at], corners[next]];
            let [inside, beyond] = match (states[at], states[next]) {
                (State::Inside, State::Beyond) => edge,
                (State::Beyond, State::Inside) => [edge[1], edge[0]],
                _ => continue,
            };
            left.push(*crossings.entry([inside, beyond]).or_insert_with(|| {
                self.cross(inside, beyond, side) // numbered in the order of loops, not of the map
            }));
        }
        left
    }

    /// The point where an edge meets a side. Found from its inner end, so that the rounding of an end far
    /// outside is scaled down with the distance.
    fn cross(&mut self, inside: u32, beyond: u32, side: usize) -> u32 {
        let (from, to) = (self.points[inside as usize], self.points[beyond as usize]);
        let (axis, level) = (side / 2, self.domain.bounds.level(side));
        let share = (level - from[axis]) / (to[axis] - from[axis]);
        let mut point: Point<D> = std::array::from_fn(|k| from[k] + share * (to[k] - from[k]));
        point[axis] = level;
        self.points.push(point);
        self.sides.push(self.sides[inside as usize] & self.sides[beyond as usize] | 1 << side);
        self.points.len() as u32 - 1
    }
}

/// The faces that close cells on a side.
fn lids(rim: &[Rim], sides: &[u8], side: usize, site_count: usize) -> Vec<Rim> {
    let is_on = |c: u32| sides[c as usize] >> side & 1 == 1;
    // cell, start and end of every edge on the side, in the direction in which the closing face has it
    let mut edges: Vec<[u32; 3]> = Vec::new();
    for Rim { corners, cells } in rim {
        for at in 0..corners.len() {
            let (a, b) = (corners[at], corners[(at + 1) % corners.len()]);
            if is_on(a) && is_on(b) {
                let of_cells = [[cells[0], b, a], [cells[1], a, b]];
                edges.extend(of_cells.into_iter().filter(|e| (e[0] as usize) < site_count));
            }
        }
    }
    edges.sort_unstable();
    let mut lids = Vec::new();
    for of_cell in edges.chunk_by(|a, b| a[0] == b[0]) {
        let mut open: Vec<[u32; 2]> = Vec::new();
        for &[_, from, to] in of_cell {
            match open.iter().position(|e| *e == [to, from]) {
                Some(back) => drop(open.remove(back)),
                None => open.push([from, to]),
            }
        }
        while let Some([start, mut at]) = open.first().copied() {
            open.remove(0);
            let mut corners = vec![start];
            while at != start {
                corners.push(at);
                // a border has as many edges to a point as from it
                let Some(next) = open.iter().position(|e| e[0] == at) else { break };
                at = open.remove(next)[1];
            }
            lids.push(Rim { corners, cells: [of_cell[0][0], of_side(side)] });
        }
    }
    lids
}
