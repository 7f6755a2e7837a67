//! A connected part of the cells in two, by the least normalised cut that its Fiedler vector shows.

use super::CellGraph;
use super::fiedler::{Accuracy, fiedler};
use crate::geometry::Sets;

/// The sides of a part, each connected.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Bisection {
    /// Whether each cell of the part is on the second side, the smaller one.
    pub is_second: Vec<bool>,
    /// The normalised cut, 0…2.
    pub cut: f64,
}

/// How accurate vectors are for cuts. Where many parts hang together by little, many vectors have nearly the same λ and any
/// of them serves: to tell them apart takes three times as long, and planted parts are found no better.
const ACCURACY: Accuracy = Accuracy { tolerance: 0.1, most: 12 };

/// How often a part is cut again because its best cut only takes off an island.
const MOST_ISLANDS: usize = 8;

/// Rounds in which cells beside a cut change sides at most.
const MOST_ROUNDS: usize = 16;

/// Cuts a part, in which all cells are connected by weights above 0, into two sides of at least so many cells; `None` if
/// none of the cuts tried leaves as many.
///
/// An island, a side of fewer cells that the best cut takes off, is tied to the cells around it by weights of 1, and the
/// part is cut again.
pub(super) fn bisect(part: &CellGraph, least: usize) -> Option<Bisection> {
    let count = part.cell_count();
    if count < 2 * least.max(1) {
        return None;
    }
    let mut tied = part.clone();
    for islands in 0..=MOST_ISLANDS {
        let sides = Sides::new(&tied, &fiedler(&tied, ACCURACY), islands == MOST_ISLANDS, least);
        let (is_second, size) = sides?.finished();
        if size >= least {
            let cut = normalized_cut(part, &is_second);
            return Some(Bisection { is_second, cut });
        }
        tie(&mut tied, &is_second);
    }
    None
}

/// Sets the weights across the border of two sides to 1.
fn tie(graph: &mut CellGraph, is_second: &[bool]) {
    for cell in (0..graph.cell_count()).filter(|&cell| is_second[cell]) {
        let others: Vec<usize> = graph.neighbours(cell).map(|(other, _)| other).collect();
        for other in others.into_iter().filter(|&other| !is_second[other]) {
            graph.set_weight([cell, other], 1.0);
        }
    }
}

/// The normalised cut of two sides (Shi & Malik 2000): the weights between them over those of the one and over those of
/// the other, added.
pub(super) fn normalized_cut(graph: &CellGraph, is_second: &[bool]) -> f64 {
    let (mut cut, mut degrees) = (0.0, [0.0; 2]);
    for (cell, &side) in is_second.iter().enumerate() {
        degrees[usize::from(side)] += graph.degree(cell);
        for (other, weight) in graph.neighbours(cell) {
            cut += if is_second[other] && !side { weight } else { 0.0 };
        }
    }
    quotient(cut, degrees)
}

fn quotient(cut: f64, [first, second]: [f64; 2]) -> f64 {
    // sums of differences may fall below 0 by rounding
    cut.max(0.0) * (1.0 / first + 1.0 / second)
}

/// Two sides of a graph while cells change between them.
struct Sides<'a> {
    graph: &'a CellGraph,
    degrees: Vec<f64>,
    is_second: Vec<bool>,
    /// The weights between the sides.
    cut: f64,
    /// The weights of each side.
    sums: [f64; 2],
}

impl<'a> Sides<'a> {
    /// The sides of the best of all thresholds on a vector; if `bounded`, of those that leave so many cells on each side.
    fn new(graph: &'a CellGraph, x: &[f64], bounded: bool, least: usize) -> Option<Self> {
        let count = graph.cell_count();
        let mut order: Vec<u32> = (0..count as u32).collect();
        order.sort_by(|&a, &b| x[a as usize].total_cmp(&x[b as usize])); // stable
        let degrees: Vec<f64> = (0..count).map(|cell| graph.degree(cell)).collect();
        let mut sides = Self {
            graph,
            is_second: vec![false; count],
            cut: 0.0,
            sums: [degrees.iter().sum(), 0.0],
            degrees,
        };
        let allowed = if bounded { least..=count - least } else { 1..=count - 1 };
        let mut best = (f64::INFINITY, 0);
        for (place, &cell) in order.iter().enumerate() {
            sides.change(cell as usize);
            let cut = quotient(sides.cut, sides.sums);
            if allowed.contains(&(place + 1)) && cut < best.0 {
                best = (cut, place + 1);
            }
        }
        if best.1 == 0 {
            return None;
        }
        for &cell in order[best.1..].iter().rev() {
            sides.change(cell as usize);
        }
        Some(sides)
    }

    /// Moves a cell to the other side.
    fn change(&mut self, cell: usize) {
        let own = self.is_second[cell];
        self.cut += self.gain(cell);
        self.sums[usize::from(own)] -= self.degrees[cell];
        self.sums[usize::from(!own)] += self.degrees[cell];
        self.is_second[cell] = !own;
    }

    /// How much the weights between the sides grow if a cell changes sides.
    fn gain(&self, cell: usize) -> f64 {
        let own = self.is_second[cell];
        let of = |(other, weight): (usize, f64)| {
            if self.is_second[other] == own { weight } else { -weight }
        };
        self.graph.neighbours(cell).map(of).sum()
    }

    /// The sides with cells beside the cut moved where that lowers it, each side connected, and the size of the smaller one.
    fn finished(mut self) -> (Vec<bool>, usize) {
        self.refine();
        self.connect(false);
        self.connect(true);
        let seconds = self.is_second.iter().filter(|second| **second).count();
        let firsts = self.is_second.len() - seconds;
        // of equal sides the second is that without the first cell
        if seconds > firsts || (seconds == firsts && self.is_second[0]) {
            self.is_second.iter_mut().for_each(|second| *second = !*second);
        }
        (self.is_second, seconds.min(firsts))
    }

    /// Moves cells to the other side where that lowers the normalised cut.
    fn refine(&mut self) {
        for _ in 0..MOST_ROUNDS {
            let mut moved = false;
            for cell in 0..self.is_second.len() {
                let own = self.is_second[cell];
                if self.graph.neighbours(cell).all(|(other, _)| self.is_second[other] == own) {
                    continue;
                }
                let mut sums = self.sums;
                sums[usize::from(own)] -= self.degrees[cell];
                sums[usize::from(!own)] += self.degrees[cell];
                let before = quotient(self.cut, self.sums);
                // a share that rounding does not reach, so that no cell goes to and fro
                let least = before * (1.0 - 1e-9);
                if sums[usize::from(own)] > 0.0
                    && quotient(self.cut + self.gain(cell), sums) < least
                {
                    self.change(cell);
                    moved = true;
                }
            }
            if !moved {
                break;
            }
        }
    }

    /// Leaves a side its largest connected component, of equal ones the first; the others go to the other side, which
    /// they touch.
    fn connect(&mut self, side: bool) {
        let count = self.is_second.len();
        let mut sets = Sets::new(count);
        for cell in (0..count).filter(|&cell| self.is_second[cell] == side) {
            for (other, weight) in self.graph.neighbours(cell) {
                if self.is_second[other] == side && weight > 0.0 {
                    sets.join(cell as u32, other as u32);
                }
            }
        }
        let roots = sets.roots();
        let mut sizes = vec![0_usize; count];
        for cell in (0..count).filter(|&cell| self.is_second[cell] == side) {
            sizes[roots[cell] as usize] += 1;
        }
        let largest =
            (0..count).fold(0, |best, root| if sizes[root] > sizes[best] { root } else { best });
        for cell in 0..count {
            if self.is_second[cell] == side && roots[cell] as usize != largest {
                self.change(cell);
            }
        }
    }
}
