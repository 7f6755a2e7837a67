//! How well a mesh can carry its image: the error that is left when the image is rebuilt from the mesh.
//!
//! *Piecewise constant*: each cell has the mean of its samples. *Piecewise linear*: continuous, with a value at each
//! point such that the squared differences at the samples are least (linear least squares; not the image's values at
//! the points, which noise would spoil). A sample belongs to the cell that it lies in, on a facet to the first of its
//! cells, and counts by its box, cut at the image's rim. Both errors are root mean squares over the samples that the mesh
//! covers.
//!
//! Sums over the samples in cells are made of those of rows of samples, and the least squares are solved by conjugate
//! gradients (`linear`).

mod linear;
#[cfg(test)]
mod tests;

use super::MeasureError;
use super::statistics::{self, Histogram, sums};
use crate::image::{Frame, Image, Samples, Units};
use crate::mesh::Mesh;
use crate::sample::{CellSurfaces, SampleOptions, Statistic, check_samples, sample};
use crate::watch::{Phase, Watch, check};
use linear::System;

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
    check_samples(frame, samples, &[])?;
    let mesh = mesh.moved(false, |p| frame.world_to_lattice(Units::Samples, p));
    let placed = PlacedMesh { mesh: &mesh, shape: frame.shape(), samples };
    check(watch, Phase::Measure, 0.0, None)?;
    let system = System::new(&placed);
    let total = system.weight();
    if total <= 0.0 {
        return Err(MeasureError::NoCells { points: mesh.points().len() });
    }
    check(watch, Phase::Measure, 0.5, None)?;
    let fit = system.solve(watch)?;
    let deviation = system.deviation();
    let (constant_rms, linear_rms) = (system.constant_rms(), fit.mean_square.max(0.0).sqrt());
    let relative = |rms: f64| (deviation > 0.0).then(|| rms / deviation);
    let whole = frame.grid(Units::Samples).bounds().measure();
    Ok(FidelityReport {
        covered: (total / whole).min(1.0),
        deviation,
        constant_rms,
        linear_rms,
        constant_relative: relative(constant_rms),
        linear_relative: relative(linear_rms),
        iterations: fit.iterations,
        converged: fit.converged,
    })
}

/// A mesh and an image, both in sample coordinates.
struct PlacedMesh<'a, const D: usize> {
    mesh: &'a Mesh<D>,
    shape: [usize; D],
    samples: &'a Samples,
}

/// Measures how much of one label each cell is; the cells are in world coordinates.
///
/// # Errors
/// [`MeasureError`] if no cell has labels, the image holds no labels, or the watch ends the work.
pub fn homogeneity<const D: usize>(
    cells: &impl CellSurfaces<D>,
    labels: &Image<D>,
    watch: &mut dyn Watch,
) -> Result<HomogeneityReport, MeasureError> {
    let options = SampleOptions::new(&[Statistic::Homogeneity]);
    let found = sample(cells, labels, options, watch)?;
    let of_cells = &found.values[0];
    let known: Vec<f64> = of_cells.iter().copied().filter(|share| share.is_finite()).collect();
    if known.is_empty() {
        return Err(MeasureError::NoLabels { cells: of_cells.len() });
    }
    let [shares, weights] = sums(0..of_cells.len(), &|i| {
        let weight = found.measures[i] * found.coverage[i];
        if of_cells[i].is_finite() { [weight * of_cells[i], weight] } else { [0.0; 2] }
    });
    Ok(HomogeneityReport {
        mean: shares / weights,
        min: statistics::least(&known),
        mixed: known.iter().filter(|&&share| share < 0.9).count(),
        histogram: Histogram::of(&known, 0.05, 20),
        without: of_cells.len() - known.len(),
    })
}
