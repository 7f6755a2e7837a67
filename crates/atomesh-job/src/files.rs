//! Files to write: refused before the work if they cannot be written, and whole or absent after it.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use atomesh_draw::{Picture, PictureFormat};
use atomesh_io::atomic_file::AtomicFile;
use atomesh_io::image::ImageFormat;
use atomesh_io::mesh::MeshFormat;
use atomesh_io::surface::SurfaceFormat;

use crate::error::JobError;
use crate::session::Session;

/// Tries whether files can be written, and would not take the place of each other or of an input.
///
/// # Errors
/// [`JobError`] names the first file that cannot be written or is taken.
pub(crate) fn check_apart<'a>(
    inputs: impl IntoIterator<Item = &'a Path>,
    outputs: impl IntoIterator<Item = &'a Path>,
    session: &mut Session<'_>,
) -> Result<(), JobError> {
    let inputs = inputs.into_iter().filter_map(|path| path.canonicalize().ok());
    let mut taken: Vec<PathBuf> = inputs.collect();
    session.writing(|_| {
        for path in outputs {
            check_writable(path)?;
            let place = absolute(path);
            if taken.contains(&place) {
                let message = "would be written over another file of this run";
                return Err(JobError::misuse(message).about(path));
            }
            taken.push(place);
        }
        Ok(())
    })
}

/// Tries whether files can be written.
///
/// # Errors
/// [`JobError`] names the first that cannot.
pub fn check<'a>(
    outputs: impl IntoIterator<Item = &'a Path>,
    session: &mut Session<'_>,
) -> Result<(), JobError> {
    session.writing(|_| outputs.into_iter().try_for_each(check_writable))
}

/// Tries whether a file, or a folder if the name calls for one, can be written.
fn check_writable(path: &Path) -> Result<(), JobError> {
    let tried = match MeshFormat::of(path) {
        Ok(format) => format.check_writable(path),
        Err(_) => AtomicFile::create(path).map(drop),
    };
    tried.map_err(|e| cannot_write(path, &e))
}

/// Writes a file, whole or not at all.
///
/// # Errors
/// [`JobError`] names the file.
pub fn write_bytes(path: &Path, bytes: &[u8]) -> Result<(), JobError> {
    let write = || {
        let mut file = AtomicFile::create(path)?;
        file.write_all(bytes)?;
        file.commit()
    };
    write().map_err(|e| cannot_write(path, &e))
}

fn cannot_write(path: &Path, error: &io::Error) -> JobError {
    let refusal = JobError::file(format!("cannot be written: {error}")).about(path);
    match error.kind() {
        io::ErrorKind::NotFound => refusal.advise("make its folder first"),
        _ => refusal,
    }
}

/// The path as other spellings of it would be too.
fn absolute(path: &Path) -> PathBuf {
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let whole = path.canonicalize().ok();
    whole.unwrap_or_else(|| {
        let folder = folder.canonicalize().unwrap_or_else(|_| folder.into());
        folder.join(path.file_name().unwrap_or_default())
    })
}

/// An error that names the file extensions that are known.
pub fn unknown_extension(path: &Path, known: &str) -> JobError {
    JobError::misuse(format!("unknown file extension; expected one of {known}")).about(path)
}

/// The format of a surface file by its name.
///
/// # Errors
/// [`JobError`] if the extension is unknown.
pub(crate) fn surface_format(path: &Path) -> Result<SurfaceFormat, JobError> {
    SurfaceFormat::of(path).map_err(|_| {
        let known = SurfaceFormat::EXTENSIONS;
        let message = format!("unknown extension of a surface file; expected one of {known}");
        JobError::misuse(message).about(path)
    })
}

/// Refuses a mesh file that values in cells are to go into, but whose format has no place for them.
///
/// # Errors
/// [`JobError`] names the formats that do.
pub(crate) fn check_holds_values(path: &Path) -> Result<(), JobError> {
    let format = MeshFormat::of(path);
    let format = format.map_err(|_| unknown_extension(path, &MeshFormat::endings()))?;
    if format.holds_values() {
        return Ok(());
    }
    let known = MeshFormat::value_endings();
    let message = format!("the format has no place for values in cells; expected one of {known}");
    let advice = "of these, Gmsh reads .msh, and ParaView and meshio .vtu";
    Err(JobError::misuse(message).about(path).advise(advice))
}

/// Whether a file has an extension, in upper or lower case.
pub(crate) fn has_extension(path: &Path, wanted: &str) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case(wanted))
}

/// Refuses a file of another extension.
pub(crate) fn check_extension(path: Option<&PathBuf>, wanted: &str) -> Result<(), JobError> {
    match path {
        Some(path) if !has_extension(path, wanted) => {
            Err(unknown_extension(path, &format!(".{wanted}")))
        }
        _ => Ok(()),
    }
}

/// Refuses a file for a potential whose format does not hold single precision.
pub(crate) fn check_potential(path: &Path) -> Result<(), JobError> {
    match ImageFormat::from_path(path) {
        Some(format) if format.writes_floats() => Ok(()),
        _ => Err(unknown_extension(path, &ImageFormat::usual_written_endings(", ", true))),
    }
}

/// Where a picture goes, in a format that is known.
#[derive(Clone, Debug)]
pub(crate) struct PictureFile {
    /// The file.
    pub path: PathBuf,
    format: PictureFormat,
}

impl PictureFile {
    /// The file's format by its name.
    ///
    /// # Errors
    /// [`JobError`] if the extension is unknown.
    pub fn of(path: Option<&PathBuf>) -> Result<Option<Self>, JobError> {
        let Some(path) = path else { return Ok(None) };
        let format = PictureFormat::of(path).map_err(|_| unknown_extension(path, ".png, .svg"))?;
        Ok(Some(Self { path: path.clone(), format }))
    }

    /// Writes the picture.
    ///
    /// # Errors
    /// [`JobError`] if it cannot be encoded or written.
    pub fn write(&self, picture: &Picture) -> Result<(), JobError> {
        write_bytes(&self.path, &picture.encode(self.format).map_err(JobError::content)?)
    }
}
