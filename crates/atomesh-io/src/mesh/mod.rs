//! Mesh files, written and read: VTU, VTK legacy, Gmsh MSH 4.1 and 2.2, NPZ.
//!
//! Every format holds the points in world coordinates as f64, the cells in the mesh's order, the
//! fields at the points, and, as JSON, the image's frame and the mesh's [`Provenance`]. The same
//! [`MeshData`] makes the same bytes, at any number of threads.

mod column;
mod data;
mod metadata;
pub mod msh;
pub mod npz;
pub mod polymesh;
mod read;
pub mod vtk;
pub mod vtu;

use std::io;
use std::path::{Path, PathBuf};

use atomesh::watch::{Cancelled, Watch};

pub use data::{AnyMesh, Field, LoadedMesh, MeshData, MeshDataError, OwnedField, Provenance};
pub use read::MeshReadError;

use crate::atomic_file::AtomicFile;
use msh::{MshEncoding, MshVersion};

/// The formats of mesh files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum MeshFormat {
    /// VTK's XML unstructured grid: binary, compressed.
    Vtu,
    /// VTK's legacy format: binary, not compressed.
    Vtk,
    /// Gmsh's format.
    Msh(MshVersion, MshEncoding),
    /// NumPy's archive of arrays.
    Npz,
}

impl MeshFormat {
    /// The extensions that [`of`](Self::of) knows, for messages.
    pub const EXTENSIONS: &'static str = ".vtu, .vtk, .msh (Gmsh 4.1), .msh2 (Gmsh 2.2), .npz";

    /// The format that a file's name calls for by its extension, in any case.
    ///
    /// # Errors
    /// [`UnknownMeshFormat`] if the extension is missing or not one of [`EXTENSIONS`](Self::EXTENSIONS).
    pub fn of(path: &Path) -> Result<Self, UnknownMeshFormat> {
        let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
        match extension.to_str() {
            Some("vtu") => Ok(Self::Vtu),
            Some("vtk") => Ok(Self::Vtk),
            Some("msh") => Ok(Self::Msh(MshVersion::V41, MshEncoding::Binary)),
            Some("msh2") => Ok(Self::Msh(MshVersion::V22, MshEncoding::Binary)),
            Some("npz") => Ok(Self::Npz),
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
    /// The watch ended the work.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Writes a mesh in the format that the name calls for ([`MeshFormat::of`]). The file appears whole or
/// not at all.
///
/// # Errors
/// [`MeshWriteError`] if the format is unknown or cannot hold the mesh, the file cannot be written, or
/// the watch ends the work.
pub fn write_mesh<const D: usize>(
    path: &Path,
    data: &MeshData<D>,
    watch: &mut dyn Watch,
) -> Result<(), MeshWriteError> {
    write_mesh_as(path, MeshFormat::of(path)?, data, watch)
}

/// Writes a mesh in the given format, whatever the name is. The file appears whole or not at all.
///
/// # Errors
/// As [`write_mesh`].
pub fn write_mesh_as<const D: usize>(
    path: &Path,
    format: MeshFormat,
    data: &MeshData<D>,
    watch: &mut dyn Watch,
) -> Result<(), MeshWriteError> {
    let mut file = AtomicFile::create(path)?;
    match format {
        MeshFormat::Vtu => vtu::write_vtu(&mut file, data, watch)?,
        MeshFormat::Vtk => vtk::write_vtk(&mut file, data, watch)?,
        MeshFormat::Msh(version, encoding) => {
            msh::write_msh(&mut file, data, (version, encoding), watch)?;
        }
        MeshFormat::Npz => npz::write_npz(&mut file, data, watch)?,
    }
    Ok(file.commit()?)
}

/// Reads a mesh in the format that the name calls for ([`MeshFormat::of`]; `.msh2` is read as `.msh`,
/// whose version stands in the file). A file with tetrahedra is a volume, its triangles are left out; a
/// file with triangles alone must lie in a plane of constant z.
///
/// # Errors
/// [`MeshReadError`] if the format is unknown, the file cannot be read, or is not what its name says.
pub fn read_mesh(path: &Path) -> Result<AnyMesh, MeshReadError> {
    let format = MeshFormat::of(path)?;
    let bytes = std::fs::read(path)?;
    match format {
        MeshFormat::Vtu => vtu::read_vtu(&bytes),
        MeshFormat::Vtk => vtk::read_vtk(&bytes),
        MeshFormat::Msh(..) => msh::read_msh(&bytes),
        MeshFormat::Npz => npz::read_npz(&bytes),
    }
}
