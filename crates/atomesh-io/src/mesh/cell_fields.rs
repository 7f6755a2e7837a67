//! What is known of each cell: numbers and vectors.

use super::field::{Field, MeshDataError, Values, check_field};

/// A named vector for each cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VectorField<'a, const D: usize> {
    name: &'a str,
    vectors: &'a [[f64; D]],
}

impl<'a, const D: usize> VectorField<'a, D> {
    /// The name, fit for every format.
    pub fn name(&self) -> &'a str {
        self.name
    }

    /// The vectors, one for each cell.
    pub fn vectors(&self) -> &'a [[f64; D]] {
        self.vectors
    }
}

/// Named numbers and vectors, one for each of a number of cells, in the order in which they were added.
#[derive(Clone, Debug, PartialEq)]
pub struct CellFields<'a, const D: usize> {
    cell_count: usize,
    numbers: Vec<Field<'a>>,
    vectors: Vec<VectorField<'a, D>>,
}

impl<'a, const D: usize> CellFields<'a, D> {
    /// None yet, of a mesh of so many cells.
    pub fn new(cell_count: usize) -> Self {
        Self { cell_count, numbers: Vec::new(), vectors: Vec::new() }
    }

    /// The same with a number in each cell, such as `pressure`.
    ///
    /// # Errors
    /// [`MeshDataError`] if the values are not one a cell, or the name does not fit every format.
    pub fn with_numbers(
        mut self,
        name: &'a str,
        values: impl Into<Values<'a>>,
    ) -> Result<Self, MeshDataError> {
        let values = values.into();
        self.check(name, values.len())?;
        self.numbers.push(Field::new(name, values));
        Ok(self)
    }

    /// The same with a vector in each cell, such as `velocity`.
    ///
    /// # Errors
    /// As [`Self::with_numbers`].
    pub fn with_vectors(
        mut self,
        name: &'a str,
        vectors: &'a [[f64; D]],
    ) -> Result<Self, MeshDataError> {
        self.check(name, vectors.len())?;
        self.vectors.push(VectorField { name, vectors });
        Ok(self)
    }

    fn check(&self, name: &str, found: usize) -> Result<(), MeshDataError> {
        let numbers = self.numbers.iter().map(Field::name);
        let others = numbers.chain(self.vectors.iter().map(VectorField::name));
        check_field(others, name, found, self.cell_count)
    }

    /// The numbers.
    pub fn numbers(&self) -> &[Field<'a>] {
        &self.numbers
    }

    /// The vectors.
    pub fn vectors(&self) -> &[VectorField<'a, D>] {
        &self.vectors
    }

    /// Whether nothing is known of the cells.
    pub fn is_empty(&self) -> bool {
        self.numbers.is_empty() && self.vectors.is_empty()
    }
}
