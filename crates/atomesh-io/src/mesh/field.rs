//! Named values at the points or in the cells of a mesh.

use super::metadata;

/// Names that some format gives to other arrays.
const RESERVED: [&str; 4] = ["points", "cells", "metadata", metadata::NAME];

/// What is wrong with the parts of a [`MeshData`](super::MeshData).
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MeshDataError {
    /// A field has not one value for each point or cell.
    #[error("field {name:?} has {found} values for {expected} points or cells")]
    FieldLength {
        /// The field's name.
        name: String,
        /// The number of points or cells.
        expected: usize,
        /// The number of values.
        found: usize,
    },
    /// A name that not every format can hold.
    #[error(
        "field name {name:?}; expected 1 to 64 letters, digits, '_' or '-', other than those of other fields and {RESERVED:?}"
    )]
    FieldName {
        /// The name found.
        name: String,
    },
}

/// The numbers of a field, in the precision in which files keep them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Values<'a> {
    /// Single precision: enough for what was measured.
    Single(&'a [f32]),
    /// Double precision: for sums, and for labels above 2²⁴.
    Double(&'a [f64]),
}

impl Values<'_> {
    /// How many numbers there are.
    pub fn len(&self) -> usize {
        match self {
            Self::Single(values) => values.len(),
            Self::Double(values) => values.len(),
        }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Number `i`.
    ///
    /// # Panics
    /// If there is none.
    pub fn get(&self, i: usize) -> f64 {
        match self {
            Self::Single(values) => values[i].into(),
            Self::Double(values) => values[i],
        }
    }
}

macro_rules! values {
    ($($kind:ident of $number:ty),*) => {$(
        impl<'a> From<&'a [$number]> for Values<'a> {
            fn from(values: &'a [$number]) -> Self {
                Self::$kind(values)
            }
        }

        impl<'a> From<&'a Vec<$number>> for Values<'a> {
            fn from(values: &'a Vec<$number>) -> Self {
                Self::$kind(values)
            }
        }
    )*};
}
values!(Single of f32, Double of f64);

/// A named value for each point, or each cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Field<'a> {
    name: &'a str,
    values: Values<'a>,
}

impl<'a> Field<'a> {
    /// A field whose name and number of values were checked.
    pub(super) fn new(name: &'a str, values: Values<'a>) -> Self {
        Self { name, values }
    }

    /// The name, fit for every format.
    pub fn name(&self) -> &'a str {
        self.name
    }

    /// The values, one for each point or cell.
    pub fn values(&self) -> Values<'a> {
        self.values
    }
}

/// Checks that a field's name fits and is new among `others`, and that it has as many values as it should:
/// found and expected.
pub(super) fn check_field<'n>(
    mut others: impl Iterator<Item = &'n str>,
    name: &str,
    found: usize,
    expected: usize,
) -> Result<(), MeshDataError> {
    let plain = |c: u8| c.is_ascii_alphanumeric() || b"_-".contains(&c);
    let fits = (1..=64).contains(&name.len()) && name.bytes().all(plain);
    if !fits || RESERVED.contains(&name) || others.any(|other| other == name) {
        return Err(MeshDataError::FieldName { name: name.into() });
    }
    if found != expected {
        return Err(MeshDataError::FieldLength { name: name.into(), expected, found });
    }
    Ok(())
}

/// A named value for each point, or each cell, as read from a file.
#[derive(Clone, Debug, PartialEq)]
pub struct OwnedField<T = f32> {
    /// The name in the file.
    pub name: String,
    /// One value for each point or cell.
    pub values: Vec<T>,
}
