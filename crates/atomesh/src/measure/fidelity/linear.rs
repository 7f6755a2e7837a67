//! The continuous, piecewise linear fit of least squares.
//!
//! Each cell has normal equations: A = Σ w λ λᵀ, b = Σ w v λ over the samples in it, λ their barycentric coordinates. As
//! these are linear in place, A and b are made of the moments Σ w, Σ w x, Σ w x xᵀ and Σ w v, Σ w v x, and those of rows of
//! samples, each from where it enters the cell to where it leaves it. A sample on a facet belongs to the first of the
//! facet's cells: such samples are set aside, and added once all cells are known.
//!
//! The sum of the cells' equations is solved by conjugate gradients, scaled by the diagonal.

use crate::parallel::prelude::*;

use super::PlacedMesh;
use crate::geometry::linear::invert;
use crate::geometry::{Point, difference, dot};
use crate::image::Samples;
use crate::measure::MeasureError;
use crate::measure::statistics::{sum, sums};
use crate::mesh::{CellsOfPoints, Mesh};
use crate::watch::{Phase, Watch, check};

/// The most iterations of the conjugate gradients; some 30 suffice, as the matrix is a mass matrix.
const MOST_ITERATIONS: usize = 200;

/// The residual at which the iterations end, over the first: errors are right to its square.
const ENOUGH: f64 = 1e-6;

/// The greatest distance outside a cell at which a sample counts as inside, in barycentric coordinates.
const SLACK: f64 = 1e-9;

/// Cells that a thread takes at once.
const CELLS_PER_TASK: usize = 1 << 10;

/// Points whose equations a thread takes at once.
const POINTS_PER_TASK: usize = 1 << 10;

/// The most coordinates of a place, and 1 before them.
const TERMS: usize = 5;

/// The normal equations of the linear fit, cell by cell.
pub(super) struct System<'a, const D: usize> {
    mesh: &'a Mesh<D>,
    cells_of_points: CellsOfPoints,
    /// (D + 1)² entries of A, row by row, for each cell.
    matrices: Vec<f64>,
    /// D + 1 entries of b for each cell.
    rights: Vec<f64>,
    /// Σ w and Σ w v².
    weight: f64,
    squares: f64,
}

/// What the fit came to.
pub(super) struct Fit {
    /// Σ w (v − u)² / Σ w.
    pub mean_square: f64,
    pub iterations: usize,
    pub converged: bool,
}

/// The equations of some cells.
struct Block<'a> {
    matrices: &'a mut [f64],
    rights: &'a mut [f64],
}

impl<'a, const D: usize> System<'a, D> {
    /// Gathers the samples in each cell. The mean of all is taken off their values, so that squares keep their digits.
    pub fn new(placed: &PlacedMesh<'a, D>) -> Self {
        let (mesh, mean) = (placed.mesh, finite_mean(placed.samples));
        let (width, count) = (D + 1, mesh.cell_count());
        let mut matrices = vec![0.0; count * width * width];
        let mut rights = vec![0.0; count * width];
        let blocks = matrices
            .par_chunks_mut(CELLS_PER_TASK * width * width)
            .zip(rights.par_chunks_mut(CELLS_PER_TASK * width))
            .enumerate();
        let values = Values { placed, mean };
        let gathered: Vec<([f64; 2], Vec<Shared>)> = blocks
            .map(|(number, (matrices, rights))| {
                let mut block = Block { matrices, rights };
                values.gather(number * CELLS_PER_TASK, &mut block)
            })
            .collect();
        let [mut weight, mut squares] = sums(0..gathered.len(), &|i| gathered[i].0);
        let mut shared: Vec<Shared> = gathered.into_iter().flat_map(|(_, shared)| shared).collect();
        shared.par_sort_unstable();
        shared.dedup_by_key(|shared| shared.sample);
        let mut block = Block { matrices: &mut matrices, rights: &mut rights };
        for Shared { sample, cell } in shared {
            let [own_weight, square] = values.add_shared(sample, cell, &mut block);
            weight += own_weight;
            squares += square;
        }
        let cells_of_points = mesh.cells_of_points();
        Self { mesh, cells_of_points, matrices, rights, weight, squares }
    }

    /// Σ w: how much of the image, in boxes of samples, has cells.
    pub fn weight(&self) -> f64 {
        self.weight
    }

    /// The equations of a cell, summed over its corners: Σ w and Σ w v, as barycentric coordinates sum up to 1.
    fn sums_of(&self, cell: usize) -> [f64; 2] {
        let width = D + 1;
        let matrix = &self.matrices[cell * width * width..(cell + 1) * width * width];
        let right = &self.rights[cell * width..(cell + 1) * width];
        [matrix.iter().sum(), right.iter().sum()]
    }

    /// The root mean square of what the means of cells leave.
    pub fn constant_rms(&self) -> f64 {
        let cells = self.mesh.cell_count();
        let explained = sum(0..cells, &|cell| {
            let [weight, value] = self.sums_of(cell);
            if weight > 0.0 { value * value / weight } else { 0.0 }
        });
        ((self.squares - explained) / self.weight).max(0.0).sqrt()
    }

    /// The standard deviation of all samples.
    pub fn deviation(&self) -> f64 {
        let value = sum(0..self.mesh.cell_count(), &|cell| self.sums_of(cell)[1]);
        (self.squares / self.weight - (value / self.weight).powi(2)).max(0.0).sqrt()
    }

    /// The entries of a point: the cell, and which of its corners the point is.
    fn entries(&self, point: u32) -> impl Iterator<Item = (usize, usize)> + '_ {
        self.cells_of_points.of(point).iter().filter_map(move |&cell| {
            let own = self.corners(cell as usize);
            Some((cell as usize, own.iter().position(|&corner| corner == point)?))
        })
    }

    fn corners(&self, cell: usize) -> &[u32] {
        &self.mesh.corners()[cell * (D + 1)..(cell + 1) * (D + 1)]
    }

    /// A u.
    fn product(&self, u: &[f64]) -> Vec<f64> {
        let width = D + 1;
        let of = |point: usize| {
            let mut sum = 0.0;
            for (cell, k) in self.entries(point as u32) {
                let at = (cell * width + k) * width;
                let row = &self.matrices[at..at + width];
                let own = row.iter().zip(self.corners(cell));
                sum += own.map(|(a, &corner)| a * u[corner as usize]).sum::<f64>();
            }
            sum
        };
        (0..u.len()).into_par_iter().with_min_len(POINTS_PER_TASK).map(of).collect()
    }

    /// The right side, and the diagonal of A, 1 where a point has no samples about it.
    fn right_and_diagonal(&self) -> (Vec<f64>, Vec<f64>) {
        let width = D + 1;
        let of = |point: usize| {
            let (mut right, mut diagonal) = (0.0, 0.0);
            for (cell, k) in self.entries(point as u32) {
                right += self.rights[cell * width + k];
                diagonal += self.matrices[(cell * width + k) * width + k];
            }
            (right, if diagonal == 0.0 { 1.0 } else { diagonal })
        };
        let points = (0..self.mesh.points().len()).into_par_iter().with_min_len(POINTS_PER_TASK);
        points.map(of).unzip()
    }

    /// The least squares by conjugate gradients.
    pub fn solve(&self, watch: &mut dyn Watch) -> Result<Fit, MeasureError> {
        let (right, diagonal) = self.right_and_diagonal();
        let inner = |a: &[f64], b: &[f64]| sum(0..a.len(), &|i| a[i] * b[i]);
        let mut u = vec![0.0; right.len()];
        let mut residual = right.clone();
        let scaled =
            |r: &[f64]| -> Vec<f64> { r.iter().zip(&diagonal).map(|(r, d)| r / d).collect() };
        let mut direction = scaled(&residual);
        let mut size = inner(&residual, &direction);
        let (first, mut iterations) = (size, 0);
        while size > ENOUGH * ENOUGH * first && iterations < MOST_ITERATIONS {
            let done = iterations as f64 / MOST_ITERATIONS as f64;
            check(watch, Phase::Measure, 0.5 + 0.5 * done, None)?;
            let image = self.product(&direction);
            let curvature = inner(&direction, &image);
            if curvature.is_nan() || curvature <= 0.0 {
                break;
            }
            let step = size / curvature;
            for i in 0..u.len() {
                u[i] += step * direction[i];
                residual[i] -= step * image[i];
            }
            let z = scaled(&residual);
            let next = inner(&residual, &z);
            let share = next / size;
            direction.iter_mut().zip(&z).for_each(|(d, z)| *d = z + share * *d);
            size = next;
            iterations += 1;
        }
        // v·v − 2 b·u + u·A u, with A u = b − residual
        let fitted = sum(0..u.len(), &|i| u[i] * (right[i] + residual[i]));
        Ok(Fit {
            mean_square: (self.squares - fitted) / self.weight,
            iterations,
            converged: size <= ENOUGH * ENOUGH * first,
        })
    }
}

/// The mean of the finite samples; 0 if there are none.
fn finite_mean(samples: &Samples) -> f64 {
    let [total, count] = sums(0..samples.len(), &|i| {
        let value = samples.get(i);
        if value.is_finite() { [value, 1.0] } else { [0.0; 2] }
    });
    if count > 0.0 { total / count } else { 0.0 }
}

/// A sample on a facet of a cell.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Shared {
    sample: usize,
    cell: u32,
}

/// The samples less their mean.
struct Values<'a, const D: usize> {
    placed: &'a PlacedMesh<'a, D>,
    mean: f64,
}

impl<const D: usize> Values<'_, D> {
    fn corners(&self, cell: usize) -> &[u32] {
        &self.placed.mesh.corners()[cell * (D + 1)..(cell + 1) * (D + 1)]
    }

    /// Fills the equations of the cells from `first` on, but for samples on facets, which are given with Σ w and Σ w v².
    fn gather(&self, first: usize, block: &mut Block<'_>) -> ([f64; 2], Vec<Shared>) {
        let width = D + 1;
        let (mut sums, mut shared) = ([0.0; 2], Vec::new());
        let matrices = block.matrices.chunks_exact_mut(width * width);
        let cells = matrices.zip(block.rights.chunks_exact_mut(width)).enumerate();
        for (at, (matrix, right)) in cells {
            let cell = first + at;
            let Some(inside) = CellSamples::new(self.placed, self.corners(cell)) else { continue };
            let mut moments = Moments::default();
            inside.each_row(|row, is_shared| match is_shared {
                false => moments.add_row(self, &row),
                true => {
                    shared.extend(row.samples().map(|sample| Shared { sample, cell: cell as u32 }))
                }
            });
            moments.to_equations(&inside, matrix, right);
            sums = [sums[0] + moments.matrix[0][0], sums[1] + moments.squares];
        }
        (sums, shared)
    }

    /// Adds a sample on a facet to the equations of a cell; gives w and w v².
    fn add_shared(&self, sample: usize, cell: u32, block: &mut Block<'_>) -> [f64; 2] {
        let value = self.placed.samples.get(sample) - self.mean;
        let cell = cell as usize;
        let Some(inside) = CellSamples::new(self.placed, self.corners(cell)) else {
            return [0.0; 2];
        };
        if !value.is_finite() {
            return [0.0; 2];
        }
        let place = crate::image::coordinates(sample, self.placed.shape);
        let weight: f64 = (0..D).map(|k| rim(place[k], self.placed.shape[k])).product();
        let shares = inside.shares(&place.map(|i| i as f64));
        let width = D + 1;
        for r in 0..width {
            for c in 0..width {
                block.matrices[(cell * width + r) * width + c] += weight * shares[r] * shares[c];
            }
            block.rights[cell * width + r] += weight * shares[r] * value;
        }
        [weight, weight * value * value]
    }
}

/// Sums over the samples of a cell; places count from the cell's first sample, with 1 before their coordinates.
#[derive(Default)]
struct Moments {
    /// Σ w x xᵀ, the lower half.
    matrix: [[f64; TERMS]; TERMS],
    /// Σ w v x.
    right: [f64; TERMS],
    /// Σ w v².
    squares: f64,
}

impl Moments {
    fn add_row<const D: usize>(&mut self, values: &Values<'_, D>, row: &Row<D>) {
        let shape = values.placed.shape[0];
        // Σ w, Σ w x, Σ w x², Σ w v, Σ w v x, Σ w v² along the row
        let mut sums = [0.0; 6];
        for i in row.from..row.to {
            let value = values.placed.samples.get(row.start + i) - values.mean;
            if value.is_finite() {
                let weight = row.weight * rim(row.low + i, shape);
                let x = i as f64;
                let terms = [1.0, x, x * x, value, value * x, value * value];
                (0..6).for_each(|k| sums[k] += weight * terms[k]);
            }
        }
        let [weight, x, xx, value, value_x, squares] = sums;
        self.squares += squares;
        // 1 and the coordinates along the other axes stay the same
        let fixed = |k: usize| if k == 0 { 1.0 } else { row.place[k - 1] };
        for r in (0..=D).filter(|&r| r != 1) {
            for c in (0..=r).filter(|&c| c != 1) {
                self.matrix[r][c] += weight * fixed(r) * fixed(c);
            }
            let (high, low) = (r.max(1), r.min(1));
            self.matrix[high][low] += x * fixed(r);
            self.right[r] += value * fixed(r);
        }
        self.matrix[1][1] += xx;
        self.right[1] += value_x;
    }

    /// The cell's equations.
    fn to_equations<const D: usize>(
        &self,
        cell: &CellSamples<D>,
        matrix: &mut [f64],
        right: &mut [f64],
    ) {
        let width = D + 1;
        let entry = |r: usize, c: usize| self.matrix[r.max(c)][r.min(c)];
        let shares: [[f64; TERMS]; TERMS] = std::array::from_fn(|k| match k <= D {
            true => cell.terms(k),
            false => [0.0; TERMS],
        });
        for r in 0..width {
            let turned: [f64; TERMS] = std::array::from_fn(|c| match c < width {
                true => (0..width).map(|k| shares[r][k] * entry(k, c)).sum(),
                false => 0.0,
            });
            for c in 0..=r {
                let sum: f64 = (0..width).map(|k| turned[k] * shares[c][k]).sum();
                matrix[r * width + c] = sum;
                matrix[c * width + r] = sum;
            }
            right[r] = (0..width).map(|k| shares[r][k] * self.right[k]).sum();
        }
    }
}

/// Samples of a row of an image.
#[derive(Clone, Copy)]
struct Row<const D: usize> {
    /// The index of the sample that numbers count from.
    start: usize,
    /// Its place along axis 0.
    low: usize,
    /// The first sample and the one after the last.
    from: usize,
    to: usize,
    /// The row's place from the cell's first sample along all axes, that along axis 0 being 0.
    place: Point<D>,
    /// The part of a box of the row that is in the image, but for axis 0.
    weight: f64,
}

impl<const D: usize> Row<D> {
    fn samples(self) -> std::ops::Range<usize> {
        self.start + self.from..self.start + self.to
    }
}

/// The samples in a cell.
struct CellSamples<const D: usize> {
    /// The image's shape.
    shape: [usize; D],
    /// The first sample of the cell's box, and how many there are along each axis.
    low: [usize; D],
    counts: [usize; D],
    /// The barycentric coordinates at that sample, their gradients, and the inverse of these along axis 0. D + 1 of each,
    /// D at most 4.
    starts: [f64; TERMS],
    gradients: [Point<D>; TERMS],
    inverses: [f64; TERMS],
}

impl<const D: usize> CellSamples<D> {
    /// The samples of a cell, given by its corners; `None` if the cell is flat or its box holds no sample.
    fn new(placed: &PlacedMesh<'_, D>, corners: &[u32]) -> Option<Self> {
        let (points, shape) = (placed.mesh.points(), placed.shape);
        let first = points[corners[0] as usize];
        let edges: [Point<D>; D] =
            std::array::from_fn(|k| difference(&points[corners[k + 1] as usize], &first));
        let (inverse, _) = invert(&edges)?;
        let (mut low, mut counts) = ([0; D], [0; D]);
        for k in 0..D {
            let ends = corners.iter().map(|&c| points[c as usize][k]);
            let (min, max) =
                ends.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
            let last = (shape[k] - 1) as f64;
            if max < -SLACK || min > last + SLACK {
                return None;
            }
            low[k] = (min - SLACK).ceil().max(0.0) as usize;
            let high = (max + SLACK).floor().min(last) as usize;
            counts[k] = (high + 1).saturating_sub(low[k]);
        }
        // column k of the inverse is the gradient of the barycentric coordinate of corner k + 1
        let mut gradients = [[0.0; D]; TERMS];
        for k in 0..D {
            for r in 0..D {
                gradients[k + 1][r] = inverse[r][k];
                gradients[0][r] -= inverse[r][k];
            }
        }
        let offset = std::array::from_fn(|k| low[k] as f64 - first[k]);
        let starts =
            std::array::from_fn(|k| f64::from(u8::from(k == 0)) + dot(&offset, &gradients[k]));
        let inverses = gradients.map(|gradient| 1.0 / gradient[0]);
        (counts[0] > 0).then_some(Self { shape, low, counts, starts, gradients, inverses })
    }

    /// The barycentric coordinate of corner `k` as a sum over 1 and the coordinates from the first sample.
    fn terms(&self, k: usize) -> [f64; TERMS] {
        std::array::from_fn(|c| match c {
            0 => self.starts[k],
            _ if c <= D => self.gradients[k][c - 1],
            _ => 0.0,
        })
    }

    /// The barycentric coordinates of a place.
    fn shares(&self, place: &Point<D>) -> [f64; TERMS] {
        let offset = std::array::from_fn(|k| place[k] - self.low[k] as f64);
        std::array::from_fn(|k| self.starts[k] + dot(&offset, &self.gradients[k]))
    }

    /// Calls `visit` with the part of each row that lies inside, and with the parts that lie on facets, for which it says
    /// true.
    fn each_row(&self, mut visit: impl FnMut(Row<D>, bool)) {
        for row in 0..self.counts[1..].iter().product() {
            let (mut rest, mut start, mut stride) = (row, self.low[0], self.shape[0]);
            let mut weight = 1.0;
            let mut place = [0.0; D];
            for k in 1..D {
                let at = self.low[k] + rest % self.counts[k];
                place[k] = (rest % self.counts[k]) as f64;
                rest /= self.counts[k];
                start += at * stride;
                stride *= self.shape[k];
                weight *= rim(at, self.shape[k]);
            }
            let starts = std::array::from_fn(|k| self.starts[k] + dot(&place, &self.gradients[k]));
            let Some([from, to]) = self.within(&starts, SLACK) else { continue };
            let part = |from, to| Row { start, low: self.low[0], from, to, place, weight };
            match self.within(&starts, -SLACK) {
                None => visit(part(from, to), true),
                Some([first, end]) => {
                    visit(part(first, end), false);
                    for (from, to) in [(from, first), (end, to)] {
                        if from < to {
                            visit(part(from, to), true);
                        }
                    }
                }
            }
        }
    }

    /// From where to where no barycentric coordinate of a row is below −`slack`, given those at its first sample.
    #[inline]
    fn within(&self, starts: &[f64; TERMS], slack: f64) -> Option<[usize; 2]> {
        let (mut from, mut to) = (0.0_f64, (self.counts[0] - 1) as f64);
        for k in 0..=D {
            let (start, slope) = (starts[k] + slack, self.gradients[k][0]);
            match slope {
                s if s > 0.0 => from = from.max(-start * self.inverses[k]),
                s if s < 0.0 => to = to.min(-start * self.inverses[k]),
                _ if start < 0.0 => return None,
                _ => {}
            }
        }
        if from > to {
            return None;
        }
        let (from, end) = (from.ceil() as usize, to as usize + 1);
        (from < end).then_some([from, end])
    }
}

/// Which part of a box one wide lies in an image, along an axis.
fn rim(at: usize, count: usize) -> f64 {
    if at == 0 || at + 1 == count { 0.5 } else { 1.0 }
}
