//! What files say of cells, before the cells are made again; and what can be wrong with them.

use std::collections::BTreeMap;
use std::io;
use std::path::Path;

use atomesh::geometry::Point;
use atomesh::mesh::PolyFault;
use atomesh::voronoi::VoronoiError;
use atomesh::watch::Cancelled;

use super::super::field::OwnedField;
use super::super::metadata::Metadata;
use super::super::read_error::MeshReadError;
use super::topology::CellFaces;

/// Why Voronoi cells were not read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CellReadError {
    /// The system did not give the bytes.
    #[error("{file} could not be read: {error}")]
    Io {
        /// The file.
        file: String,
        /// What the system said.
        error: io::Error,
    },
    /// The name says no format.
    #[error("the ending says no format; expected .vtu or .json (a list of connections)")]
    Format,
    /// The bytes are not what the format says.
    #[error(transparent)]
    Mesh(#[from] MeshReadError),
    /// A list of connections that is none.
    #[error("{place}: expected {expected}, found {found}")]
    Malformed {
        /// The file, and the line where there is one.
        place: String,
        /// What is expected.
        expected: String,
        /// What is there.
        found: String,
    },
    /// There is something else than Voronoi cells.
    #[error(
        "{found} where Voronoi cells are expected, as `atomesh mesh --mesh voronoi` writes them"
    )]
    NotVoronoi {
        /// What there is.
        found: String,
    },
    /// The sites do not make cells.
    #[error(transparent)]
    Voronoi(VoronoiError),
    /// A cell is not that of its site.
    #[error("cell {cell} has the volume {found}; the cell of its site has {expected}")]
    OtherCell {
        /// The cell.
        cell: usize,
        /// The file's volume.
        found: f64,
        /// That of the Voronoi cell.
        expected: f64,
    },
    /// The cells of a file do not make a mesh.
    #[error(transparent)]
    Fault(#[from] PolyFault),
    /// A face that two other cells have, or that its own cell has twice.
    #[error("cell {cell} has a face that two cells before it have, or has it twice")]
    Crowded {
        /// The cell.
        cell: usize,
    },
    /// A cell ends where there is no other.
    #[error(
        "cell {cell} has a face that is neither another cell's nor on a side of the image's box"
    )]
    Border {
        /// The cell.
        cell: usize,
    },
    /// The watch ended the work.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

impl From<VoronoiError> for CellReadError {
    fn from(error: VoronoiError) -> Self {
        match error {
            VoronoiError::Cancelled(cancelled) => Self::Cancelled(cancelled),
            other => Self::Voronoi(other),
        }
    }
}

/// What a file says of cells.
#[derive(Debug, Default)]
pub(super) struct RawCells {
    pub dimension: usize,
    /// Padded by 0 in the plane.
    pub sites: Vec<Point<3>>,
    pub volumes: Vec<f64>,
    /// The points, padded like sites, and the cells' faces, where the file has them.
    pub faces: Option<(Vec<Point<3>>, CellFaces)>,
    pub fields: Vec<OwnedField<f64>>,
    /// The names of fields of cells that are no scalars.
    pub skipped_fields: Vec<String>,
    /// The feature of each face between two cells that lies on one, from 1 on.
    pub features: BTreeMap<(u32, u32), u32>,
    pub metadata: Metadata,
}

pub(super) fn read_bytes(path: &Path) -> Result<Vec<u8>, CellReadError> {
    std::fs::read(path)
        .map_err(|error| CellReadError::Io { file: path.display().to_string(), error })
}
