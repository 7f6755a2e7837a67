//! The names of mesh formats.

use std::path::PathBuf;

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
    OpenFoam,
}

/// The versions of Gmsh's format.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum MshVersion {
    /// 4.1, of Gmsh 4.
    V41,
    /// 2.2, which most other programs read.
    V22,
}

/// How Gmsh's numbers are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum MshEncoding {
    /// Little-endian bytes.
    Binary,
    /// Decimal text; reals have the 17 digits that determine them.
    Text,
}

/// A file's name does not say which mesh format it has.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{path:?} is not a mesh file by its name; expected one of {known}")]
pub struct UnknownMeshFormat {
    /// The name.
    pub path: PathBuf,
    /// The endings that are known.
    pub known: String,
}
