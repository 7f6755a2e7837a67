//! Why a mesh was not read.

use std::io;

use atomesh::mesh::{MeshError, TagsError};

use super::format::UnknownMeshFormat;

/// Why a mesh was not read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MeshReadError {
    /// The name calls for no known format.
    #[error(transparent)]
    Format(#[from] UnknownMeshFormat),
    /// The system did not give the bytes.
    #[error("the mesh could not be read: {0}")]
    Io(#[from] io::Error),
    /// The bytes are not what the format says.
    #[error("byte {at}: expected {expected}, found {found}")]
    Malformed {
        /// Where, counted from the start of the file.
        at: usize,
        /// What the format says.
        expected: String,
        /// What is there.
        found: String,
    },
    /// The file is of a kind that is not read.
    #[error("{what} {found:?} is not supported; expected {expected}")]
    Unsupported {
        /// What is of that kind.
        what: &'static str,
        /// The kind.
        found: String,
        /// The kinds that are read.
        expected: &'static str,
    },
    /// There are neither triangles nor tetrahedra.
    #[error("there are no triangles or tetrahedra among {skipped} cells of other types")]
    NoCells {
        /// The number of cells of other types.
        skipped: usize,
    },
    /// A mesh of triangles alone that is no plane of constant z.
    #[error("the triangles have z from {min} to {max}; expected one z, or tetrahedra")]
    NotFlat {
        /// The least z.
        min: f64,
        /// The greatest z.
        max: f64,
    },
    /// The cells or points are not valid.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// The groups of facets or cells are not valid.
    #[error(transparent)]
    Tags(#[from] TagsError),
}

/// An error at a place in the file.
pub(crate) fn malformed(
    at: usize,
    expected: impl Into<String>,
    found: impl Into<String>,
) -> MeshReadError {
    MeshReadError::Malformed { at, expected: expected.into(), found: found.into() }
}

/// At most 24 bytes of what is at a place, for messages.
pub(super) fn excerpt(bytes: &[u8], at: usize) -> String {
    let rest = bytes.get(at..).unwrap_or_default();
    if rest.is_empty() {
        return "the end".into();
    }
    format!("\"{}\"", rest[..rest.len().min(24)].escape_ascii())
}
