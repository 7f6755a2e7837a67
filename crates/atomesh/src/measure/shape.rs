//! The shape of all cells of a mesh, and the lengths of its edges.

use super::MeasureError;
use super::cell_shape::{CellShape, cell_shape};
use super::faces::faces;
use super::statistics::{Histogram, least, percentile, sum, sums};
use crate::geometry::{Bounds, difference, dot};
use crate::mesh::Mesh;
use crate::parallel::prelude::*;
use crate::watch::{Phase, Watch, check};

/// The greatest measure of a flat cell, over the median.
const FLAT: f64 = 1e-9;

/// Cells measured between two looks at the watch: a few hundredths of a second.
const CELLS_PER_STEP: usize = 1 << 18;

/// The bins of quality, up to 1.
const QUALITY_WIDTH: f64 = 0.05;
const QUALITY_BINS: usize = 20;

/// The bins of least angles, in degrees, up to 75° and beyond.
const ANGLE_WIDTH: f64 = 5.0;
const ANGLE_BINS: usize = 15;

/// Counts, sizes and shapes of a mesh's cells. Lengths are in the unit of its coordinates.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct ShapeReport {
    /// Points of the mesh, whether a cell uses them or not.
    pub points: usize,
    /// Cells of the mesh.
    pub cells: usize,
    /// Cells with negative measure.
    pub inverted: usize,
    /// Cells with a measure of at most 1e-9 of the median: they count with quality 0 and angle 0.
    pub flat: usize,
    /// The sum of the cells' measures, each without its sign.
    pub total_measure: f64,
    /// |total − box| / box for the box that the mesh should fill, if one was given.
    pub volume_error: Option<f64>,
    /// Mean of the quality D · inradius / circumradius, in 0…1.
    pub q_mean: f64,
    /// First percentile of the quality.
    pub q_p1: f64,
    /// Least quality.
    pub q_min: f64,
    /// The least of the cells' least angles, in degrees.
    pub angle_min: f64,
    /// First percentile of the cells' least angles, in degrees.
    pub angle_p1: f64,
    /// Fifth percentile of the cells' least angles, in degrees.
    pub angle_p5: f64,
    /// Mean length of the distinct edges.
    pub edge_mean: f64,
    /// Root mean square of the edges' components along x, y (and z): equal if the mesh is isotropic.
    pub edge_rms_per_axis: Vec<f64>,
    /// Cells by quality, in 20 bins of 0.05.
    pub q_histogram: Histogram,
    /// Cells by least angle, in 15 bins of 5°.
    pub angle_histogram: Histogram,
}

/// The shape of every cell, in the mesh's order; flat cells (of at most 1e-9 of the median
/// measure) have quality 0 and angle 0.
///
/// # Errors
/// [`MeasureError::NoCells`] if there are none, [`MeasureError::Cancelled`] if the watch says so.
pub fn shapes<const D: usize>(
    mesh: &Mesh<D>,
    watch: &mut dyn Watch,
) -> Result<Vec<CellShape>, MeasureError> {
    if mesh.cell_count() == 0 {
        return Err(MeasureError::NoCells { points: mesh.points().len() });
    }
    let mut shapes = vec![CellShape::default(); mesh.cell_count()];
    let corners = mesh.corners().chunks(CELLS_PER_STEP * (D + 1));
    for (step, (block, corners)) in shapes.chunks_mut(CELLS_PER_STEP).zip(corners).enumerate() {
        let done = (step * CELLS_PER_STEP) as f64 / mesh.cell_count() as f64;
        check(watch, Phase::Measure, done, None)?;
        block.par_iter_mut().zip(corners.par_chunks(D + 1)).with_min_len(1024).for_each(
            |(shape, cell)| {
                let corner = |k: usize| &mesh.points()[cell[k] as usize];
                *shape = cell_shape(&std::array::from_fn(|k| difference(corner(k + 1), corner(0))));
            },
        );
    }
    let mut sizes: Vec<f64> = shapes.par_iter().map(|s| s.measure.abs()).collect();
    let limit = FLAT * percentile(&mut sizes, 50.0);
    shapes.par_iter_mut().filter(|s| s.measure.abs() <= limit).for_each(|shape| {
        *shape = CellShape { measure: shape.measure, ..CellShape::default() };
    });
    Ok(shapes)
}

/// Measures all cells and edges; `bounds` is the box that the mesh should fill, if it should.
///
/// Deterministic: the same numbers at any thread count. Cost: O(n log n) in cells.
///
/// # Errors
/// [`MeasureError::NoCells`] if there are none, [`MeasureError::Cancelled`] if the watch says so.
pub fn shape<const D: usize>(
    mesh: &Mesh<D>,
    bounds: Option<&Bounds<D>>,
    watch: &mut dyn Watch,
) -> Result<ShapeReport, MeasureError> {
    let shapes = shapes(mesh, watch)?;
    let cells = shapes.len();
    let total_measure = sum(0..cells, &|i| shapes[i].measure.abs());
    let q_mean = sum(0..cells, &|i| shapes[i].quality) / cells as f64;
    let (qualities, angles) = rayon::join(
        || {
            let values: Vec<f64> = shapes.par_iter().map(|s| s.quality).collect();
            let histogram = Histogram::of(&values, QUALITY_WIDTH, QUALITY_BINS);
            Spread::of(values, [1.0], histogram)
        },
        || {
            let values: Vec<f64> = shapes.par_iter().map(|s| s.least_angle).collect();
            let histogram = Histogram::of(&values, ANGLE_WIDTH, ANGLE_BINS);
            Spread::of(values, [1.0, 5.0], histogram)
        },
    );
    let inverted = shapes.par_iter().filter(|s| s.measure < 0.0).count();
    let flat = shapes.par_iter().filter(|s| s.quality == 0.0).count();
    drop(shapes);

    check(watch, Phase::Measure, 1.0, None)?;
    let edges = EdgeLengths::of(mesh);
    Ok(ShapeReport {
        points: mesh.points().len(),
        cells,
        inverted,
        flat,
        total_measure,
        volume_error: bounds.map(|b| (total_measure - b.measure()).abs() / b.measure()),
        q_mean,
        q_p1: qualities.percentiles[0],
        q_min: qualities.least,
        angle_min: angles.least,
        angle_p1: angles.percentiles[0],
        angle_p5: angles.percentiles[1],
        edge_mean: edges.mean,
        edge_rms_per_axis: edges.rms_per_axis,
        q_histogram: qualities.histogram,
        angle_histogram: angles.histogram,
    })
}

/// How values are spread.
struct Spread<const N: usize> {
    least: f64,
    percentiles: [f64; N],
    histogram: Histogram,
}

impl<const N: usize> Spread<N> {
    /// The spread of values that `histogram` counts, with some percentiles of them, ascending.
    fn of(mut values: Vec<f64>, percents: [f64; N], histogram: Histogram) -> Self {
        let least = least(&values);
        Self { least, percentiles: percents.map(|p| percentile(&mut values, p)), histogram }
    }
}

/// Lengths of the distinct edges.
struct EdgeLengths {
    mean: f64,
    rms_per_axis: Vec<f64>,
}

impl EdgeLengths {
    fn of<const D: usize>(mesh: &Mesh<D>) -> Self {
        let edges = faces::<D, 2>(mesh);
        let edge = |i: usize| {
            let [a, b] = edges[i];
            difference(&mesh.points()[b as usize], &mesh.points()[a as usize])
        };
        let count = edges.len() as f64;
        Self {
            mean: sum(0..edges.len(), &|i| dot(&edge(i), &edge(i)).sqrt()) / count,
            rms_per_axis: sums(0..edges.len(), &|i| edge(i).map(|x| x.powi(2)))
                .map(|squared| (squared / count).sqrt())
                .to_vec(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::watch::{Phase, Silent};
    use std::ops::ControlFlow;

    /// Two sound triangles of the unit square, one turned over and one flat.
    fn spoiled() -> Mesh<2> {
        let points = vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.5, 0.0]];
        Mesh::new(points, vec![0, 1, 2, 0, 2, 3, 0, 2, 1, 0, 4, 1]).unwrap()
    }

    #[test]
    fn inverted_and_flat_cells_are_counted() {
        let unit = Bounds { min: [0.0; 2], max: [1.0; 2] };
        let report = shape(&spoiled(), Some(&unit), &mut Silent).unwrap();
        assert_eq!((report.cells, report.inverted, report.flat), (4, 1, 1));
        assert_eq!((report.q_min, report.angle_min), (0.0, 0.0));
        assert_eq!(report.total_measure, 1.5);
        assert_eq!(report.volume_error, Some(0.5));
        // a half square: r/R = 2(√2 − 1)·… = 2 (1 − 1/√2) / (√2/2)
        let half = 2.0 * (1.0 - 0.5f64.sqrt()) / 0.5f64.sqrt();
        assert!((report.q_mean - 0.75 * half).abs() < 1e-15);
        assert_eq!(report.q_histogram.counts.iter().sum::<u64>(), 4);
        assert_eq!(report.angle_histogram.counts[9], 3 - report.angle_histogram.counts[8]);
    }

    #[test]
    fn edges_are_counted_once() {
        let points = vec![[0.0, 0.0], [3.0, 0.0], [3.0, 1.0], [0.0, 1.0]];
        let mesh = Mesh::new(points, vec![0, 1, 2, 0, 2, 3]).unwrap();
        let report = shape(&mesh, None, &mut Silent).unwrap();
        assert!((report.edge_mean - (8.0 + 10f64.sqrt()) / 5.0).abs() < 1e-15);
        assert!((report.edge_rms_per_axis[0] - (27.0f64 / 5.0).sqrt()).abs() < 1e-15);
        assert!((report.edge_rms_per_axis[1] - (3.0f64 / 5.0).sqrt()).abs() < 1e-15);
        assert_eq!(report.volume_error, None);
    }

    #[test]
    fn no_cells_and_cancelling_are_errors() {
        let empty = Mesh::<3>::new(vec![[0.0; 3]], vec![]).unwrap();
        assert_eq!(shape(&empty, None, &mut Silent), Err(MeasureError::NoCells { points: 1 }));
        struct Stop;
        impl Watch for Stop {
            fn step(&mut self, phase: Phase, _: f64, _: Option<f64>) -> ControlFlow<()> {
                assert_eq!(phase, Phase::Measure);
                ControlFlow::Break(())
            }
        }
        assert!(matches!(shape(&spoiled(), None, &mut Stop), Err(MeasureError::Cancelled(_))));
    }
}
