//! How many streamlines, and how fast a particle moves along them.

use crate::error::FlowError;

/// The share of a cell that fluid fills, more than 0 and at most 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Porosity<'a> {
    /// The same everywhere.
    Constant(f64),
    /// One for each cell.
    Cells(&'a [f64]),
}

impl Porosity<'_> {
    /// Finds the first value that is no porosity.
    ///
    /// # Errors
    /// [`FlowError::Porosity`] and [`FlowError::PorosityCount`].
    pub fn check(&self, cell_count: usize) -> Result<(), FlowError> {
        let values = match self {
            Self::Constant(value) => std::slice::from_ref(value),
            Self::Cells(values) if values.len() != cell_count => {
                let (found, expected) = (values.len(), cell_count);
                return Err(FlowError::PorosityCount { found, expected });
            }
            Self::Cells(values) => values,
        };
        match values.iter().position(|&value| !(value > 0.0 && value <= 1.0)) {
            Some(cell) => Err(FlowError::Porosity { cell, value: values[cell] }),
            None => Ok(()),
        }
    }

    /// The porosity of a cell.
    ///
    /// # Panics
    /// If there is no such cell.
    pub fn of(&self, cell: usize) -> f64 {
        match self {
            Self::Constant(value) => *value,
            Self::Cells(values) => values[cell],
        }
    }
}

/// Options of [`trace`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TraceOptions<'a> {
    /// How many lines, dealt among wells and boundaries by what flows in there. Default 100.
    pub count: usize,
    /// The porosity. Default 1, so that times are those of the Darcy velocity.
    pub porosity: Porosity<'a>,
    /// The most segments of a line. Default 100 000.
    pub limit: usize,
}

impl Default for TraceOptions<'_> {
    fn default() -> Self {
        Self { count: 100, porosity: Porosity::Constant(1.0), limit: 100_000 }
    }
}
