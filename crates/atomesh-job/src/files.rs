//! Files to write: refused before the work if they cannot be written, and whole or absent after it.
//!
//! `-` and `/dev/stdout` are standard output, and so is `-.EXT`, whose extension tells the format; a file of such
//! a name is written as `./-.EXT`.

use std::ffi::OsStr;
use std::fmt;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use atomesh_draw::{Picture, PictureFormat};
use atomesh_io::atomic_file::AtomicFile;
use atomesh_io::image::ImageFormat;
use atomesh_io::mesh::MeshFormat;
use atomesh_io::output_group::{OutputGroup, PlacingError};
use atomesh_io::place::Place;
use atomesh_io::surface::SurfaceFormat;

use crate::error::JobError;
use crate::session::Session;

/// The names of standard output.
const STANDARD_OUTPUT: [&str; 4] = ["-", "/dev/stdout", "/dev/fd/1", "/proc/self/fd/1"];

/// Whether a name is that of standard output.
pub fn is_standard_output(path: &Path) -> bool {
    let name = path.as_os_str().as_encoded_bytes();
    let has_format = name.starts_with(b"-.") && !name.contains(&b'/');
    has_format || STANDARD_OUTPUT.iter().any(|known| path.as_os_str() == *known)
}

/// A name as messages show it.
pub fn shown(path: &Path) -> impl fmt::Display {
    match is_standard_output(path) {
        true => "standard output".to_string(),
        false => path.display().to_string(),
    }
}

/// The name of standard output in a format, if the path is standard output; `format` is an extension such as
/// `vtu` or `nii.gz`. Other paths come back as they are.
///
/// # Errors
/// [`JobError`] if standard output has no format, or another file one.
pub fn with_format(path: &Path, format: Option<&str>) -> Result<PathBuf, JobError> {
    let is_plain = STANDARD_OUTPUT.iter().any(|known| path.as_os_str() == *known);
    match format {
        Some(format) if format.eq_ignore_ascii_case("polyMesh") => {
            refuse_standard_output(Path::new("-"), "a polyMesh is a folder")?;
            Ok(path.into())
        }
        Some(format) if is_plain => Ok(format!("-.{}", format.trim_start_matches('.')).into()),
        Some(format) => {
            let message = format!("--format {format} is for standard output, -o -; expected none");
            Err(JobError::misuse(message).advise("the name of a file tells its format").about(path))
        }
        None if is_plain => {
            let message = "standard output has no name that tells its format";
            Err(JobError::misuse(message)
                .advise("give it by --format EXT, as in -o - --format vtu"))
        }
        None => Ok(path.into()),
    }
}

/// Refuses standard output for what is written as a folder or as several files.
///
/// # Errors
/// [`JobError`] says what it is.
pub(crate) fn refuse_standard_output(path: &Path, what: &str) -> Result<(), JobError> {
    match is_standard_output(path) {
        true => {
            let message = format!("standard output takes one file, and {what}; expected a name");
            Err(JobError::misuse(message))
        }
        false => Ok(()),
    }
}

/// Refuses the name of a head that JSON cannot hold, since it names the tables beside it.
///
/// # Errors
/// [`JobError`] names the file.
pub(crate) fn check_head(path: &Path) -> Result<(), JobError> {
    match path.file_name().is_none_or(|name| name.to_str().is_some()) {
        true => Ok(()),
        false => {
            let message = "the name is not UTF-8, and the file names the tables beside it in JSON";
            Err(JobError::misuse(message).advise("choose another name").about(path))
        }
    }
}

/// Tries whether files can be written, and would not take the place of each other or of an input.
///
/// # Errors
/// [`JobError`] names the first file that cannot be written or is taken.
pub fn check_apart<'a>(
    inputs: impl IntoIterator<Item = &'a Path>,
    outputs: impl IntoIterator<Item = &'a Path>,
    session: &mut Session<'_>,
) -> Result<(), JobError> {
    let inputs = inputs.into_iter().filter_map(|path| path.canonicalize().ok());
    let mut taken: Vec<PathBuf> = inputs.collect();
    session.writing(|_| {
        for path in outputs {
            let Some(place) = check_writable(path)? else { continue };
            if taken.contains(&place) {
                let message = "would be written over another file of this run";
                return Err(JobError::misuse(message).about(path));
            }
            taken.push(place);
        }
        Ok(())
    })
}

/// Tries whether a file, or a folder if the name calls for one, can be written; gives the place that it would take.
/// Devices take any number of outputs.
fn check_writable(path: &Path) -> Result<Option<PathBuf>, JobError> {
    if is_standard_output(path) {
        return Ok(Some(STANDARD_OUTPUT[0].into()));
    }
    let tried = match MeshFormat::of(path) {
        Ok(format @ MeshFormat::OpenFoam) => {
            format.check_writable(path).map(|()| Some(absolute(path)))
        }
        _ => Place::of(path).and_then(|place| match place {
            Place::File(_) => AtomicFile::create(path).map(|_| Some(absolute(path))),
            // to open a pipe would wait for its reader, and to close it would end what it reads
            Place::Stream(_) => Ok(None),
        }),
    };
    tried.map_err(|e| JobError::unwritable(&e).about(path))
}

/// The path to write an output to, until it takes its place with the others of its group.
///
/// # Errors
/// [`JobError`] names the output.
pub fn stage(path: &Path, group: &mut OutputGroup) -> Result<PathBuf, JobError> {
    let staged = if is_standard_output(path) {
        let name = path.to_str().and_then(|path| path.strip_prefix("-."));
        let name = name.map_or("stdout".into(), |extension| format!("stdout.{extension}"));
        group.stage_standard_output(path, OsStr::new(&name))
    } else if let Ok(MeshFormat::OpenFoam) = MeshFormat::of(path) {
        group.stage_folder(path)
    } else {
        group.stage(path)
    };
    staged.map_err(|e| JobError::unwritable(&e).about(path))
}

/// [`stage`], where there is an output.
pub(crate) fn stage_any(
    path: &Option<PathBuf>,
    group: &mut OutputGroup,
) -> Result<Option<PathBuf>, JobError> {
    path.as_deref().map(|path| stage(path, group)).transpose()
}

/// The refusal of outputs that could not take their places.
pub(crate) fn unplaced(error: PlacingError) -> JobError {
    let PlacingError { path, error, replaced } = error;
    let refusal = JobError::unwritable(&error).about(&path);
    if replaced.is_empty() {
        return refusal;
    }
    let replaced: Vec<_> = replaced.iter().map(|path| path.display().to_string()).collect();
    refusal.advise(format!("these are new already: {}", replaced.join(", ")))
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
    write().map_err(|e: io::Error| JobError::unwritable(&e).about(path))
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
    if is_standard_output(path) && path.extension().is_none() {
        let message = format!("standard output has no extension; expected a file, one of {known}");
        return JobError::misuse(message);
    }
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

/// Refuses a file that Voronoi cells are not written to.
pub(crate) fn check_voronoi(path: &Path) -> Result<(), JobError> {
    match has_extension(path, "vtu") {
        true => Ok(()),
        false => Err(JobError::misuse("Voronoi cells are written as .vtu").about(path)),
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

    /// The same, written to where the group says.
    ///
    /// # Errors
    /// [`JobError`] names the picture.
    pub fn staged(&self, group: &mut OutputGroup) -> Result<Self, JobError> {
        Ok(Self { path: stage(&self.path, group)?, format: self.format })
    }

    /// Writes the picture.
    ///
    /// # Errors
    /// [`JobError`] if it cannot be encoded or written.
    pub fn write(&self, picture: &Picture) -> Result<(), JobError> {
        write_bytes(&self.path, &picture.encode(self.format).map_err(JobError::content)?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn standard_output_has_a_format_by_option_or_by_name() {
        let named = |path: &str, format| with_format(Path::new(path), format);
        assert_eq!(named("-", Some("vtu")), Ok("-.vtu".into()));
        assert_eq!(named("/dev/stdout", Some(".nii.gz")), Ok("-.nii.gz".into()));
        assert_eq!(named("m.vtu", None), Ok("m.vtu".into()));
        assert_eq!(named("-.vtu", None), Ok("-.vtu".into()));
        assert!(named("-", Some("polyMesh")).unwrap_err().to_string().contains("a folder"));
        assert!(named("-", None).unwrap_err().advice().unwrap().contains("--format"));
        assert!(named("m.vtu", Some("vtu")).unwrap_err().to_string().contains("-o -"));
        for (name, is_it) in [("-", true), ("-.png", true), ("./-.png", false), ("-x.png", false)] {
            assert_eq!(is_standard_output(Path::new(name)), is_it, "{name}");
        }
        let refused = refuse_standard_output(Path::new("-.json"), "a list is four files");
        assert!(refused.unwrap_err().to_string().contains("a list is four files"));
    }

    #[test]
    fn outputs_that_would_take_the_same_place_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        std::fs::write(path("a"), "").unwrap();
        let mut watch = atomesh::watch::Silent;
        let mut session = Session::new(&mut watch);
        let mut check = |input: &str, outputs: [&Path; 2]| {
            check_apart([path(input).as_path()], outputs, &mut session)
        };
        assert_eq!(check("a", [&path("b"), &path("c")]), Ok(()));
        let again = folder.path().join("./b");
        assert_eq!(check("a", [&path("b"), &again]).unwrap_err().path(), Some(again.as_path()));
        assert!(check("a", [&path("b"), &path("a")]).is_err());
        assert!(check("a", [Path::new("-"), Path::new("-.vtu")]).is_err());
        #[cfg(unix)]
        assert_eq!(check("a", [Path::new("/dev/null"), Path::new("/dev/null")]), Ok(()));
    }
}
