//! Mesh files, written and read: VTU, VTK legacy, Gmsh MSH 4.1 and 2.2, NPZ, Abaqus INP, OpenFOAM polyMesh.
//!
//! Every format holds the points in world coordinates as f64, the cells in the mesh's order, the
//! fields at the points and in the cells (not INP and polyMesh), and, as JSON, the image's frame and the mesh's
//! [`Provenance`]; all but VTK legacy and NPZ hold its tags. The same
//! [`MeshData`] makes the same bytes, at any number of threads.

mod cell_fields;
pub mod cells;
pub(crate) mod column;
mod data;
mod fluxes;
pub mod inp;
mod metadata;
pub mod msh;
pub mod npz;
pub mod polymesh;
mod read;
mod streamlines;
mod tags;
pub mod vtk;
pub mod vtu;

use std::io;
use std::path::{Path, PathBuf};

use atomesh::watch::{Cancelled, Watch};

pub use cell_fields::{CellFields, VectorField};
pub use data::{
    AnyMesh, Field, LoadedMesh, MeshData, MeshDataError, OwnedField, Provenance, Values,
};
pub use fluxes::{FacetFlux, FluxFiles, FluxTable, write_fluxes};
pub use read::MeshReadError;
pub use streamlines::{Streamline, Streamlines, write_streamlines};

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
    /// Abaqus' input file.
    Inp,
    /// OpenFOAM's folder of files.
    PolyMesh,
}

impl MeshFormat {
    /// The extensions that [`of`](Self::of) knows, for messages.
    pub const EXTENSIONS: &'static str = ".vtu, .vtk, .msh (Gmsh 4.1), .msh2 (Gmsh 2.2), .npz, .inp (Abaqus), polyMesh (OpenFOAM's folder)";

    /// The format that a file's name calls for by its extension, in any case; `polyMesh` is a folder's name.
    ///
    /// # Errors
    /// [`UnknownMeshFormat`] if the extension is missing or not one of [`EXTENSIONS`](Self::EXTENSIONS).
    pub fn of(path: &Path) -> Result<Self, UnknownMeshFormat> {
        if path.file_name().is_some_and(|name| name == "polyMesh") {
            return Ok(Self::PolyMesh);
        }
        let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
        match extension.to_str() {
            Some("vtu") => Ok(Self::Vtu),
            Some("vtk") => Ok(Self::Vtk),
            Some("msh") => Ok(Self::Msh(MshVersion::V41, MshEncoding::Binary)),
            Some("msh2") => Ok(Self::Msh(MshVersion::V22, MshEncoding::Binary)),
            Some("npz") => Ok(Self::Npz),
            Some("inp") => Ok(Self::Inp),
            _ => Err(UnknownMeshFormat { path: path.into() }),
        }
    }
}

impl MeshFormat {
    /// Tries whether a mesh of this format could be written there, and leaves nothing behind.
    ///
    /// # Errors
    /// If the folder does not exist, or may not be written to.
    pub fn check_writable(self, path: &Path) -> io::Result<()> {
        match self {
            Self::PolyMesh => polymesh::check_poly_mesh_writable(path),
            _ => AtomicFile::create(path).map(drop),
        }
    }

    /// Whether the format holds cells of second order.
    pub fn holds_quadratic(self) -> bool {
        !matches!(self, Self::Npz | Self::PolyMesh)
    }

    /// Whether the format holds groups of facets and regions.
    pub fn holds_tags(self) -> bool {
        !matches!(self, Self::Vtk | Self::Npz)
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
    /// A field does not fit.
    #[error(transparent)]
    Field(#[from] MeshDataError),
    /// The cells make no sense as faces.
    #[error(transparent)]
    PolyMesh(#[from] polymesh::PolyMeshError),
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
    if format == MeshFormat::PolyMesh {
        return polymesh::write_poly_mesh(path, &polymesh::PolyMesh::of_mesh(data)?, watch);
    }
    let mut file = AtomicFile::create(path)?;
    match format {
        MeshFormat::Vtu => vtu::write_vtu(&mut file, data, watch)?,
        MeshFormat::Vtk => vtk::write_vtk(&mut file, data, watch)?,
        MeshFormat::Msh(version, encoding) => {
            msh::write_msh(&mut file, data, (version, encoding), watch)?;
        }
        MeshFormat::Npz => npz::write_npz(&mut file, data, watch)?,
        MeshFormat::Inp => inp::write_inp(&mut file, data, watch)?,
        MeshFormat::PolyMesh => {} // a folder, written above
    }
    Ok(file.commit()?)
}

/// Reads a mesh in the format that the name calls for ([`MeshFormat::of`]; `.msh2` is read as `.msh`,
/// whose version stands in the file). A file with tetrahedra is a volume, its triangles are left out; a
/// file with triangles alone must lie in a plane of constant z. Folders of OpenFOAM are not read here: see
/// [`polymesh::read_poly_mesh`].
///
/// # Errors
/// [`MeshReadError`] if the format is unknown, the file cannot be read, or is not what its name says.
pub fn read_mesh(path: &Path) -> Result<AnyMesh, MeshReadError> {
    let format = MeshFormat::of(path)?;
    if format == MeshFormat::PolyMesh {
        let (found, expected) = ("polyMesh".into(), "one of the others that are written");
        return Err(MeshReadError::Unsupported { what: "mesh format to read", found, expected });
    }
    let bytes = std::fs::read(path)?;
    match format {
        MeshFormat::Vtu => vtu::read_vtu(&bytes),
        MeshFormat::Vtk => vtk::read_vtk(&bytes),
        MeshFormat::Msh(..) => msh::read_msh(&bytes),
        MeshFormat::Npz => npz::read_npz(&bytes),
        MeshFormat::Inp => inp::read_inp(&bytes),
        MeshFormat::PolyMesh => Err(MeshReadError::NoCells { skipped: 0 }), // a folder, read above
    }
}
