//! What can go wrong with a picture.

use std::path::PathBuf;

/// Why there is no picture.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DrawError {
    /// A file's name does not say which kind of picture it is.
    #[error("{path:?} is not the name of a picture; expected .png or .svg")]
    Format {
        /// The name.
        path: PathBuf,
    },
    /// A slice lies outside the image.
    #[error("slice {at} along axis {axis} of an image with {count} samples")]
    Slice {
        /// 0 for x, 1 for y, 2 for z.
        axis: usize,
        /// The sample asked for.
        at: usize,
        /// The samples along the axis.
        count: usize,
    },
    /// The number of values is not that of the cells or points that they belong to.
    #[error("{found} {what}; expected none or {expected}")]
    Count {
        /// The values, as "velocities".
        what: &'static str,
        /// How many there are.
        found: usize,
        /// How many there should be.
        expected: usize,
    },
    /// A barrier is not a facet of the mesh.
    #[error("barrier {facet}; the mesh has {count} facets")]
    Facet {
        /// Its number.
        facet: u32,
        /// How many facets there are.
        count: usize,
    },
    /// A surface has a corner that is not a point of the mesh.
    #[error("a surface with point {point}; the mesh has {count} points")]
    Point {
        /// Its number.
        point: u32,
        /// How many points there are.
        count: usize,
    },
    /// A number of a style is out of range.
    #[error("{name} is {value}; expected a finite number above 0{}", limit.map_or(String::new(), |l| format!(" and up to {l}")))]
    Style {
        /// The field of [`Style`](crate::Style) or [`FlowStyle`](crate::FlowStyle).
        name: &'static str,
        /// Its value.
        value: f64,
        /// The greatest value allowed, if there is one.
        limit: Option<f64>,
    },
    /// The picture could not be encoded.
    #[error("the picture could not be encoded as PNG: {reason}")]
    Png {
        /// What the encoder said.
        reason: String,
    },
}
