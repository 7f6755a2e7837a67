//! Why a mesh was not written.

use std::io;

use atomesh::watch::Cancelled;

use super::field::MeshDataError;
use super::format::UnknownMeshFormat;

/// Why a mesh was not written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MeshWriteError {
    /// The name calls for no known format.
    #[error(transparent)]
    Format(#[from] UnknownMeshFormat),
    /// The system did not take the bytes.
    #[error("the mesh could not be written: {0}")]
    Io(#[from] io::Error),
    /// There are more points or cells than the format can count.
    #[error("{format} cannot hold {count} points or cells, only {limit}")]
    TooMany {
        /// The format.
        format: &'static str,
        /// How many there are.
        count: usize,
        /// How many there may be.
        limit: usize,
    },
    /// A field does not fit.
    #[error(transparent)]
    Field(#[from] MeshDataError),
    /// The cells make no sense as faces.
    #[error(transparent)]
    FoamMesh(#[from] FoamMeshError),
    /// The watch ended the work.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// What is wrong with the parts of a `FoamMesh`.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FoamMeshError {
    /// A face has fewer than three corners.
    #[error("face {face} has {found} corners; expected 3 or more")]
    FewCorners {
        /// The face's index.
        face: usize,
        /// Its corners.
        found: usize,
    },
    /// A number names nothing.
    #[error("{of} names {what} {found}; there are {count}")]
    Missing {
        /// What has the number.
        of: String,
        /// What it should name.
        what: &'static str,
        /// The number.
        found: u32,
        /// How many there are to name.
        count: usize,
    },
    /// A face has the same cell on both sides.
    #[error("face {face} has cell {cell} on both sides")]
    OneCell {
        /// The face's index.
        face: usize,
        /// The cell.
        cell: u32,
    },
    /// The faces around a cell leave a hole, or overlap.
    #[error(
        "cell {cell} is not closed at the edge of points {edge:?}; expected two faces there, turned against each other"
    )]
    Open {
        /// The cell.
        cell: u32,
        /// The points at the ends of the edge.
        edge: [u32; 2],
    },
    /// A cell has no faces.
    #[error("cell {cell} has no faces")]
    NoFaces {
        /// The cell.
        cell: u32,
    },
}
