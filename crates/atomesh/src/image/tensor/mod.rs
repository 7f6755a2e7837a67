//! The structure tensor: which way an image is layered, about each sample.
//!
//! In this order:
//!
//! 1. gradients of the image, smoothed a little, plane by plane;
//! 2. their outer products, averaged over cells of some samples each;
//! 3. the averages smoothed by the rest of the wide Gaussian;
//! 4. on request, the tensor at a sample, linear between cells, and its leading eigenvector (`normal`).
//!
//! With σ = 12 the tensors of a volume take a tenth of the memory of the image: see `cells`.
//!
//! Source: van Vliet & Verbeek (1995) for tensors of Gaussian derivatives; Hale (2002) uses them for the
//! normals of features. Cells are ours.

mod normal;

#[cfg(test)]
mod tests;

use super::cells::{CellAverages, CellRow, Entries, between};
use super::stream::{Stencil, Stream};
use super::{Grid, coordinates};
use crate::geometry::linear::Matrix;
use crate::parallel::prelude::*;
use crate::watch::{Cancelled, Watch};
use normal::normal;

/// Outer products of Gaussian gradients, smoothed: its leading eigenvector is the normal of layers and sheets.
///
/// In two or three dimensions. See the module for how it is held.
#[derive(Clone, Debug)]
pub struct StructureTensor<const D: usize> {
    shape: [usize; D],
    /// The upper triangle of the tensors, row by row; `None` of an image without samples.
    averages: Option<CellAverages<D>>,
}

/// The products of slopes.
struct Products;

impl<const D: usize> Entries<D> for Products {
    fn count(&self) -> usize {
        D * (D + 1) / 2
    }

    fn write(&self, entry: usize, _: &[f32], slopes: [&[f32]; D], out: &mut [f32]) {
        let (mut row, mut before) = (0, 0);
        while entry - before >= D - row {
            before += D - row;
            row += 1;
        }
        let (a, b) = (slopes[row], slopes[row + entry - before]);
        for (out, (a, b)) in out.iter_mut().zip(a.iter().zip(b)) {
            *out = a * b;
        }
    }
}

impl<const D: usize> StructureTensor<D> {
    /// The tensors of an image.
    ///
    /// Gradients are per lattice unit, of the image smoothed by `derivative_scale`, in least steps of the
    /// grid, as of [`gradient_magnitude`](super::gradient_magnitude). Their products are smoothed by a Gaussian of
    /// standard deviations `smooth`, in samples along each axis; 0 leaves an axis alone. Samples are mirrored about the
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
        if values.is_empty() {
            return Ok(Self { shape: grid.shape, averages: None });
        }
        let scale = unit_scale(values);
        let fill = |start: usize, out: &mut [f32]| {
            for (out, v) in out.iter_mut().zip(&values[start..]) {
                *out = v * scale;
            }
        };
        let least = grid.least_step();
        let grid = Grid { step: grid.step.map(|step| step / least), ..*grid };
        let stream = Stream::new(fill, &grid, Stencil::Gaussian(derivative_scale));
        let averages = CellAverages::new(&stream, grid.shape, smooth, &Products, watch)?;
        Ok(Self { shape: grid.shape, averages: Some(averages) })
    }

    /// The tensor at a sample, in squared lattice units, of which only the ratios mean something.
    fn at(&self, sample: [usize; D]) -> Matrix<D> {
        let Some(averages) = &self.averages else { return [[0.0; D]; D] };
        let row = averages.row(sample);
        matrix(|entry| row.at(entry, sample[0]))
    }

    /// The normals of a sample's row along the first axis: faster than one by one.
    pub(crate) fn row(&self, sample: [usize; D]) -> Option<NormalRow<'_, D>> {
        let row = self.averages.as_ref()?.row(sample);
        let mut cells = Vec::new();
        row.cells(&mut cells);
        Some(NormalRow { row, cells })
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
        normal(&self.at(coordinates(index, self.shape)))
    }
}

/// Normals along a row of samples.
pub(crate) struct NormalRow<'a, const D: usize> {
    row: CellRow<'a, D>,
    /// The tensors of the row's cells, entry by entry.
    cells: Vec<f32>,
}

impl<const D: usize> NormalRow<'_, D> {
    /// [`StructureTensor::normal`] of sample `x` of the row, to the last bit.
    pub(crate) fn normal(&self, x: usize) -> ([f32; D], f32) {
        let (here, next, share) = self.row.place(x);
        let count = self.cells.len() / (D * (D + 1) / 2);
        normal(&matrix(|entry| {
            let cells = &self.cells[entry * count..];
            between(cells[here], cells[next], share)
        }))
    }
}

/// The symmetric matrix of which `entry` gives the upper triangle, row by row.
fn matrix<const D: usize>(entry: impl Fn(usize) -> f32) -> Matrix<D> {
    let (mut matrix, mut count) = ([[0.0; D]; D], 0);
    for a in 0..D {
        for b in a..D {
            matrix[a][b] = entry(count).into();
            matrix[b][a] = matrix[a][b];
            count += 1;
        }
    }
    matrix
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
