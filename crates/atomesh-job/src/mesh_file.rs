//! Reading meshes.

use std::path::Path;

use atomesh::geometry::Bounds;
use atomesh::image::{Frame, Units};
use atomesh::mesh::{Mesh, Tags};
use atomesh::run::Tools;
use atomesh::watch::Watch;
use atomesh_io::mesh::cells::{AnyCells, CellReadError, LoadedCells, read_cells};
use atomesh_io::mesh::{AnyMesh, LoadedMesh, MeshFormat, MeshReadError, Provenance, read_mesh};

use crate::error::JobError;
use crate::files::has_extension;
use crate::memory;
use crate::session::{Note, NoteKind, Session};

/// What a mesh file holds.
#[derive(Clone, Debug)]
pub enum MeshFile {
    /// Triangles.
    Flat(LoadedMesh<2>),
    /// Tetrahedra.
    Volume(LoadedMesh<3>),
    /// Voronoi cells of the plane.
    Polygons(LoadedCells<2>),
    /// Voronoi cells of space.
    Polyhedra(LoadedCells<3>),
}

/// Reads a mesh of triangles or tetrahedra, or Voronoi cells that atomesh wrote (.vtu, or the head of a list of
/// connections, .json), unless the file alone is larger than the memory available.
///
/// # Errors
/// [`JobError`] if the file cannot be read or is not what its name says, or the watch ends the work.
pub fn read(path: &Path, watch: &mut dyn Watch) -> Result<MeshFile, JobError> {
    memory::check_file(path)?;
    if is_list(path) {
        return cells(path, watch).map_err(|e| cells_refusal(e, path));
    }
    match read_mesh(path) {
        Ok(AnyMesh::Flat(mesh)) => Ok(MeshFile::Flat(mesh)),
        Ok(AnyMesh::Volume(mesh)) => Ok(MeshFile::Volume(mesh)),
        Err(none @ MeshReadError::NoCells { .. }) if has_extension(path, "vtu") => {
            cells(path, watch).map_err(|e| match e {
                CellReadError::Mesh(e) => {
                    JobError::content(format!("{none}, and no Voronoi cells: {e}")).about(path)
                }
                other => cells_refusal(other, path),
            })
        }
        Err(e) => Err(mesh_refusal(e, path)),
    }
}

impl MeshFile {
    /// Says which fields were not read, where the mesh is to be written again without them.
    pub(crate) fn note_skipped(&self, path: &Path, session: &mut Session<'_>) {
        let skipped = match self {
            Self::Flat(mesh) => &mesh.skipped_fields,
            Self::Volume(mesh) => &mesh.skipped_fields,
            Self::Polygons(cells) => &cells.skipped_fields,
            Self::Polyhedra(cells) => &cells.skipped_fields,
        };
        if !skipped.is_empty() {
            let text =
                format!("only fields of one number are kept; {} left out", skipped.join(", "));
            session.note(Note { kind: NoteKind::Change, file: Some(path.to_owned()), text });
        }
    }
}

/// Whether a file is a list of connections of Voronoi cells by its name.
pub fn is_list(path: &Path) -> bool {
    has_extension(path, "json")
}

fn cells(path: &Path, watch: &mut dyn Watch) -> Result<MeshFile, CellReadError> {
    Ok(match read_cells(path, watch)? {
        AnyCells::Flat(cells) => MeshFile::Polygons(cells),
        AnyCells::Volume(cells) => MeshFile::Polyhedra(cells),
    })
}

fn mesh_refusal(error: MeshReadError, path: &Path) -> JobError {
    match error {
        MeshReadError::Format(_) => {
            let known = MeshFormat::endings();
            JobError::misuse(format!("unknown extension of a mesh file; expected one of {known}"))
        }
        MeshReadError::Io(e) => JobError::unreadable(&e),
        _ => JobError::content(error),
    }
    .about(path)
}

/// The refusal of a file that should hold Voronoi cells.
pub(crate) fn cells_refusal(error: CellReadError, path: &Path) -> JobError {
    match error {
        CellReadError::Cancelled(_) => JobError::cancelled(),
        CellReadError::Format => JobError::misuse(error),
        CellReadError::Io { error, .. } => JobError::unreadable(&error),
        CellReadError::Mesh(_) | CellReadError::NotVoronoi { .. } => JobError::content(error)
            .advise("`atomesh mesh IMAGE -o CELLS.vtu --mesh voronoi` makes Voronoi cells"),
        _ => JobError::content(error),
    }
    .about(path)
}

/// The lattice units in which a mesh was made.
pub(crate) fn units(provenance: Option<&Provenance>) -> Option<Units> {
    let units = provenance?.options.get("lattice")?.get("units")?;
    serde_json::from_value(units.clone()).ok()
}

/// The nominal distance that a mesh was made with, if it was one for the whole mesh.
pub(crate) fn size(provenance: &Provenance) -> Option<f64> {
    provenance.options.get("lattice")?.get("size")?.as_f64()
}

/// The sides of the image's box, or of the mesh's own where the image is not known.
pub(crate) fn own_sides<const D: usize>(
    mesh: &Mesh<D>,
    frame: Option<&Frame<D>>,
    tools: &Tools<D>,
) -> Tags<D> {
    let sides = tools.sides;
    if let Some(frame) = frame {
        let lattice = (tools.lattice_mesh)(mesh, frame, Units::Physical);
        return sides(&lattice, &frame.grid(Units::Physical).bounds(), frame.is_mirrored());
    }
    let bounds = Bounds::of(mesh.points());
    bounds.map_or_else(Tags::default, |bounds| sides(mesh, &bounds, false))
}

/// The mesh with cells of positive orientation: those that another program wrote the other way are turned.
pub fn oriented<const D: usize>(mesh: Mesh<D>) -> Mesh<D> {
    let wrong: Vec<bool> = mesh.simplices().map(|simplex| simplex.orientation() < 0.0).collect();
    if !wrong.contains(&true) {
        return mesh;
    }
    let (points, mut corners) = mesh.into_parts();
    for (cell, _) in wrong.iter().enumerate().filter(|(_, wrong)| **wrong) {
        corners.swap(cell * (D + 1) + D - 1, cell * (D + 1) + D);
    }
    Mesh::new(points, corners).expect("the same points and corners")
}
