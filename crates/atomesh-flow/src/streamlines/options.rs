//! Options of streamlines, and the porosity that times of flight depend on.

use crate::error::FlowError;

/// The share of a cell that fluid fills, above 0 and up to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Porosity<'a> {
    /// The same everywhere.
    Constant(f64),
    /// One for each cell.
    Cells(&'a [f64]),
}

impl Porosity<'_> {
    /// Refuses the first value that is not a porosity.
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

/// Options of [`trace`](super::trace).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TraceOptions<'a> {
    /// How many lines, distributed among wells and boundaries by their inflow. Default 100.
    pub count: usize,
    /// The porosity. Default 1: times are those of the Darcy velocity.
    pub porosity: Porosity<'a>,
    /// The largest number of segments of a line. Default 100 000.
    pub limit: usize,
}

impl Default for TraceOptions<'_> {
    fn default() -> Self {
        Self { count: 100, porosity: Porosity::Constant(1.0), limit: 100_000 }
    }
}
