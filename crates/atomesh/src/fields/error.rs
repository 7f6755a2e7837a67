//! What is wrong with a field.

/// What is wrong with a field.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FieldError {
    /// There are not as many samples as the grid says.
    #[error("{found} samples for a grid that holds {expected}")]
    SampleCount {
        /// The product of the grid's shape.
        expected: usize,
        /// The number of samples given.
        found: usize,
    },
    /// A sample is NaN or infinite.
    #[error("sample {index} is {value}; expected a finite number")]
    NotFinite {
        /// The sample's index, x fastest.
        index: usize,
        /// Its value.
        value: f32,
    },
    /// A sample of a potential is outside −1…1, or NaN.
    #[error("sample {index} is {value}; a potential lies in [-1, 1]")]
    Potential {
        /// The sample's index, x fastest.
        index: usize,
        /// Its value.
        value: f32,
    },
    /// An image weight is outside 0…1, or NaN.
    #[error("image weight {value}{}; expected 0 to 1", .index.map_or(String::new(), |i| format!(" at sample {i}")))]
    Weight {
        /// The sample's index in a field of weights.
        index: Option<usize>,
        /// The weight.
        value: f64,
    },
    /// Fields that belong together lie over different boxes.
    #[error(
        "the {field} lies over a box up to {found:?}, the potential over one up to {expected:?}"
    )]
    Domain {
        /// The field: "weight" or "nominal distance".
        field: &'static str,
        /// The greatest corner of its box, in lattice units.
        found: Vec<f64>,
        /// That of the potential's.
        expected: Vec<f64>,
    },
}
