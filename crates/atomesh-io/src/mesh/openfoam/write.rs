//! Writing a polyMesh folder, as text: any build of OpenFOAM reads it, whatever its size of labels.

use std::fs;
use std::io::{self, Write};
use std::path::Path;

use atomesh::watch::{Phase, Watch, check};

use super::super::error::MeshWriteError;
use super::{Beyond, FILES, FoamMesh, Patch};
use crate::atomic_file::AtomicFile;

/// Bytes gathered before they are handed on.
const CHUNK: usize = 1 << 18;

/// Lines between two looks at the watch.
const LINES_PER_STEP: usize = 1 << 18;

/// Writes a mesh into a folder, which is made if its parent exists. Files of other names in it are left
/// alone. All files appear only when all are written.
///
/// # Errors
/// If there are more faces than OpenFOAM's 32-bit labels can name, the folder or a file cannot be written,
/// or the watch ends the work.
pub fn write_foam_mesh(
    folder: &Path,
    mesh: &FoamMesh,
    watch: &mut dyn Watch,
) -> Result<(), MeshWriteError> {
    let count = mesh.points().len().max(mesh.face_count()).max(mesh.corners.len());
    if i32::try_from(count).is_err() {
        let limit = i32::MAX as usize;
        return Err(MeshWriteError::TooMany { format: "polyMesh", count, limit });
    }
    let is_new = !folder.is_dir();
    if is_new {
        fs::create_dir(folder)?;
    }
    let written = write_files(folder, &mesh.ordered(), watch);
    if written.is_err() && is_new {
        let _ = fs::remove_dir(folder); // it is empty; the first error is the one to tell
    }
    written
}

/// Tries whether [`write_foam_mesh`] could write into a folder, and leaves nothing behind.
///
/// # Errors
/// If the folder's parent does not exist, the name is a file's, or a file could not be written.
pub fn check_foam_mesh_writable(folder: &Path) -> io::Result<()> {
    if folder.is_dir() {
        return FILES.iter().try_for_each(|name| AtomicFile::create(&folder.join(name)).map(drop));
    }
    if folder.exists() {
        return Err(io::Error::from(io::ErrorKind::NotADirectory));
    }
    AtomicFile::create(folder).map(drop)
}

fn write_files(
    folder: &Path,
    mesh: &FoamMesh,
    watch: &mut dyn Watch,
) -> Result<(), MeshWriteError> {
    let mut finished = Vec::new();
    for (done, name) in FILES.into_iter().enumerate() {
        check(watch, Phase::Write, done as f64 / FILES.len() as f64, None)?;
        let file = AtomicFile::create(&folder.join(name))?;
        let mut lines = Lines { file, bytes: Vec::new(), watch: &mut *watch, count: 0, done };
        match name {
            "points" => points(&mut lines, mesh)?,
            "faces" => faces(&mut lines, mesh)?,
            "owner" => owners(&mut lines, mesh)?,
            "neighbour" => neighbours(&mut lines, mesh)?,
            "boundary" => boundary(&mut lines, mesh)?,
            "pointZones" => point_zones(&mut lines, mesh)?,
            "faceZones" => face_zones(&mut lines, mesh)?,
            _ => cell_zones(&mut lines, mesh)?,
        }
        finished.push(lines.close()?);
    }
    finished.into_iter().try_for_each(AtomicFile::commit)?;
    Ok(())
}

/// A file of lines.
struct Lines<'a> {
    file: AtomicFile,
    bytes: Vec<u8>,
    watch: &'a mut dyn Watch,
    count: usize,
    /// Files finished before.
    done: usize,
}

impl Lines<'_> {
    /// Adds a line.
    fn line(&mut self, text: std::fmt::Arguments) -> Result<(), MeshWriteError> {
        self.bytes.write_fmt(text)?;
        self.bytes.push(b'\n');
        self.count += 1;
        if self.count.is_multiple_of(LINES_PER_STEP) {
            check(self.watch, Phase::Write, self.done as f64 / FILES.len() as f64, None)?;
        }
        if self.bytes.len() >= CHUNK {
            self.file.write_all(&self.bytes)?;
            self.bytes.clear();
        }
        Ok(())
    }

    /// The head that every file has, with the type of its content.
    fn head(&mut self, class: &str, object: &str, note: &str) -> Result<(), MeshWriteError> {
        self.line(format_args!("FoamFile\n{{\n    version     2.0;\n    format      ascii;"))?;
        self.line(format_args!("    class       {class};"))?;
        if !note.is_empty() {
            self.line(format_args!("    note        \"{note}\";"))?;
        }
        self.line(format_args!("    location    \"constant/polyMesh\";"))?;
        self.line(format_args!("    object      {object};\n}}\n"))
    }

    fn close(mut self) -> Result<AtomicFile, MeshWriteError> {
        self.file.write_all(&self.bytes)?;
        Ok(self.file)
    }
}

fn points(to: &mut Lines, mesh: &FoamMesh) -> Result<(), MeshWriteError> {
    if !mesh.note.is_empty() {
        to.line(format_args!("// {}", mesh.note))?;
    }
    to.head("vectorField", "points", "")?;
    to.line(format_args!("{}\n(", mesh.points.len()))?;
    for [x, y, z] in &mesh.points {
        to.line(format_args!("({x:?} {y:?} {z:?})"))?;
    }
    to.line(format_args!(")"))
}

fn faces(to: &mut Lines, mesh: &FoamMesh) -> Result<(), MeshWriteError> {
    to.head("faceList", "faces", "")?;
    to.line(format_args!("{}\n(", mesh.face_count()))?;
    for face in 0..mesh.face_count() {
        match mesh.face(face).0 {
            [a, b, c] => to.line(format_args!("3({a} {b} {c})"))?,
            [a, b, c, d] => to.line(format_args!("4({a} {b} {c} {d})"))?,
            corners => {
                let words: Vec<String> = corners.iter().map(u32::to_string).collect();
                to.line(format_args!("{}({})", corners.len(), words.join(" ")))?;
            }
        }
    }
    to.line(format_args!(")"))
}

/// How many faces lie between cells; they come first.
fn inner_count(mesh: &FoamMesh) -> usize {
    mesh.beyond.partition_point(|beyond| matches!(beyond, Beyond::Cell(_)))
}

fn counts(mesh: &FoamMesh) -> String {
    let (points, faces) = (mesh.points.len(), mesh.face_count());
    let (cells, inner) = (mesh.cell_count, inner_count(mesh));
    format!("nPoints:{points}  nCells:{cells}  nFaces:{faces}  nInternalFaces:{inner}")
}

fn owners(to: &mut Lines, mesh: &FoamMesh) -> Result<(), MeshWriteError> {
    to.head("labelList", "owner", &counts(mesh))?;
    to.line(format_args!("{}\n(", mesh.face_count()))?;
    for owner in &mesh.owners {
        to.line(format_args!("{owner}"))?;
    }
    to.line(format_args!(")"))
}

fn neighbours(to: &mut Lines, mesh: &FoamMesh) -> Result<(), MeshWriteError> {
    to.head("labelList", "neighbour", &counts(mesh))?;
    to.line(format_args!("{}\n(", inner_count(mesh)))?;
    for beyond in &mesh.beyond {
        if let Beyond::Cell(other) = beyond {
            to.line(format_args!("{other}"))?;
        }
    }
    to.line(format_args!(")"))
}

fn boundary(to: &mut Lines, mesh: &FoamMesh) -> Result<(), MeshWriteError> {
    to.head("polyBoundaryMesh", "boundary", "")?;
    to.line(format_args!("{}\n(", mesh.patches.len()))?;
    let mut start = inner_count(mesh);
    for (patch, Patch { name, is_empty }) in mesh.patches.iter().enumerate() {
        let rest = &mesh.beyond[start..];
        let count = rest.partition_point(|&beyond| beyond == Beyond::Patch(patch as u32));
        let kind = if *is_empty { "empty" } else { "patch" };
        to.line(format_args!("    {name}\n    {{\n        type            {kind};"))?;
        to.line(format_args!("        nFaces          {count};"))?;
        to.line(format_args!("        startFace       {start};\n    }}"))?;
        start += count;
    }
    to.line(format_args!(")"))
}

fn point_zones(to: &mut Lines, mesh: &FoamMesh) -> Result<(), MeshWriteError> {
    let zones = mesh.point_zones.iter().map(|zone| (zone.name.as_str(), &zone.points[..]));
    plain_zones(to, ["pointZones", "pointZone", "pointLabels"], zones)
}

fn face_zones(to: &mut Lines, mesh: &FoamMesh) -> Result<(), MeshWriteError> {
    to.head("regIOobject", "faceZones", "")?;
    to.line(format_args!("{}\n(", mesh.face_zones.len()))?;
    for zone in &mesh.face_zones {
        let count = zone.faces.len();
        to.line(format_args!("{}\n{{\n    type faceZone;", zone.name))?;
        to.line(format_args!("faceLabels      List<label>\n{count}\n("))?;
        for (face, _) in &zone.faces {
            to.line(format_args!("{face}"))?;
        }
        to.line(format_args!(")\n;\nflipMap         List<bool>\n{count}\n("))?;
        for (_, flipped) in &zone.faces {
            to.line(format_args!("{}", u8::from(*flipped)))?;
        }
        to.line(format_args!(")\n;\n}}"))?;
    }
    to.line(format_args!(")"))
}

fn cell_zones(to: &mut Lines, mesh: &FoamMesh) -> Result<(), MeshWriteError> {
    let zones = mesh.cell_zones.iter().map(|zone| (zone.name.as_str(), &zone.cells[..]));
    plain_zones(to, ["cellZones", "cellZone", "cellLabels"], zones)
}

/// Zones that are lists of numbers, by the names of the file, of their type, and of their lists.
fn plain_zones<'a>(
    to: &mut Lines,
    [file, kind, labels]: [&str; 3],
    zones: impl ExactSizeIterator<Item = (&'a str, &'a [u32])>,
) -> Result<(), MeshWriteError> {
    to.head("regIOobject", file, "")?;
    to.line(format_args!("{}\n(", zones.len()))?;
    for (name, members) in zones {
        to.line(format_args!("{name}\n{{\n    type {kind};"))?;
        to.line(format_args!("{labels}      List<label>\n{}\n(", members.len()))?;
        for member in members {
            to.line(format_args!("{member}"))?;
        }
        to.line(format_args!(")\n;\n}}"))?;
    }
    to.line(format_args!(")"))
}
