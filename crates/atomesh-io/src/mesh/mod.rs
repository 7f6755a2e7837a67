//! Mesh files, written and read: VTU, VTK legacy, Gmsh MSH 4.1 and 2.2, NPZ.
//!
//! Every format holds the points in world coordinates as f64, the cells in the mesh's order, the
//! fields at the points, and, as JSON, the image's frame and the mesh's [`Provenance`]. The same
//! [`MeshData`] makes the same bytes, at any number of threads.

mod column;
mod data;
mod metadata;
pub mod vtu;

use std::io;
use std::path::{Path, PathBuf};

use atomesh::watch::{Cancelled, Watch};

pub use data::{AnyMesh, Field, LoadedMesh, MeshData, MeshDataError, OwnedField, Provenance};

use crate::atomic_file::AtomicFile;

/// The formats of mesh files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum MeshFormat {
    /// VTK's XML unstructured grid: binary, compressed.
    Vtu,
}

impl MeshFormat {
    /// The extensions that [`of`](Self::of) knows, for messages.
    pub const EXTENSIONS: &'static str = ".vtu";

    /// The format that a file's name calls for by its extension, in any case.
    ///
    /// # Errors
    /// [`UnknownMeshFormat`] if the extension is missing or not one of [`EXTENSIONS`](Self::EXTENSIONS).
    pub fn of(path: &Path) -> Result<Self, UnknownMeshFormat> {
        let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
        match extension.to_str() {
            Some("vtu") => Ok(Self::Vtu),
            _ => Err(UnknownMeshFormat { path: path.into() }),
        }
    }
}

/// A file's name does not say which mesh format it has.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{path:?} is no mesh file by its name; expected one of {}", MeshFormat::EXTENSIONS)]
pub struct UnknownMeshFormat {
    /// The name.
    pub path: PathBuf,
}

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
    /// The watch ended the work.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Writes a mesh in the format that the name calls for ([`MeshFormat::of`]). The file appears whole or
/// not at all.
///
/// # Errors
/// [`MeshWriteError`] if the format is unknown, the file cannot be written, or the watch ends the work.
pub fn write_mesh<const D: usize>(
    path: &Path,
    data: &MeshData<D>,
    watch: &mut dyn Watch,
) -> Result<(), MeshWriteError> {
    let format = MeshFormat::of(path)?;
    let mut file = AtomicFile::create(path)?;
    match format {
        MeshFormat::Vtu => vtu::write_vtu(&mut file, data, watch)?,
    }
    Ok(file.commit()?)
}
