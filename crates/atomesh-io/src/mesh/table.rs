//! The table of mesh formats: what their files are called, what they hold, what reads and writes them.

use std::io;
use std::path::Path;

use atomesh::watch::Watch;

use super::data::MeshData;
use super::error::MeshWriteError;
use super::format::{MeshFormat, MshEncoding, MshVersion, UnknownMeshFormat};
use super::loaded::AnyMesh;
use super::read_error::MeshReadError;
use super::{inp, msh, npz, openfoam, vtk, vtu};
use crate::atomic_file::AtomicFile;

/// A row of the table; of the writers those for meshes of D dimensions.
pub(super) struct Row<const D: usize> {
    /// What a name of this kind calls for.
    pub format: MeshFormat,
    /// The extension of the name, or for a folder the whole name.
    name: &'static str,
    /// Whose format it is, where the extension does not say it.
    note: &'static str,
    is_folder: bool,
    holds_tags: bool,
    holds_values: bool,
    holds_quadratic: bool,
    pub write: Writer<D>,
    pub read: Reader,
}

/// Writes a mesh to a place. The file appears whole or not at all.
type Writer<const D: usize> =
    fn(&Path, MeshFormat, &MeshData<'_, D>, &mut dyn Watch) -> Result<(), MeshWriteError>;

/// Reads a mesh from the bytes of a file.
type Reader = fn(&[u8]) -> Result<AnyMesh, MeshReadError>;

/// Gives a new file to `write`, and its name to the file once it is whole.
fn whole(
    path: &Path,
    write: impl FnOnce(&mut AtomicFile) -> Result<(), MeshWriteError>,
) -> Result<(), MeshWriteError> {
    let mut file = AtomicFile::create(path)?;
    write(&mut file)?;
    Ok(file.commit()?)
}

impl<const D: usize> Row<D> {
    /// All rows, in the order in which messages name them.
    pub const ALL: [Self; 7] = [
        Self {
            format: MeshFormat::Vtu,
            name: "vtu",
            note: "",
            is_folder: false,
            holds_tags: true,
            holds_values: true,
            holds_quadratic: true,
            write: |path, _, data, watch| whole(path, |file| vtu::write_vtu(file, data, watch)),
            read: vtu::read_vtu,
        },
        Self {
            format: MeshFormat::Vtk,
            name: "vtk",
            note: "",
            is_folder: false,
            holds_tags: false,
            holds_values: true,
            holds_quadratic: true,
            write: |path, _, data, watch| whole(path, |file| vtk::write_vtk(file, data, watch)),
            read: vtk::read_vtk,
        },
        Self::msh("msh", "Gmsh 4.1", MshVersion::V41),
        Self::msh("msh2", "Gmsh 2.2", MshVersion::V22),
        Self {
            format: MeshFormat::Npz,
            name: "npz",
            note: "",
            is_folder: false,
            holds_tags: false,
            holds_values: true,
            holds_quadratic: false,
            write: |path, _, data, watch| whole(path, |file| npz::write_npz(file, data, watch)),
            read: npz::read_npz,
        },
        Self {
            format: MeshFormat::Inp,
            name: "inp",
            note: "Abaqus",
            is_folder: false,
            holds_tags: true,
            holds_values: false,
            holds_quadratic: true,
            write: |path, _, data, watch| whole(path, |file| inp::write_inp(file, data, watch)),
            read: inp::read_inp,
        },
        Self {
            format: MeshFormat::OpenFoam,
            name: "polyMesh",
            note: "OpenFOAM's folder",
            is_folder: true,
            holds_tags: true,
            holds_values: false,
            holds_quadratic: false,
            write: |path, _, data, watch| {
                openfoam::write_foam_mesh(path, &openfoam::FoamMesh::of_mesh(data)?, watch)
            },
            read: |_| Err(not_read_here()),
        },
    ];

    /// A row of Gmsh's format; its version stands in the file, so that one reader reads all.
    const fn msh(name: &'static str, note: &'static str, version: MshVersion) -> Self {
        Self {
            format: MeshFormat::Msh(version, MshEncoding::Binary),
            name,
            note,
            is_folder: false,
            holds_tags: true,
            holds_values: true,
            holds_quadratic: true,
            write: |path, format, data, watch| {
                let (version, encoding) = match format {
                    MeshFormat::Msh(version, encoding) => (version, encoding),
                    _ => (MshVersion::V41, MshEncoding::Binary),
                };
                whole(path, |file| msh::write_msh(file, data, version, encoding, watch))
            },
            read: msh::read_msh,
        }
    }

    /// The first row of a format; Gmsh's are alike in all but the version.
    pub fn of(format: MeshFormat) -> Self {
        let same =
            |row: &Self| std::mem::discriminant(&row.format) == std::mem::discriminant(&format);
        let [first, others @ ..] = Self::ALL;
        others.into_iter().find(same).unwrap_or(first)
    }

    /// How messages name the format.
    fn text(&self) -> String {
        let Self { name, note, is_folder, .. } = self;
        let dot = if *is_folder { "" } else { "." };
        if note.is_empty() { format!("{dot}{name}") } else { format!("{dot}{name} ({note})") }
    }
}

fn not_read_here() -> MeshReadError {
    MeshReadError::Unsupported {
        what: "mesh format to read",
        found: "polyMesh".into(),
        expected: "one of the others that are written",
    }
}

/// The rows, for what is the same in the plane and in space.
fn rows() -> [Row<2>; 7] {
    Row::<2>::ALL
}

/// The extensions of some of the formats, for messages.
fn endings_where(is_meant: impl Fn(&Row<2>) -> bool) -> String {
    let rows = rows().into_iter().filter(is_meant);
    let plain = rows.map(|row| Row { note: "", ..row }.text());
    plain.collect::<Vec<_>>().join(", ")
}

impl MeshFormat {
    /// The format that a file's name calls for by its extension, in any case; `polyMesh` is a folder's name.
    ///
    /// # Errors
    /// [`UnknownMeshFormat`] if the extension is missing or not one of [`endings`](Self::endings).
    pub fn of(path: &Path) -> Result<Self, UnknownMeshFormat> {
        let name = path.file_name().unwrap_or_default();
        let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
        let is_named = |row: &Row<2>| match row.is_folder {
            true => name == row.name,
            false => extension == row.name,
        };
        let found = rows().into_iter().find(is_named).map(|row| row.format);
        found.ok_or_else(|| UnknownMeshFormat { path: path.into(), known: Self::endings() })
    }

    /// Whether a file is a mesh by its name, and, where images have the same extension, by what is in it.
    pub fn is_mesh(path: &Path) -> bool {
        Self::of(path).is_ok() && !crate::image::is_image_named_as_mesh(path)
    }

    /// The extensions that [`of`](Self::of) knows, for messages: `.vtu, .vtk, .msh (Gmsh 4.1), …`.
    pub fn endings() -> String {
        rows().iter().map(Row::text).collect::<Vec<_>>().join(", ")
    }

    /// The extensions of formats that hold groups of facets and regions, for messages: `.vtu, .msh, …`.
    pub fn tag_endings() -> String {
        endings_where(|row| row.holds_tags)
    }

    /// The extensions of formats that hold values at points and in cells, for messages: `.vtu, .vtk, …`.
    pub fn value_endings() -> String {
        endings_where(|row| row.holds_values)
    }

    /// The extensions of files that are read, for help texts: `.vtu .vtk …`.
    pub fn read_endings() -> String {
        let rows = rows().into_iter().filter(|row| !row.is_folder);
        let plain = rows.map(|row| Row { note: "", ..row }.text());
        plain.collect::<Vec<_>>().join(" ")
    }

    /// Tries whether a mesh of this format could be written there, and leaves nothing behind.
    ///
    /// # Errors
    /// If the folder does not exist, or may not be written to.
    pub fn check_writable(self, path: &Path) -> io::Result<()> {
        match self {
            Self::OpenFoam => openfoam::check_foam_mesh_writable(path),
            _ => AtomicFile::create(path).map(drop),
        }
    }

    /// Whether the format holds cells of second order.
    pub fn holds_quadratic(self) -> bool {
        Row::<2>::of(self).holds_quadratic
    }

    /// Whether the format holds values at points and in cells.
    pub fn holds_values(self) -> bool {
        Row::<2>::of(self).holds_values
    }

    /// Whether the format holds groups of facets and regions.
    pub fn holds_tags(self) -> bool {
        Row::<2>::of(self).holds_tags
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_name_every_format() {
        let all = ".vtu, .vtk, .msh (Gmsh 4.1), .msh2 (Gmsh 2.2), .npz, .inp (Abaqus), \
                   polyMesh (OpenFOAM's folder)";
        assert_eq!(MeshFormat::endings(), all);
        assert_eq!(MeshFormat::tag_endings(), ".vtu, .msh, .msh2, .inp, polyMesh");
        assert_eq!(MeshFormat::value_endings(), ".vtu, .vtk, .msh, .msh2, .npz");
        assert_eq!(MeshFormat::read_endings(), ".vtu .vtk .msh .msh2 .npz .inp");
    }

    #[test]
    fn names_call_for_their_formats() {
        for row in rows() {
            let name = if row.is_folder { row.name.into() } else { format!("a.{}", row.name) };
            assert_eq!(MeshFormat::of(Path::new(&name)), Ok(row.format));
            let own = Row::<2>::of(row.format);
            assert_eq!(
                (own.holds_tags, own.holds_values, own.holds_quadratic),
                (row.holds_tags, row.holds_values, row.holds_quadratic)
            );
        }
        let text = MeshFormat::Msh(MshVersion::V22, MshEncoding::Text);
        assert!(text.holds_tags() && text.holds_quadratic());
        assert!(MeshFormat::of(Path::new("polymesh")).is_err());
    }
}
