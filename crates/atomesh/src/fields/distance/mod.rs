//! The nominal distance d(x): the edge length wanted at x.
//!
//! d is smooth, |∇d| ≪ 1 (Hale 2001, section 2.1), so it is kept on nodes half the least distance
//! apart, far fewer than the image's samples, and interpolated linearly between them. Wherever it
//! comes from, its slope is limited by g: it is lowered until d(x) ≤ d(y) + g |x − y| for all x and y,
//! which leaves its minimum as it is. Lengths are in lattice units.

mod coarse;
mod default;
mod grading;
mod limit;

use super::{Interpolation, ScalarField};
use crate::geometry::{Bounds, Point};
use crate::image::Grid;
use crate::parallel::prelude::*;
use coarse::{Take, coarse_grid, reduce};
use limit::limit_gradient;

pub use default::default_distance;
pub use grading::{GradeBy, Grading, feature_density};

/// The default limit of the slope of d, in lattice units per lattice unit.
///
/// Of the order of the paper's Fig. 5 (d from 6 to 18 within some 50 samples); neighbouring edges
/// then differ by a quarter, which a lattice follows without defects.
pub const GRADIENT_LIMIT: f64 = 0.25;

/// Why there is no nominal distance.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DistanceError {
    /// A distance is zero, negative, infinite or NaN.
    #[error("nominal distance {value}; expected a finite length above 0")]
    NotPositive {
        /// The distance found.
        value: f64,
    },
    /// A distance is less than the least step from sample to sample.
    #[error("nominal distance {value} is below the sample step {step}; expected {step} or more")]
    BelowStep {
        /// The distance found.
        value: f64,
        /// The least step of all axes.
        step: f64,
    },
    /// The least distance exceeds the greatest.
    #[error("nominal distances from {min} to {max}; expected the least first")]
    Order {
        /// The least distance asked for.
        min: f64,
        /// The greatest distance asked for.
        max: f64,
    },
    /// A sample of a distance field is zero, negative, infinite or NaN.
    #[error("nominal distance {value} at sample {index}; expected a finite length above 0")]
    FieldValue {
        /// The index of the sample, x fastest.
        index: usize,
        /// The value found.
        value: f32,
    },
    /// A field does not have the image's shape.
    #[error("{found} samples of a field for an image of shape {shape:?}")]
    FieldShape {
        /// The image's shape: x, y (and z).
        shape: Vec<usize>,
        /// The samples that the field has.
        found: usize,
    },
    /// The limit of the slope is zero, negative, infinite or NaN.
    #[error("gradient limit {value}; expected a finite number above 0")]
    GradientLimit {
        /// The limit found.
        value: f64,
    },
    /// The standard deviation of a grading's smoothing is negative, infinite or NaN.
    #[error("smoothing {value} of the nominal distance; expected a finite length, 0 or more")]
    Smooth {
        /// The standard deviation found.
        value: f64,
    },
}

/// The nominal distance d(x) over an image's box, in lattice units.
#[derive(Clone, Debug, PartialEq)]
pub struct NominalDistance<const D: usize> {
    /// d at nodes over the image's box; `None`: it is the same everywhere.
    nodes: Option<ScalarField<D>>,
    /// The image's box.
    bounds: Bounds<D>,
    least: f64,
    greatest: f64,
    greatest_slope: f64,
}

impl<const D: usize> NominalDistance<D> {
    /// The same distance everywhere.
    ///
    /// # Errors
    /// [`DistanceError::NotPositive`], [`DistanceError::BelowStep`].
    pub fn constant(grid: &Grid<D>, distance: f64) -> Result<Self, DistanceError> {
        check_length(distance)?;
        check_step(grid, distance)?;
        Ok(Self {
            nodes: None,
            bounds: grid.bounds(),
            least: distance,
            greatest: distance,
            greatest_slope: 0.0,
        })
    }

    /// d as the user gives it at every sample, lowered where its slope exceeds `gradient_limit`.
    ///
    /// A node takes the least of the samples around it, so that d is nowhere above the field.
    ///
    /// # Errors
    /// [`DistanceError::FieldShape`], [`DistanceError::FieldValue`], [`DistanceError::BelowStep`],
    /// [`DistanceError::GradientLimit`].
    pub fn from_field(
        grid: &Grid<D>,
        field: &[f32],
        gradient_limit: f64,
    ) -> Result<Self, DistanceError> {
        check_count(grid, field.len())?;
        check_limit(gradient_limit)?;
        let Some(least) = least_length(field) else {
            let index = field.iter().position(|d| !is_length(*d)).unwrap_or(0);
            return Err(DistanceError::FieldValue { index, value: field[index] });
        };
        let least = least.into();
        check_step(grid, least)?;
        let nodes = coarse_grid(grid, 0.5 * least);
        let mut values = reduce(field, grid, &nodes, Take::Least);
        limit_gradient(&mut values, nodes.shape, nodes.step, gradient_limit);
        Ok(Self::new(nodes, values, grid))
    }

    fn new(nodes: Grid<D>, values: Vec<f32>, grid: &Grid<D>) -> Self {
        let least = values.iter().copied().fold(f32::INFINITY, f32::min).into();
        let greatest = values.iter().copied().fold(0.0, f32::max).into();
        let is_constant = least == greatest;
        Self {
            greatest_slope: if is_constant { 0.0 } else { greatest_slope(&values, &nodes) },
            nodes: (!is_constant).then(|| {
                ScalarField::unchecked(nodes, values, Interpolation::Linear)
                    .expect("there is one value a node")
            }),
            bounds: grid.bounds(),
            least,
            greatest,
        }
    }

    /// d at a point; outside the box, d at the nearest point of the box.
    #[inline]
    pub fn at(&self, p: &Point<D>) -> f64 {
        self.nodes.as_ref().map_or(self.least, |nodes| nodes.value(p))
    }

    /// The image's box.
    pub fn bounds(&self) -> &Bounds<D> {
        &self.bounds
    }

    /// The least d anywhere.
    pub fn least(&self) -> f64 {
        self.least
    }

    /// The greatest d anywhere.
    pub fn greatest(&self) -> f64 {
        self.greatest
    }

    /// A bound of |∇d|: |d(x) − d(y)| is at most this times |x − y|, for any points of the box.
    pub fn greatest_slope(&self) -> f64 {
        self.greatest_slope
    }

    /// Whether d is the same everywhere.
    pub fn is_constant(&self) -> bool {
        self.nodes.is_none()
    }

    /// The mean of d over the box.
    pub fn mean(&self) -> f64 {
        self.average(|d| d)
    }

    /// About how many atoms fill the box: the integral of `density` / d^D, without the atoms that
    /// the boundary takes beyond that.
    ///
    /// `density` is the crystal's number of atoms per d^D: 2/√3 for hexagonal, √2 for FCC, 3√3/4
    /// for BCC.
    pub fn estimated_atoms(&self, density: f64) -> f64 {
        self.bounds.measure() * self.average(|d| density / d.powi(D as i32))
    }

    /// The mean of a function of d over the box, by the trapezoidal rule. Rows are added in their order,
    /// whatever threads took them.
    fn average(&self, f: impl Fn(f64) -> f64 + Sync) -> f64 {
        let Some(nodes) = &self.nodes else { return f(self.least) };
        let shape = nodes.grid().shape;
        let row = |(r, row): (usize, &[f32])| {
            let (mut rest, mut across) = (r, 1.0);
            for &n in &shape[1..] {
                across *= trapezoid(rest % n, n);
                rest /= n;
            }
            // several sums, so that none waits for another
            let (blocks, tail) = row.as_chunks::<LANES>();
            let mut sums = [0.0; LANES];
            for block in blocks {
                for (sum, &d) in sums.iter_mut().zip(block) {
                    *sum += f(d.into());
                }
            }
            let tail: f64 = tail.iter().map(|&d| f(d.into())).sum();
            let whole = sums.iter().sum::<f64>() + tail;
            let ends =
                if row.len() > 1 { f(row[0].into()) + f(row[row.len() - 1].into()) } else { 0.0 };
            across * (whole - 0.5 * ends)
        };
        let sums: Vec<f64> =
            nodes.samples().par_chunks_exact(shape[0]).enumerate().map(row).collect();
        let weights: usize = shape.iter().map(|n| n.saturating_sub(1).max(1)).product();
        sums.iter().sum::<f64>() / weights as f64
    }
}

/// Values of a row that are added side by side.
const LANES: usize = 8;

/// The greatest slope of values interpolated linearly between nodes.
///
/// Within a cell the slope along an axis is a mean of the slopes of the edges along it.
fn greatest_slope<const D: usize>(values: &[f32], nodes: &Grid<D>) -> f64 {
    let cells = nodes.shape.map(|n| n.saturating_sub(1).max(1)); // an axis of one node is flat
    let strides = nodes.strides();
    let edge = |k: usize| if nodes.shape[k] > 1 { strides[k] } else { 0 };
    let squared_of_row = |row: usize| {
        let (mut rest, mut start) = (row, 0);
        for k in 1..D {
            start += rest % cells[k] * strides[k];
            rest /= cells[k];
        }
        let mut squared = 0.0f64;
        for first in start..start + cells[0] {
            let mut cell = 0.0;
            for k in 0..D {
                let mut rise = 0.0f32;
                for corner in (0..1 << D).filter(|corner| corner >> k & 1 == 0) {
                    let from = first + (0..D).map(|j| (corner >> j & 1) * edge(j)).sum::<usize>();
                    rise = rise.max((values[from + edge(k)] - values[from]).abs());
                }
                cell += (f64::from(rise) / nodes.step[k]).powi(2);
            }
            squared = squared.max(cell);
        }
        squared
    };
    let rows: usize = cells[1..].iter().product();
    (0..rows).into_par_iter().map(squared_of_row).reduce(|| 0.0, f64::max).sqrt()
}

fn is_length(value: f32) -> bool {
    value > 0.0 && value <= f32::MAX
}

/// The least value; `None` if one is no length above 0.
fn least_length(field: &[f32]) -> Option<f32> {
    let of_block = |block: &[f32]| {
        // side by side, so that none waits for another
        let (mut least, mut bad) = ([f32::INFINITY; LANES], [false; LANES]);
        let (blocks, tail) = block.as_chunks::<LANES>();
        let mut look = |values: &[f32]| {
            for ((least, bad), &d) in least.iter_mut().zip(&mut bad).zip(values) {
                *least = if d < *least { d } else { *least };
                *bad |= !is_length(d);
            }
        };
        blocks.iter().for_each(|values| look(values));
        look(tail);
        (least.into_iter().fold(f32::INFINITY, f32::min), !bad.contains(&true))
    };
    let both = |a: (f32, bool), b: (f32, bool)| (a.0.min(b.0), a.1 & b.1);
    let (least, good) =
        field.par_chunks(BLOCK).map(of_block).reduce(|| (f32::INFINITY, true), both);
    good.then_some(least)
}

/// Values that one thread checks at a time.
const BLOCK: usize = 1 << 16;

/// The weight of node `i` of `n` in the trapezoidal rule.
fn trapezoid(i: usize, n: usize) -> f64 {
    if n > 1 && (i == 0 || i + 1 == n) { 0.5 } else { 1.0 }
}

fn check_count<const D: usize>(grid: &Grid<D>, found: usize) -> Result<(), DistanceError> {
    if found == grid.sample_count() {
        Ok(())
    } else {
        Err(DistanceError::FieldShape { shape: grid.shape.to_vec(), found })
    }
}

fn check_length(value: f64) -> Result<(), DistanceError> {
    if value.is_finite() && value > 0.0 {
        Ok(())
    } else {
        Err(DistanceError::NotPositive { value })
    }
}

fn check_step<const D: usize>(grid: &Grid<D>, value: f64) -> Result<(), DistanceError> {
    let step = grid.least_step();
    if value < step { Err(DistanceError::BelowStep { value, step }) } else { Ok(()) }
}

fn check_limit(value: f64) -> Result<(), DistanceError> {
    if value.is_finite() && value > 0.0 {
        Ok(())
    } else {
        Err(DistanceError::GradientLimit { value })
    }
}

#[cfg(test)]
mod tests;
