//! Parts of a mesh as a tree: each level has one part more than the one above it.

use super::bisect::{Bisection, bisect};
use super::walled::Walled;
use super::{CellGraph, ClusterError, ClusterOptions};
use crate::watch::{Cancelled, Phase, Watch, check};

/// A tree of parts of the cells, each level with one part more: one part falls in two.
///
/// The larger half keeps the part's number, the other gets the next one. So parts are numbered from 1 to k at the level of
/// k parts, and no part of a finer level has cells of two parts of a coarser one. Parts are connected through facets that
/// are no walls, but at levels of fewer parts than walls leave, and for what was smaller than a part may be.
#[derive(Clone, Debug, PartialEq)]
pub struct ClusterTree {
    /// The part of each cell at the finest level, here counted from 0.
    of_cells: Vec<u32>,
    /// The part that each part was taken from; of part 0 itself.
    parents: Vec<u32>,
    /// The normalised cut by which each part was taken from another; of part 0 it means nothing.
    cuts: Vec<f64>,
}

impl ClusterTree {
    /// Grows a tree: at first walls part the cells; then, again and again, that part falls in two whose normalised cut is
    /// least (Shi & Malik 2000).
    ///
    /// The tree ends at `options.most_parts`, or where no part can be cut into two of `options.least_cells`. Fewer cells
    /// that walls cut off belong to the part with which they share most facets. Cost: O(links) for each level of halves,
    /// on one thread.
    ///
    /// # Errors
    /// [`ClusterError`] if an option is 0, or the watch ends the work.
    pub fn grow(
        graph: &CellGraph,
        options: &ClusterOptions,
        watch: &mut dyn Watch,
    ) -> Result<Self, ClusterError> {
        options.check()?;
        let mut tied = graph.clone();
        let walled = Walled::new(&mut tied, options.least_cells);
        let mut growing = Growing::new(&tied, walled, options);
        while growing.leaves.len() < options.most_parts {
            if !growing.split(watch)? {
                break;
            }
        }
        Ok(growing.tree)
    }

    /// The number of parts at the finest level; 1 for a mesh without cells.
    pub fn part_count(&self) -> usize {
        self.parents.len()
    }

    /// The part of each cell at the level of so many parts, 1 … `count`; at the finest level if it has fewer, at the
    /// coarsest for 0.
    pub fn parts(&self, count: usize) -> Vec<i32> {
        let mut at_level: Vec<i32> = Vec::with_capacity(self.parents.len());
        for (part, &parent) in self.parents.iter().enumerate() {
            // a part comes after the one that it was taken from
            let is_there = part < count.max(1);
            at_level.push(if is_there { part as i32 + 1 } else { at_level[parent as usize] });
        }
        self.of_cells.iter().map(|&part| at_level[part as usize]).collect()
    }

    /// The splits in their order: that of number i makes i + 2 parts of i + 1, the new one number i + 2.
    pub fn splits(&self) -> impl ExactSizeIterator<Item = Split> {
        let splits = self.parents.iter().zip(&self.cuts).skip(1);
        splits.map(|(&parent, &cut)| Split { part: parent as i32 + 1, cut })
    }
}

/// How one part of a tree falls in two.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Split {
    /// The part that cells are taken from.
    pub part: i32,
    /// The normalised cut, 0…2: 0 if only walls lie between the two.
    pub cut: f64,
}

/// A part at the finest level so far.
struct Leaf {
    /// Its cells, ascending.
    cells: Vec<u32>,
    /// How it would fall in two, once that is known.
    next: Option<Next>,
}

/// How a part falls in two.
enum Next {
    /// The normalised cut, and the cells that get a new number.
    Cut(f64, Vec<u32>),
    /// It stays as it is.
    Whole,
}

/// A tree that grows.
struct Growing<'a> {
    graph: &'a CellGraph,
    options: &'a ClusterOptions,
    tree: ClusterTree,
    leaves: Vec<Leaf>,
    /// Room for the places of cells in a part.
    places: Vec<u32>,
}

impl<'a> Growing<'a> {
    /// The tree of the parts that walls leave.
    fn new(graph: &'a CellGraph, walled: Walled, options: &'a ClusterOptions) -> Self {
        let (of_cells, parents) = walled.parts(options.most_parts);
        let mut leaves: Vec<Leaf> =
            parents.iter().map(|_| Leaf { cells: Vec::new(), next: None }).collect();
        for (cell, &part) in of_cells.iter().enumerate() {
            leaves[part as usize].cells.push(cell as u32);
        }
        let cuts = vec![0.0; parents.len()];
        let tree = ClusterTree { of_cells, parents, cuts };
        Self { graph, options, tree, leaves, places: vec![0; graph.cell_count()] }
    }

    /// Splits the part of the least normalised cut, of equal ones the first. Returns whether there was one.
    fn split(&mut self, watch: &mut dyn Watch) -> Result<bool, Cancelled> {
        let done = self.leaves.len() as f64 / self.options.most_parts as f64;
        let mut best = (f64::INFINITY, None);
        for (part, leaf) in self.leaves.iter_mut().enumerate() {
            if leaf.next.is_none() {
                check(watch, Phase::Cluster, done, None)?;
                leaf.next = Some(next(self.graph, &leaf.cells, self.options, &mut self.places));
            }
            if let Some(Next::Cut(cut, _)) = leaf.next
                && cut < best.0
            {
                best = (cut, Some(part));
            }
        }
        let Some(part) = best.1 else { return Ok(false) };
        if let Some(Next::Cut(cut, second)) = self.leaves[part].next.take() {
            let number = self.leaves.len() as u32;
            self.tree.parents.push(part as u32);
            self.tree.cuts.push(cut);
            second.iter().for_each(|&cell| self.tree.of_cells[cell as usize] = number);
            self.leaves[part].cells.retain(|&cell| self.tree.of_cells[cell as usize] != number);
            self.leaves.push(Leaf { cells: second, next: None });
        }
        Ok(true)
    }
}

/// How a part falls in two.
fn next(graph: &CellGraph, cells: &[u32], options: &ClusterOptions, places: &mut [u32]) -> Next {
    let found = bisect(&graph.part(cells, places), options.least_cells);
    let Some(Bisection { is_second, cut }) = found else { return Next::Whole };
    let second = cells.iter().zip(is_second).filter(|(_, second)| *second);
    Next::Cut(cut, second.map(|(&cell, _)| cell).collect())
}
