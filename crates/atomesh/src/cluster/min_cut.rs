//! A part in two by the weakest border between two marked sides: a minimum cut.
//!
//! The greatest flow from the cells marked first to those marked second is found by growing a tree from each side and
//! pushing flow where they meet (Boykov & Kolmogorov 2004); where no more fits, the trees end at the minimum cut. Weights
//! are counted in whole units, so that sums are exact: the same at any thread count. Cost: in practice a few times
//! O(links) where marks are near the cut.

use std::collections::VecDeque;

use super::{CellGraph, ClusterError};

/// Units of the greatest weight of a part. A wall counts one unit, so that a cut passes as few of them as it can.
const UNITS: f64 = (1_u64 << 32) as f64;

/// The cells of the second side of the weakest border between the cells marked on two sides of a part; ascending.
/// `cells` are the part's, ascending.
///
/// Where other cuts are as weak, cells between them go where there are fewer.
///
/// # Errors
/// [`ClusterError`] if a side has no mark, or a cell is marked that is not in the part or marked for the other side too.
pub(super) fn min_cut(
    graph: &CellGraph,
    cells: &[u32],
    marks: [&[u32]; 2],
) -> Result<Vec<u32>, ClusterError> {
    let part = graph.part(cells, &mut vec![0; graph.cell_count()]);
    let mut flow = Flow::new(&part);
    for (side, marks) in [Side::First, Side::Second].into_iter().zip(marks) {
        if marks.is_empty() {
            return Err(ClusterError::NoMark);
        }
        for &cell in marks {
            let place = cells.binary_search(&cell).map_err(|_| ClusterError::Mark { cell })?;
            if !flow.mark(place as u32, side) {
                return Err(ClusterError::TwoMarks { cell });
            }
        }
    }
    flow.run();
    let is_second = flow.seconds();
    Ok(cells.iter().zip(is_second).filter(|(_, second)| *second).map(|(&cell, _)| cell).collect())
}

/// How many units each weight counts.
pub(super) fn units(graph: &CellGraph) -> impl Fn(f64) -> u64 + use<> {
    let greatest = graph.weights().iter().fold(f64::MIN_POSITIVE, |a, &b| a.max(b));
    move |weight| (weight / greatest * UNITS) as u64 + 1
}

/// The side of a cell's tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Side {
    /// In neither tree.
    Free,
    First,
    Second,
}

/// The parent of a marked cell.
const ROOT: usize = usize::MAX;
/// The parent of a cell in no tree, or one that has lost its own.
const NONE: usize = usize::MAX - 1;

/// A flow from the cells marked first to those marked second, and the trees of cells that more can come from or go to.
///
/// An *arc* is a link seen from one of its cells: its place among the neighbours of all cells.
struct Flow<'a> {
    graph: &'a CellGraph,
    /// The cell that each arc leads to.
    heads: Vec<u32>,
    /// The arc back.
    back: Vec<usize>,
    /// How many more units fit along each arc.
    room: Vec<u64>,
    sides: Vec<Side>,
    /// The arc from each cell to its parent.
    parents: Vec<usize>,
    /// Cells from which trees may grow.
    active: VecDeque<u32>,
    /// Cells that have lost their parents.
    orphans: VecDeque<u32>,
}

impl<'a> Flow<'a> {
    fn new(graph: &'a CellGraph) -> Self {
        let count = graph.cell_count();
        let units = units(graph);
        let heads: Vec<u32> = (0..count)
            .flat_map(|cell| graph.neighbours(cell).map(|(other, _)| other as u32))
            .collect();
        // arcs that lead to a cell come in the order of the cells that they leave, as its own arcs do
        let mut next: Vec<usize> = (0..count).map(|cell| graph.places(cell).start).collect();
        let back = heads.iter().map(|&head| {
            next[head as usize] += 1;
            next[head as usize] - 1
        });
        Self {
            back: back.collect(),
            room: graph.weights().iter().map(|&weight| units(weight)).collect(),
            heads,
            sides: vec![Side::Free; count],
            parents: vec![NONE; count],
            active: VecDeque::new(),
            orphans: VecDeque::new(),
            graph,
        }
    }

    /// Marks a cell; returns whether it was not marked for the other side.
    fn mark(&mut self, cell: u32, side: Side) -> bool {
        let own = &mut self.sides[cell as usize];
        if *own == Side::Free {
            *own = side;
            self.parents[cell as usize] = ROOT;
            self.active.push_back(cell);
        }
        *own == side
    }

    /// Grows the trees until no more flow fits.
    fn run(&mut self) {
        while let Some(&cell) = self.active.front() {
            match self.grow(cell) {
                Some(bridge) => {
                    self.push(bridge);
                    self.adopt();
                }
                None => {
                    self.active.pop_front();
                }
            }
        }
    }

    /// Whether more flow fits between a cell of a tree and the other end of its arc: towards the first side's trees grow
    /// along the flow, the second's against it.
    fn leads_out(&self, side: Side, arc: usize) -> bool {
        self.room[if side == Side::First { arc } else { self.back[arc] }] > 0
    }

    /// Adds the free neighbours of a cell to its tree. Returns an arc from the first tree to the second if it finds one.
    fn grow(&mut self, cell: u32) -> Option<usize> {
        let side = self.sides[cell as usize];
        if side == Side::Free {
            return None;
        }
        for arc in self.graph.places(cell as usize) {
            if !self.leads_out(side, arc) {
                continue;
            }
            let other = self.heads[arc];
            let its = self.sides[other as usize];
            if its == Side::Free {
                self.sides[other as usize] = side;
                self.parents[other as usize] = self.back[arc];
                self.active.push_back(other);
            } else if its != side {
                return Some(if side == Side::First { arc } else { self.back[arc] });
            }
        }
        None
    }

    /// The arcs along which flow goes from a root of the first tree through a bridge to one of the second, from the bridge
    /// out.
    fn path(&self, bridge: usize) -> Vec<usize> {
        let mut path = vec![bridge];
        for (start, side) in [(self.back[bridge], Side::First), (bridge, Side::Second)] {
            let mut cell = self.heads[start] as usize;
            while self.parents[cell] != ROOT {
                let arc = self.parents[cell];
                path.push(if side == Side::First { self.back[arc] } else { arc });
                cell = self.heads[arc] as usize;
            }
        }
        path
    }

    /// Pushes as much flow through a bridge as fits; cells whose arcs to their parents are full become orphans.
    fn push(&mut self, bridge: usize) {
        let path = self.path(bridge);
        let most = path.iter().map(|&arc| self.room[arc]).min().unwrap_or(0);
        for &arc in &path {
            self.room[arc] -= most;
            self.room[self.back[arc]] += most;
            if self.room[arc] == 0 {
                let (tail, head) = (self.heads[self.back[arc]], self.heads[arc]);
                if self.sides[tail as usize] == self.sides[head as usize] {
                    let child = if self.sides[tail as usize] == Side::First { head } else { tail };
                    self.parents[child as usize] = NONE;
                    self.orphans.push_back(child);
                }
            }
        }
    }

    /// Finds orphans new parents in their trees; those that find none are free, and their children orphans.
    fn adopt(&mut self) {
        while let Some(cell) = self.orphans.pop_front() {
            let side = self.sides[cell as usize];
            let parent = self.graph.places(cell as usize).find(|&arc| {
                self.sides[self.heads[arc] as usize] == side
                    && self.leads_out(side, self.back[arc])
                    && self.is_rooted(self.heads[arc])
            });
            if let Some(arc) = parent {
                self.parents[cell as usize] = arc;
                continue;
            }
            for arc in self.graph.places(cell as usize) {
                let other = self.heads[arc];
                if self.sides[other as usize] != side {
                    continue;
                }
                if self.leads_out(side, self.back[arc]) {
                    self.active.push_back(other);
                }
                if self.parents[other as usize] == self.back[arc] {
                    self.parents[other as usize] = NONE;
                    self.orphans.push_back(other);
                }
            }
            self.sides[cell as usize] = Side::Free;
        }
    }

    /// Whether a cell's ancestors lead to a root.
    fn is_rooted(&self, mut cell: u32) -> bool {
        loop {
            match self.parents[cell as usize] {
                ROOT => return true,
                NONE => return false,
                arc => cell = self.heads[arc],
            }
        }
    }

    /// Whether each cell is on the second side. Cells that neither tree reaches go where there are fewer.
    fn seconds(&self) -> Vec<bool> {
        let count = |side: Side| self.sides.iter().filter(|own| **own == side).count();
        let smaller =
            if count(Side::Second) < count(Side::First) { Side::Second } else { Side::First };
        let is_second =
            |own: &Side| *own == Side::Second || *own == Side::Free && smaller == Side::Second;
        self.sides.iter().map(is_second).collect()
    }
}
