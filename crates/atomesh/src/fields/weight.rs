//! The weight β(x) of the image against regularity.

use crate::geometry::{Bounds, Point};
use crate::image::Grid;

use super::{FieldError, Interpolation, ScalarField};

/// The weight β(x) of the image against regularity, in 0…1.
///
/// Source: Hale (2001), equations (4) and (5).
#[derive(Clone, Debug)]
pub struct ImageWeight<const D: usize> {
    constant: f64,
    field: Option<ScalarField<D>>,
}

impl<const D: usize> ImageWeight<D> {
    /// The same weight everywhere.
    ///
    /// # Errors
    /// [`FieldError::Weight`] if it is outside 0…1, or NaN.
    pub fn constant(weight: f64) -> Result<Self, FieldError> {
        if !(0.0..=1.0).contains(&weight) {
            return Err(FieldError::Weight { index: None, value: weight });
        }
        Ok(Self { constant: weight, field: None })
    }

    /// A weight for every sample of the grid, x fastest, linear in between.
    ///
    /// # Errors
    /// [`FieldError::Weight`] if a sample is outside 0…1, or NaN; [`FieldError::SampleCount`]
    /// if the count is not the grid's.
    pub fn field(grid: Grid<D>, samples: Vec<f32>) -> Result<Self, FieldError> {
        if let Some(i) = samples.iter().position(|w| !(0.0..=1.0).contains(w)) {
            return Err(FieldError::Weight { index: Some(i), value: f64::from(samples[i]) });
        }
        let field = ScalarField::unchecked(grid, samples, Interpolation::Linear)?;
        Ok(Self { constant: 0.0, field: Some(field) })
    }

    /// β at a lattice point.
    pub fn at(&self, p: &Point<D>) -> f64 {
        self.field.as_ref().map_or(self.constant, |field| field.value(p))
    }

    /// The box of the samples; `None` if β is the same everywhere.
    pub(super) fn bounds(&self) -> Option<Bounds<D>> {
        self.field.as_ref().map(|field| field.grid().bounds())
    }

    /// β, where it is the same everywhere.
    pub fn as_constant(&self) -> Option<f64> {
        if self.field.is_none() { Some(self.constant) } else { None }
    }
}
