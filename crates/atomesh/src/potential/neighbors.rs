//! Neighbour lists over a graded cell structure.
//!
//! Coarse cells are as wide as the longest reach; each is divided on its own, so that a fine cell holds
//! about one atom whatever the local density is, and the cost does not grow with d_max/d_min. Atoms are
//! copied in cell order, so that a query reads memory in runs. Lists hold each pair twice, once for
//! either atom: an atom can then gather its own sum, in the same order at any thread count.

use rayon::prelude::*;

use crate::geometry::{Bounds, Point, distance_squared};

/// Atoms whose lists are stored together, and the unit of parallel work.
pub(super) const CHUNK: usize = 512;

/// Coarse cells are this many times as wide as the longest reach: wide enough that most balls touch few
/// of them, narrow enough that d varies little within one.
const WIDTH: f64 = 4.0;

/// The lists of [`CHUNK`] consecutive atoms.
#[derive(Clone, Debug, Default)]
pub(super) struct Chunk {
    /// Where each atom's list starts in `neighbors`, and where the last ends.
    pub starts: Vec<u32>,
    pub neighbors: Vec<u32>,
}

/// The neighbours of all atoms.
#[derive(Clone, Debug, Default)]
pub(super) struct NeighborLists {
    pub chunks: Vec<Chunk>,
}

/// How far each atom looks.
pub(super) struct Reach<'a> {
    /// Atoms i and j are neighbours if they are closer than the mean of their ranges.
    pub range: &'a [f64],
    /// By how much a range may differ from one atom to another, per unit of their distance.
    pub slope: f64,
}

impl Reach<'_> {
    /// The farthest neighbour that atom i can have: r < (cᵢ + cⱼ)/2 with cⱼ ≤ min(cᵢ + slope·r, c_max).
    fn farthest(&self, i: usize, longest: f64) -> f64 {
        let widest = 0.5 * (self.range[i] + longest);
        let share = 1.0 - 0.5 * self.slope;
        if share > 0.0 { widest.min(self.range[i] / share) } else { widest }
    }
}

impl NeighborLists {
    /// Lists, for every atom, those within reach, in an order that depends on the atoms alone.
    pub fn build<const D: usize>(&mut self, atoms: &[Point<D>], reach: &Reach<'_>) {
        self.chunks.resize_with(atoms.len().div_ceil(CHUNK), Chunk::default);
        let Some(bounds) = Bounds::of(atoms) else { return };
        let longest = reach.range.iter().copied().fold(0.0, f64::max);
        let cells = Cells::new(atoms, reach.range, &bounds, WIDTH * longest);
        self.chunks.par_iter_mut().enumerate().for_each(|(c, chunk)| {
            chunk.starts.clear();
            chunk.neighbors.clear();
            let mut found: Vec<u32> = Vec::new();
            for i in c * CHUNK..((c + 1) * CHUNK).min(atoms.len()) {
                chunk.starts.push(chunk.neighbors.len() as u32);
                let (at, range) = (&atoms[i], reach.range[i]);
                let mut count = 0;
                cells.visit(at, reach.farthest(i, longest), |order, sorted| {
                    // Room for the whole run, filled without a branch.
                    if found.len() < count + order.len() {
                        found.resize(2 * (count + order.len()), 0);
                    }
                    let found = &mut found[count..];
                    let mut more = 0;
                    for (&j, q) in order.iter().zip(sorted) {
                        let within = 0.5 * (range + q.range);
                        let near = distance_squared(&q.at, at) < within * within;
                        found[more] = j;
                        more += usize::from(near & (j as usize != i));
                    }
                    count += more;
                });
                chunk.neighbors.extend_from_slice(&found[..count]);
            }
            chunk.starts.push(chunk.neighbors.len() as u32);
        });
    }

    /// How many neighbours all lists hold together.
    #[cfg(test)]
    fn len(&self) -> usize {
        self.chunks.iter().map(|c| c.neighbors.len()).sum()
    }
}

/// Atoms sorted into coarse cells, each finely divided on its own.
struct Cells<const D: usize> {
    origin: Point<D>,
    width: f64,
    /// 1 / width.
    scale: f64,
    shape: [usize; D],
    /// Per coarse cell: its number of divisions along each axis, and its first fine cell.
    divisions: Vec<u32>,
    first_fine: Vec<u32>,
    /// Per fine cell: its first entry in `order`.
    starts: Vec<u32>,
    order: Vec<u32>,
    sorted: Vec<Sorted<D>>,
}

/// An atom as a query reads it.
#[derive(Clone, Copy)]
struct Sorted<const D: usize> {
    at: Point<D>,
    range: f64,
}

impl<const D: usize> Cells<D> {
    fn new(atoms: &[Point<D>], range: &[f64], bounds: &Bounds<D>, width: f64) -> Self {
        // At most a few coarse cells an atom, however far apart atoms are.
        let extent = bounds.extent();
        let mut width = if width > 0.0 { width } else { 1.0 };
        let limit = 8.0 * atoms.len() as f64 + 64.0;
        while extent.iter().map(|e| (e / width).floor() + 1.0).product::<f64>() > limit {
            width *= 1.5;
        }
        let shape = extent.map(|e| (e / width) as usize + 1);
        let mut cells = Self {
            origin: bounds.min,
            width,
            scale: 1.0 / width,
            shape,
            divisions: Vec::new(),
            first_fine: Vec::new(),
            starts: Vec::new(),
            order: Vec::new(),
            sorted: Vec::new(),
        };
        let coarse: Vec<u32> = atoms.par_iter().map(|p| cells.coarse_of(p) as u32).collect();
        cells.divide(&coarse);
        cells.sort(atoms, range, &coarse);
        cells
    }

    /// Divides each coarse cell so that its fine cells hold about one atom.
    fn divide(&mut self, coarse: &[u32]) {
        let mut counts = vec![0u32; self.shape.iter().product()];
        coarse.iter().for_each(|&c| counts[c as usize] += 1);
        self.divisions = counts
            .iter()
            .map(|&n| f64::from(n).powf(1.0 / D as f64).round().max(1.0) as u32)
            .collect();
        let mut total = 0u32;
        self.first_fine = self
            .divisions
            .iter()
            .map(|m| {
                let first = total;
                total += m.pow(D as u32);
                first
            })
            .collect();
        self.first_fine.push(total);
    }

    /// Counting sort of the atoms by fine cell, stable in the atoms' order.
    fn sort(&mut self, atoms: &[Point<D>], range: &[f64], coarse: &[u32]) {
        let fine: Vec<u32> = atoms
            .par_iter()
            .zip(coarse)
            .map(|(p, &c)| self.first_fine[c as usize] + self.fine_of(p, c as usize))
            .collect();
        let count = self.first_fine[self.divisions.len()] as usize;
        let mut starts = vec![0u32; count + 1];
        fine.iter().for_each(|&f| starts[f as usize + 1] += 1);
        for f in 0..count {
            starts[f + 1] += starts[f];
        }
        let mut next = starts.clone();
        let mut order = vec![0u32; atoms.len()];
        for (i, &f) in fine.iter().enumerate() {
            order[next[f as usize] as usize] = i as u32;
            next[f as usize] += 1;
        }
        let sorted = |&i: &u32| Sorted { at: atoms[i as usize], range: range[i as usize] };
        self.sorted = order.par_iter().map(sorted).collect();
        (self.starts, self.order) = (starts, order);
    }

    fn coarse_of(&self, p: &Point<D>) -> usize {
        let mut index = 0;
        for k in (0..D).rev() {
            let i = ((p[k] - self.origin[k]) * self.scale) as usize;
            index = index * self.shape[k] + i.min(self.shape[k] - 1);
        }
        index
    }

    /// The fine cell of a coordinate, within its coarse cell `i` along axis k of `m` divisions.
    #[inline]
    fn fine_along(&self, x: f64, k: usize, i: usize, m: u32) -> u32 {
        let offset = (x - self.origin[k]) * self.scale - i as f64;
        ((offset * f64::from(m)) as u32).min(m - 1)
    }

    fn fine_of(&self, p: &Point<D>, coarse: usize) -> u32 {
        let m = self.divisions[coarse];
        let mut rest = coarse;
        let (mut index, mut stride) = (0, 1);
        for k in 0..D {
            let i = rest % self.shape[k];
            rest /= self.shape[k];
            index += self.fine_along(p[k], k, i, m) * stride;
            stride *= m;
        }
        index
    }

    /// Calls `span` with runs of atoms, their indices and themselves, that together hold all in the ball
    /// of this radius around `p`, and some beyond it.
    #[inline]
    fn visit(&self, p: &Point<D>, radius: f64, mut span: impl FnMut(&[u32], &[Sorted<D>])) {
        let (mut low, mut high) = ([0usize; D], [0usize; D]);
        for k in 0..D {
            low[k] = ((p[k] - radius - self.origin[k]) * self.scale) as usize; // below 0 counts as 0
            high[k] = ((p[k] + radius - self.origin[k]) * self.scale) as usize;
            high[k] = high[k].min(self.shape[k] - 1);
            low[k] = low[k].min(high[k]);
        }
        // a rounding of a cell's side must not cut an atom off
        let slack = radius * radius * (1.0 + 1e-9);
        for_each_index(&low, &high, |coarse| {
            let mut index = 0;
            for k in (0..D).rev() {
                index = index * self.shape[k] + coarse[k];
            }
            let m = self.divisions[index];
            let base = self.first_fine[index] as usize;
            let (mut fine_low, mut fine_high) = ([0usize; D], [0usize; D]);
            for k in 1..D {
                fine_low[k] = self.fine_along(p[k] - radius, k, coarse[k], m) as usize;
                fine_high[k] = self.fine_along(p[k] + radius, k, coarse[k], m) as usize;
            }
            let (count, width) = (m as usize, self.width / f64::from(m));
            let scale = self.scale * f64::from(m);
            let corner: Point<D> =
                std::array::from_fn(|k| self.origin[k] + self.width * coarse[k] as f64);
            let offset = p[0] - corner[0];
            for_each_index(&fine_low, &fine_high, |fine| {
                // Of a row of cells along x only what the ball can reach: its run of atoms is one span.
                let (mut beside, mut row) = (0.0, 0);
                for k in (1..D).rev() {
                    let low = corner[k] + width * fine[k] as f64;
                    let gap = (low - p[k]).max(p[k] - (low + width)).max(0.0);
                    beside += gap * gap;
                    row = (row + fine[k]) * count;
                }
                let half = slack - beside;
                if half < 0.0 {
                    return;
                }
                let half = half.sqrt();
                // casts take what is below 0 as 0
                let from = (((offset - half) * scale) as usize).min(count - 1);
                let to = (((offset + half) * scale) as usize).min(count - 1);
                let first = base + row;
                let run = self.starts[first + from] as usize..self.starts[first + to + 1] as usize;
                span(&self.order[run.clone()], &self.sorted[run]);
            });
        });
    }
}

/// Calls `each` with every index from `low` to `high`, both included, x fastest.
#[inline]
fn for_each_index<const D: usize>(
    low: &[usize; D],
    high: &[usize; D],
    mut each: impl FnMut(&[usize; D]),
) {
    let mut index = *low;
    loop {
        each(&index);
        let mut k = 0;
        loop {
            index[k] += 1;
            if index[k] <= high[k] {
                break;
            }
            index[k] = low[k];
            k += 1;
            if k == D {
                return;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg32;

    use super::*;

    fn sorted_lists(lists: &NeighborLists) -> Vec<Vec<u32>> {
        let mut out = Vec::new();
        for chunk in &lists.chunks {
            for w in chunk.starts.windows(2) {
                let mut list = chunk.neighbors[w[0] as usize..w[1] as usize].to_vec();
                list.sort_unstable();
                out.push(list);
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

    /// Ranges that grow along x from 1 to 10, atoms denser where ranges are short.
    fn graded_lists_equal_the_direct_ones<const D: usize>() {
        for seed in 0..6 {
            let mut random = Pcg32::seed_from_u64(seed);
            let atoms: Vec<Point<D>> = (0..900)
                .map(|_| {
                    let mut p: Point<D> = std::array::from_fn(|_| 40.0 * random.random::<f64>());
                    p[0] = 40.0 * random.random::<f64>().powi(3);
                    p
                })
                .collect();
            let slope = 9.0 / 40.0;
            let range: Vec<f64> = atoms.iter().map(|p| 1.0 + slope * p[0]).collect();
            let mut lists = NeighborLists::default();
            lists.build(&atoms, &Reach { range: &range, slope });
            assert!(lists.len() > 900);
            assert_eq!(sorted_lists(&lists), direct(&atoms, &range), "seed {seed}");
        }
    }

    #[test]
    fn lists_are_those_of_the_double_loop() {
        graded_lists_equal_the_direct_ones::<2>();
        graded_lists_equal_the_direct_ones::<3>();
    }

    #[test]
    fn atoms_far_apart_or_at_one_place_make_lists_too() {
        let atoms = vec![[0.0, 0.0], [0.0, 0.0], [1e9, 1e-9]];
        let range = vec![1.0; 3];
        let mut lists = NeighborLists::default();
        lists.build(&atoms, &Reach { range: &range, slope: 0.0 });
        assert_eq!(sorted_lists(&lists), vec![vec![1], vec![0], vec![]]);
        lists.build::<2>(&[], &Reach { range: &[], slope: 0.0 });
        assert!(lists.chunks.is_empty());
    }
}
