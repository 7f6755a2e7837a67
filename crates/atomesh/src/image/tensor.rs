//! The structure tensor: which way an image is layered, about each sample.
//!
//! In this order:
//!
//! 1. gradients of the image, smoothed a little, plane by plane;
//! 2. their outer products, at once averaged over cells of some samples each;
//! 3. the averages smoothed by as much as is left of the wide Gaussian;
//! 4. on request, the tensor at a sample, linear between cells, and its eigenvectors.
//!
//! What a Gaussian of standard deviation σ has smoothed need not be held at every sample. Cells are at
//! most σ/3 wide and divide each axis evenly, so that they end where the image ends and mirrored
//! samples are mirrored cells; with σ = 12 the tensor of a volume takes a tenth of the memory of
//! the image, and its smoothing next to no time. The variances of cells and of interpolation between
//! them are taken off σ².
//!
//! Source: van Vliet & Verbeek (1995) for tensors of Gaussian derivatives; Hale (2002) uses them for the
//! normals of features. Cells are ours.

use super::stream::{Run, Stencil, Stream};
use super::{Grid, gaussian};
use crate::geometry::linear::{Matrix, largest_eigenpair};
use crate::watch::{Cancelled, Phase, Watch, check};
use rayon::prelude::*;
use std::ops::Range;

/// Cells per standard deviation of the smoothing.
const CELLS_PER_SIGMA: f64 = 3.0;

/// The variance, in squared widths, of a cell and of what is linear between cells: 1/12 + 1/6.
const CELL_VARIANCE: f64 = 0.25;

/// Samples between two looks at whether to go on: a fraction of a second's work.
const BATCH_SAMPLES: usize = 1 << 24;

/// Outer products of Gaussian gradients, smoothed: its leading eigenvector is the normal of layers and sheets.
///
/// In two or three dimensions. See the module for how it is held.
#[derive(Clone, Debug)]
pub struct StructureTensor<const D: usize> {
    shape: [usize; D],
    /// Cells along each axis.
    cells: [usize; D],
    /// The upper triangle of the tensors of all cells, entry by entry, row by row.
    entries: Vec<Vec<f32>>,
}

impl<const D: usize> StructureTensor<D> {
    /// The tensors of an image.
    ///
    /// Gradients are per lattice unit, of the image smoothed by `derivative_scale`, in least steps of the
    /// grid, as of [`gradient_magnitude`](super::gradient_magnitude). Their products are smoothed by a Gaussian of standard deviations
    /// `smooth`, in samples along each axis; 0 leaves an axis alone. Samples are mirrored about the
    /// image's edges. The values' size does not matter.
    ///
    /// Cost: O(derivative scale) per sample. Memory: D (D + 1)/2 numbers a cell, and planes.
    /// The same at any number of threads.
    ///
    /// # Errors
    /// [`Cancelled`] if the watch ends the work.
    ///
    /// # Panics
    /// If there are not as many values as the grid's shape says, or a scale is not finite, or
    /// `derivative_scale` is not above 0, or a `smooth` is below 0.
    pub fn new(
        values: &[f32],
        grid: &Grid<D>,
        derivative_scale: f64,
        smooth: [f64; D],
        watch: &mut dyn Watch,
    ) -> Result<Self, Cancelled> {
        assert_eq!(values.len(), grid.sample_count(), "samples for shape {:?}", grid.shape);
        assert!(derivative_scale.is_finite() && derivative_scale > 0.0, "σ is {derivative_scale}");
        let cells: [usize; D] = std::array::from_fn(|k| {
            let width = (smooth[k] / CELLS_PER_SIGMA).max(1.0);
            (grid.shape[k] as f64 / width).ceil() as usize
        });
        let count: usize = cells.iter().product();
        let mut tensor =
            Self { shape: grid.shape, cells, entries: vec![vec![0.0; count]; D * (D + 1) / 2] };
        if count == 0 {
            return Ok(tensor);
        }
        let scale = unit_scale(values);
        let fill = |start: usize, out: &mut [f32]| {
            for (out, v) in out.iter_mut().zip(&values[start..]) {
                *out = v * scale;
            }
        };
        let mut grid = *grid;
        let least = grid.least_step();
        grid.step = grid.step.map(|step| step / least); // only the steps' ratios matter
        let stream = Stream::new(fill, &grid, Stencil::Gaussian(derivative_scale));
        tensor.average(&stream, watch)?;
        let sigma = tensor.cell_sigma(smooth);
        tensor.entries.iter_mut().for_each(|entry| gaussian(entry, cells, sigma));
        Ok(tensor)
    }

    /// What is left of the smoothing, in cells.
    fn cell_sigma(&self, smooth: [f64; D]) -> [f64; D] {
        std::array::from_fn(|k| {
            let width = self.shape[k] as f64 / self.cells[k] as f64;
            let own = if width > 1.0 { CELL_VARIANCE } else { 0.0 };
            ((smooth[k] / width).powi(2) - own).max(0.0).sqrt()
        })
    }

    /// Adds the products of all gradients to the cells.
    fn average<F: Fn(usize, &mut [f32]) + Sync>(
        &mut self,
        stream: &Stream<F, D>,
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
            tasks.par_iter_mut().enumerate().for_each(|(t, entries)| {
                let first = (b * batch + t) * task;
                let layers = first..first + entries[0].len() / layer;
                let mut sums = Sums::new(&shares, self.cells, layers.clone(), entries);
                let planes = layers.start * planes / self.cells[D - 1]
                    ..(layers.end * planes).div_ceil(self.cells[D - 1]);
                stream.run(planes, &mut |run| sums.add(run, stream.plane()));
            });
        }
        Ok(())
    }

    /// The tensor at a sample, in squared lattice units, of which only the ratios mean something.
    fn at(&self, sample: [usize; D]) -> Matrix<D> {
        let mut base = 0;
        let mut corners = [(0, 0.0); D]; // the stride to the next cell and its share
        let mut stride = 1;
        for k in 0..D {
            let (n, m) = (self.shape[k], self.cells[k]);
            // in half cells, lest the cell's middle is rounded
            let place = ((2 * sample[k] + 1) * m) as f32 / (2 * n) as f32 - 0.5;
            let place = place.clamp(0.0, (m - 1) as f32);
            let cell = (place as usize).min(m.saturating_sub(2));
            base += cell * stride;
            corners[k] = (if m > 1 { stride } else { 0 }, place - cell as f32);
            stride *= m;
        }
        let mut weighted = [(base, 1.0f32); 8];
        let mut count = 1;
        for (stride, share) in corners {
            for i in 0..count {
                let (index, weight) = weighted[i];
                weighted[count + i] = (index + stride, weight * share);
                weighted[i].1 = weight * (1.0 - share);
            }
            count *= 2;
        }
        let mut matrix = [[0.0; D]; D];
        let mut entries = self.entries.iter();
        for a in 0..D {
            for b in a..D {
                let Some(entry) = entries.next() else { return matrix };
                let sum: f32 = weighted[..count].iter().map(|&(i, w)| w * entry[i]).sum();
                matrix[a][b] = sum.into();
                matrix[b][a] = sum.into();
            }
        }
        matrix
    }

    /// Unit normal (lattice units), sign so that its last non-zero component is positive, and how planar, 0…1.
    ///
    /// The latter is (λ₁ − λ₂)/λ₁ of the tensor's largest eigenvalues: 1 where all gradients about the sample have
    /// one direction, 0 where two directions are as good as each other. Where there is no
    /// gradient at all, the normal is along the last axis, and not planar.
    ///
    /// # Panics
    /// If there is no such sample.
    pub fn normal(&self, index: usize) -> ([f32; D], f32) {
        let mut rest = index;
        self.normal_at(std::array::from_fn(|k| {
            let i = rest % self.shape[k];
            rest /= self.shape[k];
            i
        }))
    }

    /// The same for a sample given axis by axis.
    pub(crate) fn normal_at(&self, sample: [usize; D]) -> ([f32; D], f32) {
        let tensor = self.at(sample);
        let (mut trace, mut squares) = (0.0, 0.0);
        for a in 0..D {
            trace += tensor[a][a];
            for b in 0..D {
                squares += tensor[a][b] * tensor[a][b];
            }
        }
        if trace <= 0.0 {
            return (std::array::from_fn(|k| if k == D - 1 { 1.0 } else { 0.0 }), 0.0);
        }
        let (largest, normal) = largest_eigenpair(tensor);
        // the others are known by their sum and the sum of their squares
        let (sum, squares) = (trace - largest, (squares - largest * largest).max(0.0));
        let second = match D {
            2 => sum,
            _ => 0.5 * (sum + (2.0 * squares - sum * sum).max(0.0).sqrt()),
        };
        let planar = (1.0 - second / largest).clamp(0.0, 1.0);
        let last = normal.iter().rev().find(|&&n| n as f32 != 0.0);
        let sign = if last.is_some_and(|&n| n < 0.0) { -1.0 } else { 1.0 };
        (normal.map(|n| (sign * n) as f32 + 0.0), planar as f32) // no −0
    }
}

/// A power of two that brings the values' greatest magnitude near 1, so that squares neither overflow
/// nor vanish.
fn unit_scale(values: &[f32]) -> f32 {
    let greatest = values
        .par_chunks(1 << 16)
        .map(|part| part.iter().fold(0.0f32, |most, v| most.max(v.abs())))
        .reduce(|| 0.0, f32::max);
    if greatest < f32::MIN_POSITIVE {
        return 1.0;
    }
    f32::powi(2.0, -(greatest.log2().floor() as i32).clamp(-126, 126))
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
    entries: &'a mut [&'b mut [f32]],
    /// Sums of planes that have begun and not ended, entry by entry: each plane its own, so that the order in
    /// which a cell is added up does not depend on where tasks begin.
    open: Vec<(usize, Vec<f32>)>,
    /// Vectors for planes to come.
    spare: Vec<Vec<f32>>,
    /// A row of cells, and one more.
    row: Vec<f32>,
}

impl<'a, 'b, const D: usize> Sums<'a, 'b, D> {
    fn new(
        shares: &'a [Vec<Share>; D],
        cells: [usize; D],
        layers: Range<usize>,
        entries: &'a mut [&'b mut [f32]],
    ) -> Self {
        let row = vec![0.0; cells[0] + 1];
        Self { shares, cells, layers, entries, open: Vec::new(), spare: Vec::new(), row }
    }

    /// Adds the products of the slopes of a run, of a plane of so many samples.
    fn add(&mut self, run: &Run<D>, plane: usize) {
        let layer: usize = self.cells[..D - 1].iter().product();
        let mut sums = match self.open.iter().position(|(open, _)| *open == run.plane) {
            Some(place) => self.open.swap_remove(place).1,
            None => {
                let mut sums = self.spare.pop().unwrap_or_default();
                sums.clear();
                sums.resize(layer * self.entries.len(), 0.0);
                sums
            }
        };
        let (n, end) = (self.shares[0].len(), run.column + run.slopes[0].len());
        let mut start = run.column;
        while start < end {
            let stop = end.min((start / n + 1) * n);
            let part = start - run.column..stop - run.column;
            self.add_row(start, run.slopes.map(|s| &s[part.clone()]), &mut sums);
            start = stop;
        }
        if end == plane {
            self.close(run.plane, &sums);
            self.spare.push(sums);
        } else {
            self.open.push((run.plane, sums));
        }
    }

    /// Adds the products along a part of one row, from place `start` in its plane on.
    fn add_row(&mut self, start: usize, slopes: [&[f32]; D], sums: &mut [f32]) {
        let (n, m) = (self.shares[0].len(), self.cells[0]);
        let layer: usize = self.cells[..D - 1].iter().product();
        let across =
            if D > 2 { self.shares[1][start / n] } else { Share { cell: 0, here: 1.0, next: 0.0 } };
        let along = &self.shares[0][start % n..][..slopes[0].len()];
        let mut sums = sums.chunks_exact_mut(layer);
        for a in 0..D {
            for b in a..D {
                self.row.fill(0.0);
                for ((share, x), y) in along.iter().zip(slopes[a]).zip(slopes[b]) {
                    let product = x * y;
                    self.row[share.cell] += share.here * product;
                    self.row[share.cell + 1] += share.next * product;
                }
                let Some(sums) = sums.next() else { return };
                for (cell, weight) in [(across.cell, across.here), (across.cell + 1, across.next)] {
                    if weight > 0.0 {
                        let row = sums[cell * m..].iter_mut().zip(&self.row[..m]);
                        row.for_each(|(sum, v)| *sum += weight * v);
                    }
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
            for (entry, sums) in self.entries.iter_mut().zip(sums.chunks_exact(layer)) {
                let places = entry[first..first + layer].iter_mut();
                places.zip(sums).for_each(|(sum, v)| *sum += weight * v);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::gaussian_derivative;
    use crate::watch::Silent;
    use rand::{RngExt, SeedableRng};

    fn coordinates<const D: usize>(mut index: usize, shape: [usize; D]) -> [usize; D] {
        std::array::from_fn(|k| {
            let i = index % shape[k];
            index /= shape[k];
            i
        })
    }

    /// A plane wave along `direction`, in lattice units, one period every `length` of them.
    fn wave<const D: usize>(grid: &Grid<D>, direction: [f64; D], length: f64) -> Vec<f32> {
        let phase = |i| -> f64 {
            let at = coordinates(i, grid.shape);
            (0..D).map(|k| direction[k] * at[k] as f64 * grid.step[k]).sum()
        };
        let turn = std::f64::consts::TAU / length;
        (0..grid.sample_count()).map(|i| (turn * phase(i)).sin() as f32).collect()
    }

    fn noise(count: usize) -> Vec<f32> {
        let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(5);
        (0..count).map(|_| random.random::<f32>()).collect()
    }

    fn unit<const D: usize>(v: [f64; D]) -> [f64; D] {
        let norm = v.iter().map(|x| x * x).sum::<f64>().sqrt();
        v.map(|x| x / norm)
    }

    fn angle<const D: usize>(a: [f64; D], b: [f32; D]) -> f64 {
        let cosine: f64 = (0..D).map(|k| a[k] * f64::from(b[k])).sum();
        cosine.abs().min(1.0).acos().to_degrees()
    }

    fn follows_waves<const D: usize>(grid: Grid<D>, scale: f64, smooth: [f64; D], length: f64) {
        let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(9);
        for _ in 0..12 {
            let direction = unit(std::array::from_fn(|_| random.random::<f64>() - 0.5));
            let values = wave(&grid, direction, length);
            let tensor = StructureTensor::new(&values, &grid, scale, smooth, &mut Silent).unwrap();
            let middle = grid.shape.map(|n| n / 2);
            let (normal, planar) = tensor.normal_at(middle);
            // kernels are cut at 4σ, smoothing leaves a little of the products' own waves
            let off = angle(direction, normal);
            assert!(off < 0.3, "{off}° from {direction:?}: {normal:?}");
            assert!(planar > 0.98, "{planar}");
            let last = normal.iter().rev().find(|&&n| n != 0.0);
            assert!(last.is_some_and(|&n| n > 0.0), "{normal:?}");
        }
    }

    #[test]
    fn normals_are_those_of_plane_waves() {
        follows_waves(Grid { shape: [90, 101], step: [1.0; 2] }, 1.5, [9.0; 2], 12.0);
        follows_waves(Grid { shape: [90, 80], step: [1.0, 2.0] }, 2.0, [12.0, 6.0], 20.0);
        follows_waves(Grid { shape: [51, 47, 55], step: [1.0; 3] }, 1.0, [6.0; 3], 9.0);
        follows_waves(
            Grid { shape: [60, 60, 30], step: [1.0, 1.0, 2.0] },
            1.5,
            [8.0, 8.0, 4.0],
            12.0,
        );
    }

    /// The tensors by the definition, at every sample.
    fn direct<const D: usize>(
        values: &[f32],
        shape: [usize; D],
        scale: f64,
        smooth: [f64; D],
    ) -> Vec<Vec<f32>> {
        let slope = |k| {
            let order = std::array::from_fn(|axis| u8::from(axis == k));
            gaussian_derivative(values, shape, [scale; D], order)
        };
        let slopes: [Vec<f32>; D] = std::array::from_fn(slope);
        let mut entries = Vec::new();
        for a in 0..D {
            for b in a..D {
                let mut entry: Vec<f32> =
                    slopes[a].iter().zip(&slopes[b]).map(|(x, y)| x * y).collect();
                gaussian(&mut entry, shape, smooth);
                entries.push(entry);
            }
        }
        entries
    }

    fn equals_direct<const D: usize>(shape: [usize; D], smooth: [f64; D], tolerance: f64) {
        let values = noise(shape.iter().product());
        let grid = Grid { shape, step: [1.0; D] };
        let tensor = StructureTensor::new(&values, &grid, 1.5, smooth, &mut Silent).unwrap();
        let entries = direct(&values, shape, 1.5, smooth);
        // the values, below 1, were brought near 1 first
        let scale = f64::from(unit_scale(&values)).powi(2);
        let trace: f64 = (0..D)
            .map(|k| (0..D - k).map(|j| D - j).sum::<usize>())
            .map(|end| {
                let entry = &entries[entries.len() - end];
                entry.iter().map(|&v| f64::from(v)).sum::<f64>() / values.len() as f64
            })
            .sum();
        for i in 0..values.len() {
            let found = tensor.at(coordinates(i, shape));
            let mut expected = entries.iter();
            for a in 0..D {
                for b in a..D {
                    let slow = f64::from(expected.next().unwrap()[i]);
                    let error = (found[a][b] / scale - slow).abs();
                    assert!(error < tolerance * trace, "{error} of {trace} at {i} of {shape:?}");
                }
            }
        }
    }

    #[test]
    fn cells_of_one_sample_are_the_definition() {
        for smooth in [[0.0, 0.0], [2.0, 1.0]] {
            equals_direct([37, 22], smooth, 1e-5);
        }
        equals_direct([17, 12, 21], [1.0, 0.0, 2.5], 1e-5);
        equals_direct([1, 9, 3], [1.0; 3], 1e-5);
    }

    #[test]
    fn wide_cells_are_the_definition_to_a_few_percent_of_the_trace() {
        // of a bend, what is linear between cells loses a share of 1/8 (width/σ)², or 1.4 %, along each axis; twice that at the edges
        equals_direct([121, 90], [12.0, 12.0], 0.04);
        equals_direct([121, 90], [12.0, 0.0], 0.06);
        equals_direct([50, 43, 61], [9.0, 7.0, 12.0], 0.02);
    }

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
            assert!(sums[..m].iter().all(|s| (s - 1.0).abs() < 1e-5) && sums[m] == 0.0, "{sums:?}");
        }
    }

    #[test]
    fn a_turned_image_has_turned_normals() {
        let (shape, smooth) = ([23, 31, 18], [7.0, 3.0, 5.0]);
        let values = noise(shape.iter().product());
        let of = |values: &[f32], shape, smooth| {
            let grid = Grid { shape, step: [1.0; 3] };
            StructureTensor::new(values, &grid, 1.0, smooth, &mut Silent).unwrap()
        };
        let tensor = of(&values, shape, smooth);
        let backwards: Vec<f32> = values.iter().rev().copied().collect();
        let turned = of(&backwards, shape, smooth);
        let count = values.len();
        // axes in the order z, x, y
        let swapped_shape = [shape[2], shape[0], shape[1]];
        let place = |at: [usize; 3]| at[2] + shape[2] * (at[0] + shape[0] * at[1]);
        let mut swapped = vec![0.0; count];
        (0..count).for_each(|i| swapped[place(coordinates(i, shape))] = values[i]);
        let swapped = of(&swapped, swapped_shape, [smooth[2], smooth[0], smooth[1]]);
        for i in 0..count {
            let here = tensor.at(coordinates(i, shape));
            let there = turned.at(coordinates(count - 1 - i, shape));
            let at = coordinates(i, shape);
            let exchanged = swapped.at([at[2], at[0], at[1]]);
            let trace = here[0][0] + here[1][1] + here[2][2];
            for a in 0..3 {
                for b in 0..3 {
                    // rounding alone
                    assert!((here[a][b] - there[a][b]).abs() < 1e-5 * trace);
                    let (c, d) = ((a + 1) % 3, (b + 1) % 3);
                    assert!((here[a][b] - exchanged[c][d]).abs() < 1e-5 * trace);
                }
            }
        }
    }

    #[test]
    fn constant_images_and_thin_ones_have_a_normal() {
        for value in [0.0, 3.5, -1e30] {
            let grid = Grid { shape: [9, 8, 1], step: [1.0; 3] };
            let tensor =
                StructureTensor::new(&[value; 72], &grid, 3.0, [12.0; 3], &mut Silent).unwrap();
            let (normal, planar) = tensor.normal(40);
            let norm: f32 = normal.iter().map(|n| n * n).sum();
            assert!((norm - 1.0).abs() < 1e-5 && (0.0..=1.0).contains(&planar));
        }
        let grid = Grid { shape: [4, 4], step: [1.0; 2] };
        let flat = StructureTensor::new(&[0.0; 16], &grid, 1.0, [0.0; 2], &mut Silent).unwrap();
        assert_eq!(flat.normal(5), ([0.0, 1.0], 0.0));
    }

    #[test]
    fn the_size_of_values_does_not_matter() {
        let grid = Grid { shape: [30, 30], step: [1.0; 2] };
        let plain = wave(&grid, unit([1.0, 2.0]), 8.0);
        let of = |factor: f32| {
            let values: Vec<f32> = plain.iter().map(|v| v * factor).collect();
            StructureTensor::new(&values, &grid, 1.0, [4.0; 2], &mut Silent).unwrap().normal(465)
        };
        for factor in [f32::powi(2.0, 120), f32::powi(2.0, -100)] {
            assert_eq!(of(factor), of(1.0));
        }
    }

    #[test]
    fn bits_do_not_depend_on_the_number_of_threads() {
        let grid = Grid { shape: [33, 29, 61], step: [1.0; 3] };
        let values = noise(grid.sample_count());
        for smooth in [[0.0; 3], [5.0; 3]] {
            let run = |threads| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                let make = || StructureTensor::new(&values, &grid, 1.0, smooth, &mut Silent);
                pool.install(make).unwrap().entries
            };
            assert!(run(1) == run(3) && run(1) == run(7));
        }
    }
}
