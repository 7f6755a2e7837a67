//! How well a mesh can carry its image: the error that is left when the image is rebuilt from the mesh.
//!
//! *Piecewise constant*: each cell has the mean of the samples that it overlaps, weighted by overlap
//! ([`crate::sample`]). *Piecewise linear*: continuous, with a value at each point such that the squared
//! differences at the samples are least (linear least squares; not the image's values at the points, which noise
//! would spoil). Each sample counts by its box, cut at the image's rim. Both errors are root mean squares over the
//! part of the image that the mesh covers.
//!
//! The least squares are solved by conjugate gradients, scaled by the diagonal, from the normal equations of each
//! cell: A = Σ w λ λᵀ, b = Σ w v λ over the samples in it, λ their barycentric coordinates.

use super::MeasureError;
use super::statistics::{Histogram, sum, sums};
use crate::geometry::linear::invert;
use crate::geometry::{Point, difference, dot};
use crate::image::{Frame, Image, Samples, Units};
use crate::mesh::Mesh;
use crate::sample::{SampleOptions, Statistic, sample, sample_in_frame};
use crate::watch::{Phase, Watch, check};
use rayon::prelude::*;
use std::sync::atomic::{AtomicU32, Ordering};

/// The most iterations of the conjugate gradients; some 30 suffice, as the matrix is a mass matrix.
const MOST_ITERATIONS: usize = 200;

/// The residual at which the iterations end, over the first: errors are right to its square.
const ENOUGH: f64 = 1e-6;

/// The greatest distance outside a cell at which a sample counts as inside, in barycentric coordinates.
const SLACK: f64 = 1e-9;

/// How well the image can be rebuilt from the mesh. Errors are in the unit of the image.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct FidelityReport {
    /// The share of the image's box that the mesh covers.
    pub covered: f64,
    /// The standard deviation of the samples there.
    pub deviation: f64,
    /// RMS error of the means of cells.
    pub constant_rms: f64,
    /// RMS error of the continuous, linear least-squares fit.
    pub linear_rms: f64,
    /// `constant_rms` over the deviation; `None` for a constant image.
    pub constant_relative: Option<f64>,
    /// `linear_rms` over the deviation; `None` for a constant image.
    pub linear_relative: Option<f64>,
    /// Iterations of the fit.
    pub iterations: usize,
    /// Whether the fit converged within its limit of iterations.
    pub converged: bool,
}

/// How much of one label cells are: OOF's homogeneity.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct HomogeneityReport {
    /// The share of a cell that its dominant label fills, averaged over the volume (2-D: area): 1 if no
    /// interface runs through a cell.
    pub mean: f64,
    /// The least share of any cell.
    pub min: f64,
    /// Cells with less than 0.9 of one label.
    pub mixed: usize,
    /// Cells by that share, in 20 bins of 0.05.
    pub histogram: Histogram,
    /// Cells without samples; nothing else counts them.
    pub without: usize,
}

/// Measures how well the mesh carries an image placed by `frame` in the mesh's coordinates.
///
/// # Errors
/// [`MeasureError`] if the mesh has no cells or covers no sample, the image cannot be sampled, or the watch ends
/// the work.
pub fn fidelity<const D: usize>(
    mesh: &Mesh<D>,
    frame: &Frame<D>,
    samples: &Samples,
    watch: &mut dyn Watch,
) -> Result<FidelityReport, MeasureError> {
    let none = MeasureError::NoCells { points: mesh.points().len() };
    let kinds = [Statistic::Mean, Statistic::Std];
    let found = sample_in_frame(mesh, frame, samples, SampleOptions::new(&kinds), watch)?;
    let [means, deviations] = [&found.values[0], &found.values[1]];
    let weight = |i: usize| found.measures[i] * found.coverage[i];
    let weighted = |i: usize, value: f64| if weight(i) > 0.0 { weight(i) * value } else { 0.0 };
    let all = 0..mesh.cell_count();
    let total = sum(all.clone(), &weight);
    if total.is_nan() || total <= 0.0 {
        return Err(none);
    }
    let mean = sum(all.clone(), &|i| weighted(i, means[i])) / total;
    let [within, between] = sums(all, &|i| {
        [weighted(i, deviations[i].powi(2)), weighted(i, (means[i] - mean).powi(2))]
    })
    .map(|s| s / total);
    check(watch, Phase::Measure, 0.5, None)?;

    let system = System::new(mesh, frame, samples, mean);
    check(watch, Phase::Measure, 0.7, None)?;
    let fit = system.solve(watch)?;
    let deviation = (within + between).sqrt();
    let (constant_rms, linear_rms) = (within.sqrt(), fit.mean_square.max(0.0).sqrt());
    let relative = |rms: f64| (deviation > 0.0).then(|| rms / deviation);
    let world =
        frame.spacing().iter().product::<f64>() * frame.grid(Units::Samples).bounds().measure();
    Ok(FidelityReport {
        covered: (total / world).min(1.0),
        deviation,
        constant_rms,
        linear_rms,
        constant_relative: relative(constant_rms),
        linear_relative: relative(linear_rms),
        iterations: fit.iterations,
        converged: fit.converged,
    })
}

/// Measures how much of one label each cell is; the mesh is in world coordinates.
///
/// # Errors
/// [`MeasureError`] if the mesh has no cells with labels, the image holds no labels, or the watch ends the work.
pub fn homogeneity<const D: usize>(
    mesh: &Mesh<D>,
    labels: &Image<D>,
    watch: &mut dyn Watch,
) -> Result<HomogeneityReport, MeasureError> {
    let options = SampleOptions::new(&[Statistic::Homogeneity]);
    let found = sample(mesh, labels, options, watch)?;
    let of_cells = &found.values[0];
    let known: Vec<f64> = of_cells.iter().copied().filter(|share| share.is_finite()).collect();
    if known.is_empty() {
        return Err(MeasureError::NoCells { points: mesh.points().len() });
    }
    let [shares, weights] = sums(0..of_cells.len(), &|i| {
        let weight = found.measures[i] * found.coverage[i];
        if of_cells[i].is_finite() { [weight * of_cells[i], weight] } else { [0.0; 2] }
    });
    Ok(HomogeneityReport {
        mean: shares / weights,
        min: super::statistics::least(&known),
        mixed: known.iter().filter(|&&share| share < 0.9).count(),
        histogram: Histogram::of(&known, 0.05, 20),
        without: of_cells.len() - known.len(),
    })
}

/// The normal equations of the linear fit, cell by cell.
struct System<'a, const D: usize> {
    mesh: &'a Mesh<D>,
    /// (D + 1)² entries of A, row by row, for each cell.
    matrices: Vec<f64>,
    /// D + 1 entries of b for each cell.
    rights: Vec<f64>,
    /// Σ w and Σ w v².
    weight: f64,
    squares: f64,
}

/// What the fit came to.
struct Fit {
    /// Σ w (v − u)² / Σ w.
    mean_square: f64,
    iterations: usize,
    converged: bool,
}

impl<'a, const D: usize> System<'a, D> {
    /// Gathers the samples in each cell; `mean` is taken off their values, so that squares keep their digits.
    fn new(mesh: &'a Mesh<D>, frame: &Frame<D>, samples: &Samples, mean: f64) -> Self {
        let points: Vec<Point<D>> =
            mesh.points().par_iter().map(|p| frame.world_to_lattice(Units::Samples, p)).collect();
        let shape = frame.shape();
        // a sample on a facet belongs to the first of its cells
        let owners: Vec<AtomicU32> =
            (0..frame.sample_count()).into_par_iter().map(|_| AtomicU32::new(u32::MAX)).collect();
        let corners = mesh.corners().par_chunks_exact(D + 1).enumerate();
        corners.clone().for_each(|(cell, corners)| {
            if let Some(inside) = CellSamples::new(&points, corners, shape) {
                inside.each(|index, _, _| {
                    owners[index].fetch_min(cell as u32, Ordering::Relaxed);
                });
            }
        });
        let width = D + 1;
        let mut matrices = vec![0.0; mesh.cell_count() * width * width];
        let mut rights = vec![0.0; mesh.cell_count() * width];
        let sums_of_cells: Vec<[f64; 2]> = corners
            .zip(matrices.par_chunks_exact_mut(width * width))
            .zip(rights.par_chunks_exact_mut(width))
            .map(|(((cell, corners), matrix), right)| {
                let mut sums = [0.0; 2];
                let Some(inside) = CellSamples::new(&points, corners, shape) else { return sums };
                inside.each(|index, shares, weight| {
                    let value = samples.get(index) - mean;
                    if owners[index].load(Ordering::Relaxed) != cell as u32 || !value.is_finite() {
                        return;
                    }
                    for (r, a) in shares.iter().enumerate() {
                        for (c, b) in shares.iter().enumerate() {
                            matrix[r * width + c] += weight * a * b;
                        }
                        right[r] += weight * a * value;
                    }
                    sums[0] += weight;
                    sums[1] += weight * value * value;
                });
                sums
            })
            .collect();
        let [weight, squares] = sums(0..sums_of_cells.len(), &|i| sums_of_cells[i]);
        Self { mesh, matrices, rights, weight, squares }
    }

    /// A u.
    fn product(&self, u: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; u.len()];
        let width = D + 1;
        for (cell, matrix) in self.mesh.cells().zip(self.matrices.chunks_exact(width * width)) {
            for (row, &r) in matrix.chunks_exact(width).zip(cell) {
                out[r as usize] +=
                    row.iter().zip(cell).map(|(a, &c)| a * u[c as usize]).sum::<f64>();
            }
        }
        out
    }

    /// The right side, and the diagonal of A, 1 where a point has no samples about it.
    fn right_and_diagonal(&self) -> (Vec<f64>, Vec<f64>) {
        let count = self.mesh.points().len();
        let (mut right, mut diagonal) = (vec![0.0; count], vec![0.0; count]);
        let width = D + 1;
        for (i, cell) in self.mesh.cells().enumerate() {
            for (k, &point) in cell.iter().enumerate() {
                right[point as usize] += self.rights[i * width + k];
                diagonal[point as usize] += self.matrices[(i * width + k) * width + k];
            }
        }
        diagonal.iter_mut().filter(|a| **a == 0.0).for_each(|a| *a = 1.0);
        (right, diagonal)
    }

    /// The least squares by conjugate gradients.
    fn solve(&self, watch: &mut dyn Watch) -> Result<Fit, MeasureError> {
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
            check(watch, Phase::Measure, 0.7 + 0.3 * (iterations as f64 / 200.0), None)?;
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

/// The samples in a cell.
struct CellSamples<const D: usize> {
    /// The image's shape.
    shape: [usize; D],
    /// The first sample of the cell's box, and how many there are along each axis.
    low: [usize; D],
    counts: [usize; D],
    /// The cell's first corner.
    first: Point<D>,
    /// Gradients of the barycentric coordinates: D + 1 of them, D at most 4.
    gradients: [Point<D>; 5],
}

impl<const D: usize> CellSamples<D> {
    /// The samples of a cell, given by its corners, in an image of a shape; `None` if the cell is flat or its box holds
    /// no sample.
    fn new(points: &[Point<D>], corners: &[u32], shape: [usize; D]) -> Option<Self> {
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
        let mut gradients = [[0.0; D]; 5];
        for k in 0..D {
            for r in 0..D {
                gradients[k + 1][r] = inverse[r][k];
                gradients[0][r] -= inverse[r][k];
            }
        }
        (counts[0] > 0).then_some(Self { shape, low, counts, first, gradients })
    }

    /// Calls `visit` with the index, the D + 1 barycentric coordinates and the box of each sample.
    fn each(&self, mut visit: impl FnMut(usize, &[f64], f64)) {
        for row in 0..self.counts[1..].iter().product() {
            let (mut rest, mut index, mut stride) = (row, self.low[0], self.shape[0]);
            let mut weight = 1.0;
            let mut offset = [self.low[0] as f64 - self.first[0]; D];
            for k in 1..D {
                let at = self.low[k] + rest % self.counts[k];
                rest /= self.counts[k];
                index += at * stride;
                stride *= self.shape[k];
                weight *= rim(at, self.shape[k]);
                offset[k] = at as f64 - self.first[k];
            }
            self.each_of_row(&offset, |i, shares| {
                visit(index + i, shares, weight * rim(self.low[0] + i, self.shape[0]));
            });
        }
    }

    /// Calls `visit` with the number and the barycentric coordinates of each sample of a row, the first of which is
    /// `offset` from the cell's first corner.
    #[inline(always)]
    fn each_of_row(&self, offset: &Point<D>, mut visit: impl FnMut(usize, &[f64])) {
        // the coordinates at the row's first sample, and from where to where none is below 0
        let mut starts = [0.0; 5];
        let (mut from, mut to) = (0.0_f64, (self.counts[0] - 1) as f64);
        for k in 0..=D {
            starts[k] = f64::from(u8::from(k == 0)) + dot(offset, &self.gradients[k]);
            let (start, slope) = (starts[k] + SLACK, self.gradients[k][0]);
            match slope {
                s if s > 0.0 => from = from.max((-start / s).ceil()),
                s if s < 0.0 => to = to.min((-start / s).floor()),
                _ if start < 0.0 => to = -1.0,
                _ => {}
            }
        }
        if from > to {
            return;
        }
        for i in from as usize..=to as usize {
            let shares: [f64; 5] =
                std::array::from_fn(|k| starts[k] + i as f64 * self.gradients[k][0]);
            visit(i, &shares[..=D]);
        }
    }
}

/// Which part of a box one wide lies in an image, along an axis.
fn rim(at: usize, count: usize) -> f64 {
    if at == 0 || at + 1 == count { 0.5 } else { 1.0 }
}
