//! Cells that take a label from their neighbours: those of islands, and those without a label.

use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashMap};

use crate::geometry::Sets;
use crate::mesh::Mesh;

/// Gives the cells of islands, groups of fewer than `least` cells of one label connected by facets, the label with
/// which the island shares most facets (of equal ones the least). Returns how many cells have another label than before.
///
/// One island after the other: the smallest first, of equal ones that of the lowest cell. An island becomes one with the
/// groups of its new label that it touches; a group that has grown to `least` cells is an island no more. An island
/// without a neighbour stays. Cost: O(cells · log cells): an island is never larger than what it joins.
///
/// # Panics
/// If there are not as many labels as cells.
pub fn join_islands<const D: usize>(mesh: &Mesh<D>, labels: &mut [i32], least: usize) -> usize {
    assert_eq!(labels.len(), mesh.cell_count(), "one label a cell");
    if least < 2 {
        return 0; // every group has a cell
    }
    let mut islands = Islands::new(mesh, labels, least);
    while let Some(island) = islands.smallest() {
        islands.join(island);
    }
    let mut changed = 0;
    for (cell, label) in labels.iter_mut().enumerate() {
        let new = islands.label_of(cell as u32);
        changed += usize::from(*label != new);
        *label = new;
    }
    changed
}

/// The groups of cells while islands join others. A group is known by its first cell, its root among the sets.
struct Islands {
    groups: Sets,
    /// The number of cells, and the label, of each group by its first cell.
    sizes: Vec<usize>,
    labels: Vec<i32>,
    least: usize,
    /// Of each island the cells beyond its facets, one for each facet; some may have become its own.
    shores: HashMap<u32, Vec<u32>>,
    /// The islands by size and first cell, and what were islands before they grew.
    queue: BinaryHeap<Reverse<(usize, u32)>>,
}

impl Islands {
    fn new<const D: usize>(mesh: &Mesh<D>, labels: &[i32], least: usize) -> Self {
        let pairs = neighbours(mesh);
        let mut groups = Sets::new(labels.len());
        for &(a, b) in &pairs {
            if labels[a as usize] == labels[b as usize] {
                groups.join(a, b);
            }
        }
        let roots = groups.roots();
        let mut sizes = vec![0_usize; labels.len()];
        roots.iter().for_each(|&root| sizes[root as usize] += 1);
        let is_island = |root: u32| (1..least).contains(&sizes[root as usize]);
        let mut shores: HashMap<u32, Vec<u32>> = HashMap::new();
        for &(a, b) in &pairs {
            let (of_a, of_b) = (roots[a as usize], roots[b as usize]);
            for (root, other) in [(of_a, b), (of_b, a)] {
                if of_a != of_b && is_island(root) {
                    shores.entry(root).or_default().push(other);
                }
            }
        }
        let islands = (0..labels.len() as u32).filter(|&root| is_island(root));
        let queue = islands.map(|root| Reverse((sizes[root as usize], root))).collect();
        Self { groups, sizes, labels: labels.to_vec(), least, shores, queue }
    }

    /// Takes the smallest island off the queue.
    fn smallest(&mut self) -> Option<u32> {
        while let Some(Reverse((size, first))) = self.queue.pop() {
            if self.groups.root(first) == first && self.sizes[first as usize] == size {
                return Some(first);
            }
        }
        None
    }

    fn label_of(&mut self, cell: u32) -> i32 {
        self.labels[self.groups.root(cell) as usize]
    }

    /// Makes an island one with the groups around it of the label with which it shares most facets.
    fn join(&mut self, island: u32) {
        let shore = self.shores.remove(&island).unwrap_or_default();
        let mut around: Vec<u32> = shore.iter().map(|&cell| self.groups.root(cell)).collect();
        around.retain(|&group| group != island);
        let labels = around.iter().map(|&group| self.labels[group as usize]).collect();
        let Some(label) = most_frequent(labels) else { return };
        around.retain(|&group| self.labels[group as usize] == label);
        around.sort_unstable();
        around.dedup();
        self.unite(island, shore, &around, label);
    }

    /// Makes an island and other groups one of that label.
    fn unite(&mut self, island: u32, shore: Vec<u32>, others: &[u32], label: i32) {
        let mut size = self.sizes[island as usize];
        let mut shores = vec![shore];
        for &other in others {
            self.groups.join(island, other);
            size += self.sizes[other as usize];
            shores.extend(self.shores.remove(&other));
        }
        let first = self.groups.root(island);
        (self.sizes[first as usize], self.labels[first as usize]) = (size, label);
        if size < self.least {
            self.shores.insert(first, joined(shores));
            self.queue.push(Reverse((size, first)));
        }
    }
}

/// All lists in one: the shorter ones are put to the longest, so that no cell is moved often.
fn joined(mut lists: Vec<Vec<u32>>) -> Vec<u32> {
    lists.sort_by_key(Vec::len);
    let mut all = lists.pop().unwrap_or_default();
    lists.iter().for_each(|list| all.extend_from_slice(list));
    all
}

/// Each two cells that share a facet.
fn neighbours<const D: usize>(mesh: &Mesh<D>) -> Vec<(u32, u32)> {
    mesh.facets().iter().filter_map(|f| f.neighbour.map(|other| (f.cell, other))).collect()
}

/// The label that occurs most often; of equal ones the least.
fn most_frequent(mut labels: Vec<i32>) -> Option<i32> {
    labels.sort_unstable();
    let counts = labels.chunk_by(|a, b| a == b).map(|same| (same.len(), Reverse(same[0])));
    counts.max().map(|(_, Reverse(label))| label)
}

/// The labels with those filled in that are not known: the cells beside known ones first, each with the label with which
/// it shares most facets (of equal ones the least), then those beside these. 0 for cells that no path through facets
/// leads to from a known one. Cost: O(cells), and O(cells unknown) for each facet that the farthest of them is away.
pub(crate) fn fill_labels<const D: usize>(mesh: &Mesh<D>, labels: &[Option<i32>]) -> Vec<i32> {
    let mut labels = labels.to_vec();
    // an unknown cell and one beside it
    let mut shores: Vec<(u32, u32)> = Vec::new();
    if labels.contains(&None) {
        let both = neighbours(mesh).into_iter().flat_map(|(a, b)| [(a, b), (b, a)]);
        shores.extend(both.filter(|(cell, _)| labels[*cell as usize].is_none()));
    }
    shores.sort_unstable();
    loop {
        let mut found = Vec::new();
        for shore in shores.chunk_by(|a, b| a.0 == b.0) {
            let known = shore.iter().filter_map(|(_, other)| labels[*other as usize]).collect();
            found.extend(most_frequent(known).map(|label| (shore[0].0, label)));
        }
        if found.is_empty() {
            return labels.into_iter().map(Option::unwrap_or_default).collect();
        }
        found.into_iter().for_each(|(cell, label)| labels[cell as usize] = Some(label));
        shores.retain(|(cell, _)| labels[*cell as usize].is_none());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Delaunay;
    use crate::region::components;
    use crate::watch::Silent;

    /// A fraction of 1 that a seed and a number give.
    fn random(seed: u64, number: u64) -> f64 {
        let mut x = (seed << 32 ^ number).wrapping_add(0x9e37_79b9_7f4a_7c15);
        x = (x ^ x >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ x >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        (x ^ x >> 31) as f64 / u64::MAX as f64
    }

    fn random_mesh<const D: usize>(delaunay: &Delaunay<D>, count: u64, seed: u64) -> Mesh<D> {
        let points: Vec<[f64; D]> = (0..count)
            .map(|i| std::array::from_fn(|k| random(seed, i * D as u64 + k as u64)))
            .collect();
        delaunay.connect(&points, &mut Silent).unwrap()
    }

    /// The groups of cells of one label: of each its cells, in the order of their first.
    fn groups<const D: usize>(mesh: &Mesh<D>, labels: &[i32]) -> Vec<Vec<usize>> {
        let walls: Vec<[u32; D]> = (mesh.facets().iter())
            .filter(|f| f.neighbour.is_some_and(|n| labels[n as usize] != labels[f.cell as usize]))
            .map(|f| f.corners)
            .collect();
        let parts = components(mesh, &walls);
        let count = parts.iter().max().map_or(0, |&part| part as usize);
        let mut groups = vec![Vec::new(); count];
        parts.iter().enumerate().for_each(|(cell, &part)| groups[part as usize - 1].push(cell));
        groups
    }

    /// [`join_islands`] with all groups found again after every change.
    fn join_slowly<const D: usize>(mesh: &Mesh<D>, labels: &mut [i32], least: usize) -> usize {
        let before = labels.to_vec();
        loop {
            let mut islands = groups(mesh, labels);
            islands.retain(|group| group.len() < least);
            islands.sort_by_key(|group| (group.len(), group[0]));
            let label_beyond = |group: &Vec<usize>| {
                let beyond = mesh.facets().into_iter().filter_map(|facet| {
                    let (a, b) = (facet.cell as usize, facet.neighbour? as usize);
                    match (group.contains(&a), group.contains(&b)) {
                        (true, false) => Some(labels[b]),
                        (false, true) => Some(labels[a]),
                        _ => None,
                    }
                });
                let beyond: Vec<i32> = beyond.collect();
                let count = |label: i32| beyond.iter().filter(|&&other| other == label).count();
                beyond.iter().copied().max_by_key(|&label| (count(label), Reverse(label)))
            };
            let next = islands.iter().find_map(|group| Some((group, label_beyond(group)?)));
            let Some((group, label)) = next else { break };
            group.iter().for_each(|&cell| labels[cell] = label);
        }
        before.iter().zip(labels).filter(|(a, b)| *a != *b).count()
    }

    fn check<const D: usize>(delaunay: &Delaunay<D>, points: u64) {
        let mut changed = 0;
        for seed in 0..12 {
            let mesh = random_mesh(delaunay, points, seed);
            let kinds = 2 + seed % 3;
            let label = |cell: u64| (random(seed + 99, cell) * kinds as f64) as i32 - 1;
            let labels: Vec<i32> = (0..mesh.cell_count() as u64).map(label).collect();
            for least in [0, 1, 2, 3, 5, 9, 20, 1000] {
                let (mut fast, mut slow) = (labels.clone(), labels.clone());
                let counts =
                    [join_islands(&mesh, &mut fast, least), join_slowly(&mesh, &mut slow, least)];
                assert_eq!(fast, slow, "seed {seed}, least {least}");
                assert_eq!(counts[0], counts[1], "seed {seed}, least {least}");
                changed += counts[0];
            }
        }
        assert!(changed > 1000, "{changed}");
    }

    #[test]
    fn islands_join_as_if_all_were_found_again_after_every_change() {
        check(&Delaunay::<2>::new(), 60);
        check(&Delaunay::<3>::new(), 30);
    }

    /// A strip of triangles, each beside the next.
    fn strip(count: u32) -> Mesh<2> {
        let points = (0..count + 2).map(|i| [f64::from(i / 2), f64::from(i % 2)]).collect();
        let cell = |a: u32| if a.is_multiple_of(2) { [a, a + 2, a + 1] } else { [a, a + 1, a + 2] };
        Mesh::new(points, (0..count).flat_map(cell).collect()).unwrap()
    }

    #[test]
    fn neighbouring_islands_do_not_swap_their_labels() {
        let join = |labels: &[i32], least: usize| {
            let mut joined = labels.to_vec();
            let changed = join_islands(&strip(labels.len() as u32), &mut joined, least);
            (joined, changed)
        };
        // the first joins the second, and both are no island then
        assert_eq!(join(&[1, 2, 3, 3, 3], 2), (vec![2, 2, 3, 3, 3], 1));
        // a pair is one still where three are asked for
        assert_eq!(join(&[1, 2, 3, 3, 3], 3), (vec![3; 5], 2));
        assert_eq!(join(&[5, 5, 5, 1, 5, 5, 2, 2, 2], 2), (vec![5, 5, 5, 5, 5, 5, 2, 2, 2], 1));
        // no neighbour to join
        assert_eq!(join(&[4; 6], 1000), (vec![4; 6], 0));
        // the whole becomes one group, smaller than asked for
        assert_eq!(join(&[1, 2, 2], 9), (vec![2; 3], 1));
    }

    #[test]
    fn unknown_labels_come_from_the_nearest_known() {
        let labels = [None, None, Some(3), None, Some(1), Some(1), None, None, None];
        assert_eq!(fill_labels(&strip(9), &labels), [3, 3, 3, 1, 1, 1, 1, 1, 1]);
        assert_eq!(fill_labels(&strip(2), &[None, None]), [0, 0]);
    }
}
