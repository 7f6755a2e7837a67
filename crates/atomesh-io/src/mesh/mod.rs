//! Mesh files, written and read: VTU, VTK legacy, Gmsh MSH 4.1 and 2.2, NPZ, Abaqus INP, OpenFOAM polyMesh.
//!
//! Every format holds the points in world coordinates as f64 and the cells in the mesh's order; fields at
//! points and in cells (but for INP and polyMesh); and, as JSON, the image's frame and the mesh's
//! [`Provenance`]. All but VTK legacy and NPZ hold tags. The same [`MeshData`] makes the same bytes at any
//! number of threads. `table` lists the formats.

mod behind;
mod cell_fields;
pub mod cells;
pub(crate) mod column;
mod data;
mod error;
mod field;
mod fluxes;
mod format;
pub mod inp;
mod loaded;
mod metadata;
pub mod msh;
pub mod npz;
pub mod openfoam;
mod parts;
mod provenance;
pub(crate) mod read_error;
pub(crate) mod standing;
mod streamlines;
mod table;
mod tags;
pub mod vtk;
pub mod vtu;

use std::path::Path;

use atomesh::watch::Watch;

pub use cell_fields::{CellFields, VectorField};
pub use data::MeshData;
pub use error::MeshWriteError;
pub use field::{Field, MeshDataError, OwnedField, Values};
pub use fluxes::{FacetFlux, FluxFiles, FluxTable, write_fluxes};
pub use format::{MeshFormat, UnknownMeshFormat};
pub use inp::{Elastic, SectionKind, Sections};
pub use loaded::{AnyMesh, LoadedMesh};
pub use provenance::{Provenance, World};
pub use read_error::MeshReadError;
pub use standing::Standing;
pub use streamlines::{Streamlines, TracedLine, write_streamlines};

use table::Row;

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
    (Row::<D>::of(format).write)(path, format, data, watch)
}

/// Reads a mesh in the format that the name calls for ([`MeshFormat::of`]; `.msh2` is read as `.msh`,
/// whose version stands in the file). A file with tetrahedra is a volume, its triangles are left out; a
/// file with triangles alone must lie in a plane of constant z. Folders of OpenFOAM are not read here: see
/// [`openfoam::read_foam_mesh`].
///
/// # Errors
/// [`MeshReadError`] if the format is unknown, the file cannot be read, or is not what its name says.
pub fn read_mesh(path: &Path) -> Result<AnyMesh, MeshReadError> {
    let format = MeshFormat::of(path)?;
    if format == MeshFormat::OpenFoam {
        return (Row::<2>::of(format).read)(&[]);
    }
    (Row::<2>::of(format).read)(&std::fs::read(path)?)
}
