//! Averages over cells: an image smoothed by a wide Gaussian, held as coarsely as it may be.
//!
//! An image smoothed by a Gaussian of standard deviation σ need not be held at every sample. Cells are at
//! most σ/3 wide and divide each axis evenly, so that they end where the image ends and mirrored
//! samples are mirrored cells. With σ = 12 a volume has a 64th as many cells as samples, and smoothing
//! them takes next to no time. Samples are averaged over cells as they stream by. The averages are smoothed by a
//! narrower Gaussian, and read by linear interpolation; the variances of cells and of interpolation are taken off σ².
//!
//! Cost: a few additions per sample and entry.

use super::gaussian;
use super::stream::{Run, Stream};
use crate::parallel::prelude::*;
use crate::watch::{Cancelled, Phase, Watch, check};
use std::ops::Range;

/// Cells per standard deviation of the smoothing.
const CELLS_PER_SIGMA: f64 = 3.0;

/// The variance, in squared widths, of a cell and of linear interpolation between cells: 1/12 + 1/6.
const CELL_VARIANCE: f64 = 0.25;

/// Samples between two looks at the watch: a fraction of a second's work.
const BATCH_SAMPLES: usize = 1 << 24;

/// Some numbers per sample, smoothed and held per cell.
#[derive(Clone, Debug)]
pub(crate) struct CellAverages<const D: usize> {
    shape: [usize; D],
    /// Cells along each axis.
    cells: [usize; D],
    /// The numbers of all cells, entry by entry.
    entries: Vec<Vec<f32>>,
}

/// The numbers of each sample of a stream that are averaged.
pub(crate) trait Entries<const D: usize>: Sync {
    /// How many numbers a sample has.
    fn count(&self) -> usize;

    /// Writes number `entry` of the samples with these smoothed values and slopes.
    fn write(&self, entry: usize, average: &[f32], slopes: [&[f32]; D], out: &mut [f32]);
}

impl<const D: usize> CellAverages<D> {
    /// The averages of the numbers that `entries` makes of a stream, smoothed by Gaussians of standard deviations
    /// `smooth`, in samples; 0 leaves an axis alone. No axis of `shape` is empty.
    ///
    /// # Errors
    /// [`Cancelled`] if the watch ends the work.
    pub(crate) fn new<F: Fn(usize, &mut [f32]) + Sync>(
        stream: &Stream<F, D>,
        shape: [usize; D],
        smooth: [f64; D],
        entries: &impl Entries<D>,
        watch: &mut dyn Watch,
    ) -> Result<Self, Cancelled> {
        let cells: [usize; D] = std::array::from_fn(|k| {
            let width = (smooth[k] / CELLS_PER_SIGMA).max(1.0);
            (shape[k] as f64 / width).ceil() as usize
        });
        let count = cells.iter().product();
        let empty = vec![vec![0.0; count]; entries.count()];
        let mut averages = Self { shape, cells, entries: empty };
        averages.average(stream, entries, watch)?;
        let sigma = averages.cell_sigma(smooth);
        averages.entries.iter_mut().for_each(|entry| gaussian(entry, cells, sigma));
        Ok(averages)
    }

    /// The standard deviation of the rest of the smoothing, in cells.
    fn cell_sigma(&self, smooth: [f64; D]) -> [f64; D] {
        std::array::from_fn(|k| {
            let width = self.shape[k] as f64 / self.cells[k] as f64;
            let own = if width > 1.0 { CELL_VARIANCE } else { 0.0 };
            ((smooth[k] / width).powi(2) - own).max(0.0).sqrt()
        })
    }

    /// Adds the entries of all samples to the cells.
    fn average<F: Fn(usize, &mut [f32]) + Sync>(
        &mut self,
        stream: &Stream<F, D>,
        entries: &impl Entries<D>,
        watch: &mut dyn Watch,
    ) -> Result<(), Cancelled> {
        let (planes, layers) = (self.shape[D - 1], self.cells[D - 1]);
        let shares = std::array::from_fn(|k| shares(self.shape[k], self.cells[k]));
        let layer: usize = self.cells[..D - 1].iter().product();
        let threads = rayon::current_num_threads();
        let fair = planes.div_ceil(2 * threads).max(stream.least_planes());
        let task = (fair * layers).div_ceil(planes).clamp(1, layers);
        let batch = (BATCH_SAMPLES / stream.plane() / fair).max(threads);
        let mut parts: Vec<_> =
            self.entries.iter_mut().map(|entry| entry.chunks_mut(task * layer)).collect();
        let mut tasks: Vec<Vec<&mut [f32]>> = (0..layers.div_ceil(task))
            .map(|_| parts.iter_mut().filter_map(Iterator::next).collect())
            .collect();
        let count = tasks.len();
        for (b, tasks) in tasks.chunks_mut(batch).enumerate() {
            check(watch, Phase::Potential, (b * batch) as f64 / count as f64, None)?;
            tasks.par_iter_mut().enumerate().for_each(|(t, parts)| {
                let first = (b * batch + t) * task;
                let part = first..first + parts[0].len() / layer;
                let planes = part.start * planes / layers..(part.end * planes).div_ceil(layers);
                let mut sums = Sums::new(&shares, self.cells, part, parts);
                stream.run(planes, &mut |run| sums.add(run, stream.plane(), entries));
            });
        }
        Ok(())
    }

    /// The cells around a sample's row along the first axis.
    pub(crate) fn row(&self, sample: [usize; D]) -> CellRow<'_, D> {
        let mut corners = [(0, 1.0f32); 4];
        let (mut count, mut stride) = (1, self.cells[0]);
        for k in 1..D {
            let (cell, share) = place(sample[k], self.shape[k], self.cells[k]);
            let next = if self.cells[k] > 1 { stride } else { 0 };
            for i in 0..count {
                let (start, weight) = corners[i];
                corners[i] = (start + cell * stride, weight * (1.0 - share));
                corners[count + i] = (start + cell * stride + next, weight * share);
            }
            count *= 2;
            stride *= self.cells[k];
        }
        CellRow { averages: self, corners, count }
    }
}

/// The cells around a row of samples.
pub(crate) struct CellRow<'a, const D: usize> {
    averages: &'a CellAverages<D>,
    /// Where rows of cells begin, and their weights.
    corners: [(usize, f32); 4],
    count: usize,
}

impl<const D: usize> CellRow<'_, D> {
    /// All entries of all cells of the row, entry by entry.
    pub(crate) fn cells(&self, out: &mut Vec<f32>) {
        let m = self.averages.cells[0];
        out.clear();
        for entry in &self.averages.entries {
            out.extend((0..m).map(|cell| self.cell(entry, cell)));
        }
    }

    /// The numbers of the two cells around sample `x`, and the share of the second.
    pub(crate) fn place(&self, x: usize) -> (usize, usize, f32) {
        let m = self.averages.cells[0];
        let (cell, share) = place(x, self.averages.shape[0], m);
        (cell, (cell + 1).min(m - 1), share)
    }

    /// An entry of sample `x`.
    pub(crate) fn at(&self, entry: usize, x: usize) -> f32 {
        let (here, next, share) = self.place(x);
        let entry = &self.averages.entries[entry];
        between(self.cell(entry, here), self.cell(entry, next), share)
    }

    fn cell(&self, entry: &[f32], cell: usize) -> f32 {
        self.corners[..self.count].iter().map(|&(start, weight)| weight * entry[start + cell]).sum()
    }
}

/// The value at a share of the way from one to another.
#[inline]
pub(crate) fn between(here: f32, next: f32, share: f32) -> f32 {
    here + (next - here) * share
}

/// The cell, of `m`, whose middle is before sample `i` of `n`, and the sample's share of the way to the next middle.
/// Samples beyond the outer middles are taken to be there.
fn place(i: usize, n: usize, m: usize) -> (usize, f32) {
    // in half cells, lest the cell's middle is rounded
    let place = ((2 * i + 1) * m) as f32 / (2 * n) as f32 - 0.5;
    let place = place.clamp(0.0, (m - 1) as f32);
    let cell = (place as usize).min(m.saturating_sub(2));
    (cell, place - cell as f32)
}

/// Where a sample goes: to a cell, and a part of it to the next.
#[derive(Clone, Copy)]
struct Share {
    cell: usize,
    here: f32,
    next: f32,
}

/// The shares of the `n` samples of an axis in its `m` cells, as parts of a cell.
fn shares(n: usize, m: usize) -> Vec<Share> {
    let share = |i: usize| {
        // in units of 1/m samples, sample i reaches from i·m to (i + 1)·m and cells are n wide
        let cell = i * m / n;
        let here = ((cell + 1) * n - i * m).min(m);
        Share { cell, here: here as f32 / n as f32, next: (m - here) as f32 / n as f32 }
    };
    (0..n).map(share).collect()
}

/// The sums of one task: some layers of cells.
struct Sums<'a, 'b, const D: usize> {
    shares: &'a [Vec<Share>; D],
    cells: [usize; D],
    layers: Range<usize>,
    /// The layers of each entry.
    parts: &'a mut [&'b mut [f32]],
    /// Sums of planes that have begun and not ended, entry by entry: each plane its own, so that the order in
    /// which a cell is added up does not depend on where tasks begin.
    open: Vec<(usize, Vec<f32>)>,
    /// Vectors for planes to come.
    spare: Vec<Vec<f32>>,
    /// Numbers of a run of samples.
    numbers: Vec<f32>,
    /// A row of cells, and one more.
    row: Vec<f32>,
}

impl<'a, 'b, const D: usize> Sums<'a, 'b, D> {
    fn new(
        shares: &'a [Vec<Share>; D],
        cells: [usize; D],
        layers: Range<usize>,
        parts: &'a mut [&'b mut [f32]],
    ) -> Self {
        let row = vec![0.0; cells[0] + 1];
        let (open, spare, numbers) = (Vec::new(), Vec::new(), Vec::new());
        Self { shares, cells, layers, parts, open, spare, numbers, row }
    }

    /// Adds a run of samples; `plane` is how many a plane has.
    fn add(&mut self, run: &Run<D>, plane: usize, entries: &impl Entries<D>) {
        let layer: usize = self.cells[..D - 1].iter().product();
        let mut sums = match self.open.iter().position(|(open, _)| *open == run.plane) {
            Some(place) => self.open.swap_remove(place).1,
            None => {
                let mut sums = self.spare.pop().unwrap_or_default();
                sums.clear();
                sums.resize(layer * entries.count(), 0.0);
                sums
            }
        };
        let end = run.column + run.average.len();
        for (entry, sums) in sums.chunks_exact_mut(layer).enumerate() {
            let mut numbers = std::mem::take(&mut self.numbers);
            numbers.resize(run.average.len(), 0.0);
            entries.write(entry, run.average, run.slopes, &mut numbers);
            self.add_numbers(run.column, &numbers, sums);
            self.numbers = numbers;
        }
        if end == plane {
            self.close(run.plane, &sums);
            self.spare.push(sums);
        } else {
            self.open.push((run.plane, sums));
        }
    }

    /// Adds one entry's numbers, from place `start` in their plane on.
    fn add_numbers(&mut self, start: usize, numbers: &[f32], sums: &mut [f32]) {
        let (n, m) = (self.shares[0].len(), self.cells[0]);
        let end = start + numbers.len();
        for row in start / n..end.div_ceil(n) {
            let part = start.max(row * n)..end.min((row + 1) * n);
            let along = &self.shares[0][part.start - row * n..part.end - row * n];
            let cells = along[0].cell..along[along.len() - 1].cell + 2;
            self.row[cells.clone()].fill(0.0);
            for (share, number) in along.iter().zip(&numbers[part.start - start..part.end - start])
            {
                self.row[share.cell] += share.here * number;
                self.row[share.cell + 1] += share.next * number;
            }
            let whole = Share { cell: 0, here: 1.0, next: 0.0 };
            let across = if D > 2 { self.shares[1][row] } else { whole };
            let cells = cells.start..cells.end.min(m);
            for (cell, weight) in [(across.cell, across.here), (across.cell + 1, across.next)] {
                if weight > 0.0 {
                    let sums = &mut sums[cell * m..][cells.clone()];
                    sums.iter_mut()
                        .zip(&self.row[cells.clone()])
                        .for_each(|(s, v)| *s += weight * v);
                }
            }
        }
    }

    /// Adds a whole plane to its layers.
    fn close(&mut self, plane: usize, sums: &[f32]) {
        let layer: usize = self.cells[..D - 1].iter().product();
        let share = self.shares[D - 1][plane];
        for (cell, weight) in [(share.cell, share.here), (share.cell + 1, share.next)] {
            if weight == 0.0 || !self.layers.contains(&cell) {
                continue;
            }
            let first = (cell - self.layers.start) * layer;
            for (part, sums) in self.parts.iter_mut().zip(sums.chunks_exact(layer)) {
                let places = part[first..first + layer].iter_mut();
                places.zip(sums).for_each(|(sum, v)| *sum += weight * v);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_are_whole_samples_and_cells_are_full() {
        for (n, m) in [(1, 1), (7, 7), (12, 4), (10, 3), (257, 65), (5, 4)] {
            let mut sums = vec![0.0; m + 1];
            for share in shares(n, m) {
                let whole = (share.here + share.next) * n as f32 / m as f32;
                assert!((whole - 1.0).abs() < 1e-6);
                sums[share.cell] += share.here;
                sums[share.cell + 1] += share.next;
            }
            // a cell's parts sum to 1
            assert!(sums[..m].iter().all(|s| (s - 1.0f32).abs() < 1e-5), "{sums:?}");
            assert_eq!(sums[m], 0.0);
        }
    }

    #[test]
    fn samples_are_between_the_cells_around_them() {
        // cells of 4 samples have their middles at 1.5, 5.5, 9.5
        assert_eq!(place(0, 12, 3), (0, 0.0));
        assert_eq!(place(3, 12, 3), (0, 0.375));
        assert_eq!(place(11, 12, 3), (1, 1.0));
        assert_eq!(place(4, 12, 1), (0, 0.0));
        assert_eq!((place(0, 1, 1), place(6, 9, 9)), ((0, 0.0), (6, 0.0)));
    }
}
