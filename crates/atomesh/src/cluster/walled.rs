//! What walls leave of the cells: components, joined to a tree from all of them up to one.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::CellGraph;
use crate::geometry::Sets;

/// The components of a graph, and in which order they become one.
pub(super) struct Walled {
    /// The component of each cell.
    of_cells: Vec<u32>,
    count: usize,
    /// Pairs of groups that become one, the larger first, each known by one of its components.
    merges: Vec<[u32; 2]>,
}

impl Walled {
    /// The components by weights above 0, of which those of fewer than `least` cells are tied to others by weights of 1.
    /// The smallest group always becomes one with the group with which it shares most facets.
    pub fn new(graph: &mut CellGraph, least: usize) -> Self {
        let mut groups = Groups::new(graph);
        while let Some((size, island)) = groups.smallest()
            && size < least
        {
            if let Some(host) = groups.host(island) {
                groups.unite(island, host);
            }
        }
        let before = components(graph).roots();
        let of_cells = groups.sets.numbers();
        for cell in 0..graph.cell_count() {
            let others: Vec<usize> = graph.neighbours(cell).map(|(other, _)| other).collect();
            for other in others {
                if before[cell] != before[other] && of_cells[cell] == of_cells[other] {
                    graph.set_weight([cell, other], 1.0);
                }
            }
        }
        let count = of_cells.iter().max().map_or(1, |greatest| *greatest as usize + 1);
        Self { merges: groups.merges(&of_cells, count), of_cells, count }
    }

    /// The part of each cell, and the part that each part was taken from, where there are at most so many parts.
    pub fn parts(&self, most: usize) -> (Vec<u32>, Vec<u32>) {
        let mut parents = vec![0];
        let mut numbers = vec![0; self.count];
        for &[kept, taken] in self.merges.iter().rev() {
            let parent = numbers[kept as usize];
            numbers[taken as usize] = parent;
            if parents.len() < most {
                numbers[taken as usize] = parents.len() as u32;
                parents.push(parent);
            }
        }
        (self.of_cells.iter().map(|&of| numbers[of as usize]).collect(), parents)
    }
}

/// The cells connected by weights above 0.
fn components(graph: &CellGraph) -> Sets {
    let mut sets = Sets::new(graph.cell_count());
    for cell in 0..graph.cell_count() {
        for (other, weight) in graph.neighbours(cell) {
            if weight > 0.0 {
                sets.join(cell as u32, other as u32);
            }
        }
    }
    sets
}

/// Groups of cells while they become one. A group is known by its first cell, its root among the sets.
struct Groups {
    sets: Sets,
    /// The number of cells of each group by its first cell.
    sizes: Vec<usize>,
    /// Of each group the cells beyond its walls, one for each wall; some may have become its own.
    shores: Vec<Vec<u32>>,
    /// Groups by size and first cell, and what were groups before they grew.
    queue: BinaryHeap<Reverse<(usize, u32)>>,
}

impl Groups {
    fn new(graph: &CellGraph) -> Self {
        let count = graph.cell_count();
        let mut sets = components(graph);
        let roots = sets.roots();
        let (mut sizes, mut shores) = (vec![0; count], vec![Vec::new(); count]);
        for (cell, &root) in roots.iter().enumerate() {
            sizes[root as usize] += 1;
            let others = graph.neighbours(cell).map(|(other, _)| other as u32);
            shores[root as usize].extend(others.filter(|&other| roots[other as usize] != root));
        }
        let mut groups = Self { sets, sizes, shores, queue: BinaryHeap::new() };
        groups.fill_queue();
        groups
    }

    fn fill_queue(&mut self) {
        let firsts = (0..self.sizes.len() as u32).filter(|&cell| self.sets.root(cell) == cell);
        self.queue = firsts.map(|first| Reverse((self.sizes[first as usize], first))).collect();
    }

    /// Takes the smallest group, with its size, off the queue; of equal ones the first.
    fn smallest(&mut self) -> Option<(usize, u32)> {
        while let Some(Reverse((size, first))) = self.queue.pop() {
            if self.sets.root(first) == first && self.sizes[first as usize] == size {
                return Some((size, first));
            }
        }
        None
    }

    /// The group with which a group shares most walls, of equal ones the first; `None` if it has no neighbour.
    fn host(&mut self, group: u32) -> Option<u32> {
        let shore = std::mem::take(&mut self.shores[group as usize]);
        let mut around: Vec<u32> = shore.iter().map(|&cell| self.sets.root(cell)).collect();
        self.shores[group as usize] = shore;
        around.retain(|&other| other != group);
        around.sort_unstable();
        // of equal counts the last is taken: the first of those in reverse
        around.chunk_by(|a, b| a == b).rev().max_by_key(|same| same.len()).map(|same| same[0])
    }

    /// Makes two groups one.
    fn unite(&mut self, a: u32, b: u32) {
        self.sets.join(a, b);
        let (first, other) = (a.min(b) as usize, a.max(b) as usize);
        self.sizes[first] += self.sizes[other];
        let mut shores = [first, other].map(|group| std::mem::take(&mut self.shores[group]));
        shores.sort_by_key(|shore| Reverse(shore.len())); // the longer one grows
        let [mut all, more] = shores;
        all.extend(more);
        self.shores[first] = all;
        self.queue.push(Reverse((self.sizes[first], first as u32)));
    }

    /// Makes all groups one, the smallest first: pairs of the larger and the smaller, each by a component in it.
    fn merges(mut self, of_cells: &[u32], count: usize) -> Vec<[u32; 2]> {
        self.fill_queue();
        // the component by which each group is known, by its first cell
        let mut names: Vec<u32> = of_cells.to_vec();
        let mut merges = Vec::with_capacity(count - 1);
        while let Some((_, island)) = self.smallest() {
            // where the mesh is not connected, the next in size
            let Some(host) = self.host(island).or_else(|| self.smallest().map(|(_, next)| next))
            else {
                break;
            };
            // the larger first, of equal ones that with the first cell
            let mut pair = [host, island];
            pair.sort_by_key(|&group| (Reverse(self.sizes[group as usize]), group));
            let pair = pair.map(|group| names[group as usize]);
            self.unite(island, host);
            names[host.min(island) as usize] = pair[0];
            merges.push(pair);
        }
        merges
    }
}
