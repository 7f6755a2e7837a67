//! Neighbour lists: for every atom, the others that are or may soon be within its cut-off.
//!
//! Found by a descent through the tree of boxes that 512 atoms, then 64 of them, then 8 share. Lists hold
//! each pair twice, once for either atom: an atom can then gather its own sum, in the same order at any
//! thread count.

use crate::parallel::prelude::*;

use super::lanes::{LANES, Lanes, Plain, WIDTH};
use super::tree::{NearBlocks, Tree};

/// Atoms whose lists are stored together, and the unit of parallel work: a group of level 1 in the tree.
pub(super) const CHUNK: usize = LANES * LANES * LANES;

/// The lists of [`CHUNK`] consecutive atoms.
#[derive(Clone, Debug, Default)]
pub(super) struct Chunk {
    pub lists: Vec<List>,
    /// The atoms of all lists. Every list is filled up to a multiple of [`WIDTH`] with its own atom.
    pub neighbors: Vec<u32>,
}

/// One atom's list within its chunk.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct List {
    pub start: u32,
    pub count: u32,
}

impl List {
    /// How many entries it has with those that fill it up.
    #[inline]
    pub fn padded(self) -> usize {
        (self.count as usize).next_multiple_of(WIDTH)
    }

    /// How many entries fill it up.
    #[inline]
    pub fn surplus(self) -> usize {
        self.padded() - self.count as usize
    }
}

/// The neighbours of all atoms, by chunks in the tree's order.
#[derive(Clone, Debug, Default)]
pub(super) struct NeighborLists {
    pub chunks: Vec<Chunk>,
}

/// What a search finds on its way down.
struct Found<const D: usize> {
    /// Groups near the chunk, twice: a level and the next.
    wide: [Vec<u32>; 2],
    /// Groups of blocks near one group of blocks.
    groups: Vec<u32>,
    /// Blocks near one block.
    blocks: NearBlocks<D>,
    /// Blocks near one atom.
    close: Vec<u32>,
}

impl<const D: usize> Default for Found<D> {
    fn default() -> Self {
        let (wide, blocks) = (Default::default(), NearBlocks::default());
        Self { wide, groups: Vec::new(), blocks, close: Vec::new() }
    }
}

impl NeighborLists {
    /// Lists, for every atom of the tree, those closer than the sum of both half reaches; `order` gives the
    /// atom at each place of the tree, and `is_own` says that this is the place's own number.
    pub fn build<const D: usize>(&mut self, tree: &Tree<D>, order: &[u32], is_own: bool) {
        self.chunks.resize_with(order.len().div_ceil(CHUNK), Chunk::default);
        let search = Search { tree, order, is_own };
        #[cfg(target_arch = "x86_64")]
        let (wide, more) = (super::lanes::has_avx2(), super::lanes::has_avx512());
        self.chunks.par_iter_mut().enumerate().for_each_init(
            Found::default,
            |found, (c, chunk)| {
                // SAFETY: the processor has been asked whether it has these instructions.
                #[cfg(target_arch = "x86_64")]
                unsafe {
                    if more {
                        return search.list_avx512(c, chunk, found);
                    }
                    if wide {
                        return search.list_avx2(c, chunk, found);
                    }
                }
                search.list::<Plain>(c, chunk, found);
            },
        );
    }
}

/// Where neighbours are looked for.
struct Search<'a, const D: usize> {
    tree: &'a Tree<D>,
    order: &'a [u32],
    is_own: bool,
}

impl<const D: usize> Search<'_, D> {
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,popcnt")]
    fn list_avx2(&self, c: usize, chunk: &mut Chunk, found: &mut Found<D>) {
        self.list::<super::lanes::Avx2>(c, chunk, found);
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,popcnt,avx512f,avx512vl,avx512dq,avx512bw")]
    fn list_avx512(&self, c: usize, chunk: &mut Chunk, found: &mut Found<D>) {
        self.list::<super::lanes::Avx2>(c, chunk, found);
    }

    /// Makes the lists of one chunk.
    #[inline(always)]
    fn list<L: Lanes>(&self, c: usize, chunk: &mut Chunk, found: &mut Found<D>) {
        let Self { tree, order, is_own } = *self;
        let Found { wide: [wide, next], groups, blocks, close } = found;
        chunk.lists.clear();
        let mut end = 0;
        let top = tree.height() - 1;
        wide.clear();
        wide.push(0);
        for level in (2..=top).rev() {
            tree.near::<L>(level, wide, &tree.extent(2, c), next);
            std::mem::swap(wide, next);
        }
        let block_count = tree.blocks.len();
        for group in (c * LANES..(c + 1) * LANES).take_while(|g| g * LANES < block_count) {
            if top >= 1 {
                tree.near::<L>(1, wide, &tree.extent(1, group), groups);
            } else {
                groups.clone_from(wide);
            }
            for block in (group * LANES..(group + 1) * LANES).take_while(|&b| b < block_count) {
                tree.near_blocks::<L>(groups, &tree.extent(0, block), blocks);
                let own = &tree.blocks[block];
                for (lane, &atom) in order[block * LANES..].iter().take(LANES).enumerate() {
                    let at = std::array::from_fn(|k| own.at[k][lane]);
                    let count = blocks.near::<L>(at, own.reach[lane], close);
                    let (start, room) = (end, end + LANES * (count + 1));
                    if chunk.neighbors.len() < room {
                        chunk.neighbors.resize(room + room / 4, 0);
                    }
                    let (at, close) = (AtLane { block, lane }, &close[..count]);
                    end = list_atom::<L, D>(tree, at, close, &mut chunk.neighbors, end);
                    let list = List { start: start as u32, count: (end - start) as u32 };
                    chunk.lists.push(list);
                    let found = &mut chunk.neighbors[start..end + WIDTH];
                    if !is_own {
                        found[..end - start].iter_mut().for_each(|j| *j = order[*j as usize]);
                    }
                    found[end - start..].fill(atom);
                    end = start + list.padded();
                }
            }
        }
    }
}

/// The place of an atom in the tree.
#[derive(Clone, Copy)]
struct AtLane {
    block: usize,
    lane: usize,
}

/// Appends the neighbours of one atom among those of `blocks` from `end` on; returns the new end.
#[inline(always)]
fn list_atom<L: Lanes, const D: usize>(
    tree: &Tree<D>,
    AtLane { block, lane }: AtLane,
    blocks: &[u32],
    neighbors: &mut [u32],
    mut end: usize,
) -> usize {
    let own = &tree.blocks[block];
    let at: [f32; D] = std::array::from_fn(|k| own.at[k][lane]);
    let reach = own.reach[lane];
    for &b in blocks {
        let other = &tree.blocks[b as usize];
        let (mut squared, mut limit) = ([0.0f32; LANES], [0.0f32; LANES]);
        for l in 0..LANES {
            for k in 0..D {
                let v = other.at[k][l] - at[k];
                squared[l] += v * v;
            }
            let sum = other.reach[l] + reach;
            limit[l] = sum * sum;
        }
        let mut near = L::less(&squared, &limit);
        if b as usize == block {
            near &= !(1 << lane);
        }
        let atoms = std::array::from_fn(|l| b * LANES as u32 + l as u32);
        neighbors[end..end + LANES].copy_from_slice(&L::front(&atoms, near));
        end += near.count_ones() as usize;
    }
    end
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg32;

    use super::super::tree::Scaling;
    use super::*;
    use crate::geometry::{Bounds, Point, compact_order, distance_squared};

    /// Lists of these atoms, by their indices, each sorted.
    fn lists_of<const D: usize>(atoms: &[Point<D>], range: &[f64]) -> Vec<Vec<u32>> {
        let Some(bounds) = Bounds::of(atoms) else { return Vec::new() };
        let scaling = Scaling::new(&bounds);
        let order = compact_order(atoms);
        let mut tree = Tree::default();
        tree.build(atoms.len(), |s| {
            let i = order[s] as usize;
            (scaling.place(&atoms[i]), scaling.half(range[i]))
        });
        let mut lists = NeighborLists::default();
        lists.build(&tree, &order, false);
        let mut out = vec![Vec::new(); atoms.len()];
        for (c, chunk) in lists.chunks.iter().enumerate() {
            for (a, list) in chunk.lists.iter().enumerate() {
                let atom = order[c * CHUNK + a];
                let padded = &chunk.neighbors[list.start as usize..][..list.padded()];
                let (found, fill) = padded.split_at(list.count as usize);
                assert!(fill.len() < WIDTH && fill.iter().all(|&j| j == atom));
                let mut found = found.to_vec();
                found.sort_unstable();
                out[atom as usize] = found;
            }
        }
        out
    }

    fn direct<const D: usize>(atoms: &[Point<D>], range: &[f64]) -> Vec<Vec<u32>> {
        (0..atoms.len())
            .map(|i| {
                (0..atoms.len() as u32)
                    .filter(|&j| {
                        let r = 0.5 * (range[i] + range[j as usize]);
                        j as usize != i && distance_squared(&atoms[j as usize], &atoms[i]) < r * r
                    })
                    .collect()
            })
            .collect()
    }

    /// All within reach are listed, and none farther than rounding to single precision explains.
    fn assert_lists<const D: usize>(atoms: &[Point<D>], range: &[f64], what: &str) {
        let extent = Bounds::of(atoms).unwrap().longest_edge();
        let longer: Vec<f64> = range.iter().map(|r| r * (1.0 + 1e-5) + 1e-5 * extent).collect();
        let (least, most) = (direct(atoms, range), direct(atoms, &longer));
        for (i, found) in lists_of(atoms, range).iter().enumerate() {
            assert!(found.windows(2).all(|w| w[0] < w[1]), "{what}: atom {i} lists one twice");
            assert!(least[i].iter().all(|j| found.contains(j)), "{what}: atom {i} lacks one");
            assert!(found.iter().all(|j| most[i].contains(j)), "{what}: atom {i} has one too far");
        }
    }

    /// Ranges that grow along x from 1 to 10, atoms denser where ranges are short.
    fn graded_lists_are_the_direct_ones<const D: usize>() {
        for (seed, count) in [(0, 1), (1, 7), (2, 8), (3, 65), (4, 513), (5, 900), (6, 1100)] {
            let mut random = Pcg32::seed_from_u64(seed);
            let atoms: Vec<Point<D>> = (0..count)
                .map(|_| {
                    let mut p: Point<D> = std::array::from_fn(|_| 40.0 * random.random::<f64>());
                    p[0] = 40.0 * random.random::<f64>().powi(3);
                    p
                })
                .collect();
            let range: Vec<f64> = atoms.iter().map(|p| 1.0 + 9.0 / 40.0 * p[0]).collect();
            assert_lists(&atoms, &range, &format!("{count} atoms"));
        }
    }

    #[test]
    fn lists_are_those_of_the_double_loop() {
        graded_lists_are_the_direct_ones::<2>();
        graded_lists_are_the_direct_ones::<3>();
    }

    #[test]
    fn atoms_far_apart_or_at_one_place_make_lists_too() {
        let atoms = vec![[0.0, 0.0], [0.0, 0.0], [1e9, 1e-9]];
        assert_eq!(lists_of(&atoms, &[1.0; 3]), vec![vec![1], vec![0], vec![]]);
        assert_eq!(lists_of(&[[1.0, 1.0]; 9], &[1.0; 9])[3], vec![0, 1, 2, 4, 5, 6, 7, 8]);
        assert!(lists_of::<2>(&[], &[]).is_empty());
    }

    #[test]
    fn wide_registers_find_the_same_lists() {
        let mut random = Pcg32::seed_from_u64(7);
        let atoms: Vec<Point<3>> =
            (0..1500).map(|_| std::array::from_fn(|_| 10.0 * random.random::<f64>())).collect();
        let scaling = Scaling::new(&Bounds::of(&atoms).unwrap());
        let mut tree = Tree::default();
        tree.build(atoms.len(), |s| (scaling.place(&atoms[s]), scaling.half(1.0)));
        let order: Vec<u32> = (0..atoms.len() as u32).rev().collect();
        let mut lists = NeighborLists::default();
        lists.build(&tree, &order, false);
        let search = Search { tree: &tree, order: &order, is_own: false };
        for (c, chunk) in lists.chunks.iter().enumerate() {
            let (mut plain, mut found) = (Chunk::default(), Found::default());
            search.list::<Plain>(c, &mut plain, &mut found);
            assert_eq!(plain.lists, chunk.lists);
            let last = plain.lists[plain.lists.len() - 1];
            let end = last.start as usize + last.padded();
            assert_eq!(plain.neighbors[..end], chunk.neighbors[..end]);
        }
    }
}
