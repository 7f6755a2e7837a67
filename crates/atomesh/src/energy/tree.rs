//! A tree of boxes over atoms: who may be near whom.
//!
//! Atoms are put in an order in which eight that follow each other are near each other: the set is
//! halved across its longest side, and the halves again, at multiples of eight. Eight atoms make a
//! block, eight blocks a group, eight groups one of the next level, each with its bounding box: nothing
//! else is stored, and a tree over atoms that have moved a little is rebuilt in one pass.
//! Boxes fit the atoms' density wherever they are, so the cost of a search does not grow with
//! d_max/d_min.
//!
//! The tree works in single precision, in units of the atoms' extent; reaches are lengthened by what that
//! may round off, so a search finds all within reach and may find some just beyond.

use crate::parallel::prelude::*;

use crate::geometry::{Bounds, Point};

use super::lanes::{LANES, Lanes};

/// Eight atoms side by side: a leaf.
#[derive(Clone, Copy)]
pub(super) struct Block<const D: usize> {
    pub at: [[f32; LANES]; D],
    /// Half of how far each atom looks.
    pub reach: [f32; LANES],
}

/// Eight boxes side by side: those of eight blocks, or of eight groups of the level below.
#[derive(Clone, Copy)]
struct Boxes<const D: usize> {
    low: [[f32; LANES]; D],
    high: [[f32; LANES]; D],
    reach: [f32; LANES],
}

impl<const D: usize> Boxes<D> {
    /// Which of them are within reach of a box.
    #[inline(always)]
    fn within<L: Lanes>(&self, target: &Extent<D>) -> u8 {
        let (mut gap_squared, mut reach_squared) = ([0.0f32; LANES], [0.0f32; LANES]);
        for l in 0..LANES {
            for k in 0..D {
                // compared by hand: f32::max handles NaN, which doubles the cost
                let below = self.low[k][l] - target.high[k];
                let above = target.low[k] - self.high[k][l];
                let gap = if below > above { below } else { above };
                let gap = if gap > 0.0 { gap } else { 0.0 };
                gap_squared[l] += gap * gap;
            }
            let reach = self.reach[l] + target.reach;
            reach_squared[l] = reach * reach;
        }
        L::less(&gap_squared, &reach_squared)
    }
}

/// Blocks, and their boxes side by side.
pub(super) struct NearBlocks<const D: usize> {
    count: usize,
    blocks: Vec<u32>,
    low: [Vec<f32>; D],
    high: [Vec<f32>; D],
    reach: Vec<f32>,
}

impl<const D: usize> Default for NearBlocks<D> {
    fn default() -> Self {
        Self {
            count: 0,
            blocks: Vec::new(),
            low: std::array::from_fn(|_| Vec::new()),
            high: std::array::from_fn(|_| Vec::new()),
            reach: Vec::new(),
        }
    }
}

impl<const D: usize> NearBlocks<D> {
    /// Room for so many groups.
    fn make_room(&mut self, groups: usize) {
        let room = groups * LANES;
        if self.blocks.len() < room {
            self.blocks.resize(room, 0);
            self.reach.resize(room, 0.0);
            self.low.iter_mut().chain(&mut self.high).for_each(|side| side.resize(room, 0.0));
        }
    }

    /// Writes into `found` those within reach of an atom; what follows them is unspecified. Returns their
    /// number.
    #[inline(always)]
    pub fn near<L: Lanes>(&self, at: [f32; D], reach: f32, found: &mut Vec<u32>) -> usize {
        if found.len() < self.blocks.len() + LANES {
            found.resize(self.blocks.len() + LANES, 0);
        }
        let target = Extent { low: at, high: at, reach };
        let mut end = 0;
        for first in (0..self.count).step_by(LANES) {
            let boxes = Boxes {
                low: std::array::from_fn(|k| take(&self.low[k], first)),
                high: std::array::from_fn(|k| take(&self.high[k], first)),
                reach: take(&self.reach, first),
            };
            let near = boxes.within::<L>(&target);
            let front = L::front(&take(&self.blocks, first), near);
            found[end..end + LANES].copy_from_slice(&front);
            end += near.count_ones() as usize;
        }
        end
    }
}

#[inline(always)]
fn take<T: Copy>(all: &[T], first: usize) -> [T; LANES] {
    *all[first..].first_chunk().expect("room for whole lanes")
}

#[inline(always)]
fn put(all: &mut [f32], first: usize, lanes: [u32; LANES]) {
    all[first..first + LANES].copy_from_slice(&lanes.map(f32::from_bits));
}

/// One box, and the longest reach in it.
#[derive(Clone, Copy)]
pub(super) struct Extent<const D: usize> {
    low: [f32; D],
    high: [f32; D],
    reach: f32,
}

impl<const D: usize> Extent<D> {
    const EMPTY: Self = Self { low: [f32::INFINITY; D], high: [f32::NEG_INFINITY; D], reach: 0.0 };

    #[inline]
    fn grow(&mut self, other: &Self) {
        for k in 0..D {
            self.low[k] = self.low[k].min(other.low[k]);
            self.high[k] = self.high[k].max(other.high[k]);
        }
        self.reach = self.reach.max(other.reach);
    }

    /// The sum of its sides.
    fn girth(&self) -> f32 {
        (0..D).map(|k| (self.high[k] - self.low[k]).max(0.0)).sum()
    }
}

/// Coordinates in units of the extent, from 0 to 1.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scaling<const D: usize> {
    origin: Point<D>,
    scale: f64,
}

/// More than coordinates in 0…1 and their differences lose by rounding to single precision: 2⁻²⁵ each,
/// some six times in a distance.
const ROUNDING: f64 = 1e-6;

impl<const D: usize> Scaling<D> {
    pub fn new(bounds: &Bounds<D>) -> Self {
        let longest = bounds.longest_edge();
        let scale = if longest > 0.0 { 1.0 / longest } else { 1.0 };
        Self { origin: bounds.min, scale }
    }

    #[inline]
    pub fn place(&self, p: &Point<D>) -> [f32; D] {
        std::array::from_fn(|k| ((p[k] - self.origin[k]) * self.scale) as f32)
    }

    /// Half a reach, lengthened by what rounding may lose.
    #[inline]
    pub fn half(&self, reach: f64) -> f32 {
        (0.5 * (reach * self.scale * (1.0 + ROUNDING) + ROUNDING)) as f32
    }
}

/// The boxes of atoms in their order.
#[derive(Clone, Default)]
pub(super) struct Tree<const D: usize> {
    pub blocks: Vec<Block<D>>,
    /// Level 0 holds the blocks' boxes, the last level one entry.
    levels: Vec<Vec<Boxes<D>>>,
}

impl<const D: usize> Tree<D> {
    /// Rebuilds the tree: `atom` gives the place and half reach of each atom in the tree's order.
    pub fn build(&mut self, count: usize, atom: impl Fn(usize) -> ([f32; D], f32) + Sync) {
        let nowhere = Block { at: [[f32::INFINITY; LANES]; D], reach: [0.0; LANES] };
        self.blocks.resize(count.div_ceil(LANES), nowhere);
        self.blocks.par_iter_mut().with_min_len(256).enumerate().for_each(|(b, block)| {
            *block = nowhere;
            for l in 0..LANES.min(count - b * LANES) {
                let (at, reach) = atom(b * LANES + l);
                (0..D).for_each(|k| block.at[k][l] = at[k]);
                block.reach[l] = reach;
            }
        });
        self.levels.clear();
        let blocks = &self.blocks;
        let mut level = boxes(blocks.len(), |b| extent_of_block(&blocks[b]));
        while level.len() > 1 {
            let next = boxes(level.len(), |g| extent_of_group(&level[g]));
            self.levels.push(std::mem::replace(&mut level, next));
        }
        self.levels.push(level);
    }

    /// The box of a block, at level 0, or of a group of the level below.
    #[inline]
    pub fn extent(&self, level: usize, index: usize) -> Extent<D> {
        let (boxes, l) = (&self.levels[level][index / LANES], index % LANES);
        Extent {
            low: std::array::from_fn(|k| boxes.low[k][l]),
            high: std::array::from_fn(|k| boxes.high[k][l]),
            reach: boxes.reach[l],
        }
    }

    /// How many levels of boxes there are.
    pub fn height(&self) -> usize {
        self.levels.len()
    }

    /// Writes into `found` those children of the groups of a level that are within reach of a box, in
    /// ascending order.
    #[inline(always)]
    pub fn near<L: Lanes>(
        &self,
        level: usize,
        groups: &[u32],
        target: &Extent<D>,
        found: &mut Vec<u32>,
    ) {
        found.clear();
        for &group in groups {
            let near = self.levels[level][group as usize].within::<L>(target);
            let children = std::array::from_fn(|l| group * LANES as u32 + l as u32);
            found.extend_from_slice(&L::front(&children, near)[..near.count_ones() as usize]);
        }
    }

    /// Writes into `found` the blocks of these groups that are within reach of a box, with their boxes.
    #[inline(always)]
    pub fn near_blocks<L: Lanes>(
        &self,
        groups: &[u32],
        target: &Extent<D>,
        found: &mut NearBlocks<D>,
    ) {
        found.make_room(groups.len() + 1);
        let mut end = 0;
        for &group in groups {
            let boxes = &self.levels[0][group as usize];
            let near = boxes.within::<L>(target);
            let children = std::array::from_fn(|l| group * LANES as u32 + l as u32);
            let front = |lanes: &[f32; LANES]| L::front(&lanes.map(f32::to_bits), near);
            found.blocks[end..end + LANES].copy_from_slice(&L::front(&children, near));
            for k in 0..D {
                put(&mut found.low[k], end, front(&boxes.low[k]));
                put(&mut found.high[k], end, front(&boxes.high[k]));
            }
            put(&mut found.reach, end, front(&boxes.reach));
            end += near.count_ones() as usize;
        }
        found.count = end;
        // what lies behind the last is near nothing
        found.low[0][end..end + LANES].fill(f32::INFINITY);
    }

    /// How compact the blocks are: the sum of their boxes' sides.
    pub fn girth(&self) -> f64 {
        self.levels[0]
            .iter()
            .enumerate()
            .map(|(g, _)| {
                let all = (0..LANES).map(|l| f64::from(self.extent(0, g * LANES + l).girth()));
                all.sum::<f64>()
            })
            .sum()
    }
}

/// The boxes of `count` things, eight side by side.
fn boxes<const D: usize>(
    count: usize,
    extent: impl Fn(usize) -> Extent<D> + Sync,
) -> Vec<Boxes<D>> {
    let group = |g: usize| {
        let mut out =
            Boxes { low: [[0.0; LANES]; D], high: [[0.0; LANES]; D], reach: [0.0; LANES] };
        for l in 0..LANES {
            let i = g * LANES + l;
            let e = if i < count { extent(i) } else { Extent::EMPTY };
            for k in 0..D {
                (out.low[k][l], out.high[k][l]) = (e.low[k], e.high[k]);
            }
            out.reach[l] = e.reach;
        }
        out
    };
    (0..count.div_ceil(LANES)).into_par_iter().with_min_len(64).map(group).collect()
}

fn extent_of_block<const D: usize>(block: &Block<D>) -> Extent<D> {
    let mut extent = Extent::EMPTY;
    for l in (0..LANES).filter(|&l| block.at[0][l] < f32::INFINITY) {
        let at = std::array::from_fn(|k| block.at[k][l]);
        extent.grow(&Extent { low: at, high: at, reach: block.reach[l] });
    }
    extent
}

fn extent_of_group<const D: usize>(boxes: &Boxes<D>) -> Extent<D> {
    let mut extent = Extent::EMPTY;
    for l in 0..LANES {
        extent.grow(&Extent {
            low: std::array::from_fn(|k| boxes.low[k][l]),
            high: std::array::from_fn(|k| boxes.high[k][l]),
            reach: boxes.reach[l],
        });
    }
    extent
}
