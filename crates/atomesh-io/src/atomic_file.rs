//! Files that appear whole or not at all.

use std::fs::File;
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::path::Path;

use tempfile::NamedTempFile;

use crate::place::{Place, hand_on};

/// A file under construction: bytes go to a hidden file in the same folder, which takes the wanted
/// name in [`commit`](Self::commit). Dropped without that, it is removed, and what was there before
/// stays untouched. Writes are buffered.
///
/// A link is followed, so that it goes on pointing to the new file; a file that is replaced leaves its
/// permissions. Devices and pipes (`/dev/null`) have no name to take: they are handed all bytes at the end, so that
/// writers may seek.
#[derive(Debug)]
pub struct AtomicFile {
    out: BufWriter<Target>,
    place: Place,
}

/// Where the bytes go until the commit.
#[derive(Debug)]
enum Target {
    /// Renamed at the end.
    Named(NamedTempFile),
    /// Copied at the end.
    Unnamed(File),
}

impl Target {
    fn file(&mut self) -> &mut File {
        match self {
            // the file itself, whose errors do not name it: the random name says nothing to the user
            Self::Named(file) => file.as_file_mut(),
            Self::Unnamed(file) => file,
        }
    }
}

impl AtomicFile {
    /// Starts a file that will be called `path`.
    ///
    /// # Errors
    /// If `path` is a folder or leads to what cannot be written, or its folder does not exist or may not be written to.
    pub fn create(path: &Path) -> io::Result<Self> {
        let place = Place::of(path)?;
        let target = match &place {
            Place::File(file) => Target::Named(temporary_in(file.folder())?),
            Place::Stream(_) => Target::Unnamed(tempfile::tempfile()?),
        };
        Ok(Self { out: BufWriter::with_capacity(1 << 18, target), place })
    }

    /// The name that the file will have.
    pub fn path(&self) -> &Path {
        self.place.path()
    }

    /// Writes what is buffered and gives the file its name, replacing a file of that name.
    ///
    /// # Errors
    /// If the disk is full or the name cannot be taken; the unfinished file is then removed.
    pub fn commit(self) -> io::Result<()> {
        let target = self.out.into_inner().map_err(|e| e.into_error())?;
        match target {
            Target::Named(file) => {
                if let Place::File(place) = &self.place {
                    place.dress(file.path())?;
                }
                file.persist(self.place.path()).map(drop).map_err(|e| e.error)
            }
            Target::Unnamed(mut file) => hand_on(&mut file, self.place.path()),
        }
    }
}

/// How the names of unfinished files and folders begin and end.
pub(crate) const UNFINISHED: [&str; 2] = [".atomesh-", ".part"];

/// An unnamed-as-yet file in a folder, readable by those whom the umask allows.
fn temporary_in(folder: &Path) -> io::Result<NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(UNFINISHED[0]).suffix(UNFINISHED[1]);
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    builder.tempfile_in(folder).map_err(without_name)
}

/// The error of a temporary file without its name, which is random and says nothing to the user.
pub(crate) fn without_name(error: io::Error) -> io::Error {
    error.kind().into()
}

impl Write for AtomicFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.out.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }
}

impl Seek for AtomicFile {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.out.seek(to)
    }
}

impl Write for Target {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file().write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file().flush()
    }
}

impl Seek for Target {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.file().seek(to)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    fn names(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).unwrap();
        entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect()
    }

    #[test]
    fn a_committed_file_replaces_the_old_one_and_a_dropped_one_does_not() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("mesh.vtu");
        fs::write(&path, "old").unwrap();

        let mut file = AtomicFile::create(&path).unwrap();
        file.write_all(b"half").unwrap();
        file.flush().unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"old");
        drop(file);
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(names(folder.path()), ["mesh.vtu"]);

        let mut file = AtomicFile::create(&path).unwrap();
        file.write_all(b"....!").unwrap();
        file.seek(SeekFrom::Start(0)).unwrap();
        file.write_all(b"full").unwrap();
        file.commit().unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"full!");
        assert_eq!(names(folder.path()), ["mesh.vtu"]);
    }

    #[test]
    fn places_that_cannot_be_written_are_refused_at_once() {
        let folder = tempfile::tempdir().unwrap();
        let kind = |path: &Path| AtomicFile::create(path).unwrap_err().kind();
        assert_eq!(kind(folder.path()), io::ErrorKind::IsADirectory);
        assert_eq!(kind(&folder.path().join("no/such")), io::ErrorKind::NotFound);
        let file = folder.path().join("file");
        fs::write(&file, "").unwrap();
        assert_eq!(kind(&file.join("below")), io::ErrorKind::NotADirectory);
        assert_eq!(kind(Path::new("")), io::ErrorKind::InvalidInput);
    }

    #[cfg(unix)]
    #[test]
    fn links_are_followed_and_devices_kept() {
        use std::os::unix::fs::FileTypeExt;
        let folder = tempfile::tempdir().unwrap();
        let (path, link) = (folder.path().join("real"), folder.path().join("link"));
        fs::write(&path, "old").unwrap();
        std::os::unix::fs::symlink(&path, &link).unwrap();
        let mut file = AtomicFile::create(&link).unwrap();
        file.write_all(b"new").unwrap();
        file.commit().unwrap();
        assert!(link.is_symlink());
        assert_eq!(fs::read(&path).unwrap(), b"new");

        let mut file = AtomicFile::create(Path::new("/dev/null")).unwrap();
        file.write_all(b"x").unwrap();
        file.commit().unwrap();
        assert!(Path::new("/dev/null").metadata().unwrap().file_type().is_char_device());
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_device_that_is_full_says_so() {
        let mut file = AtomicFile::create(Path::new("/dev/full")).unwrap();
        file.write_all(b"x").unwrap();
        assert_eq!(file.commit().unwrap_err().kind(), io::ErrorKind::StorageFull);
    }

    #[cfg(unix)]
    #[test]
    fn a_new_file_has_the_permissions_of_any_and_a_replaced_one_leaves_its_own() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let mode = |path: &Path| path.metadata().unwrap().permissions().mode() & 0o7777;
        let (plain, path) = (folder.path().join("plain"), folder.path().join("new"));
        File::create(&plain).unwrap();
        AtomicFile::create(&path).unwrap().commit().unwrap();
        assert_eq!(mode(&path), mode(&plain));
        fs::set_permissions(&path, fs::Permissions::from_mode(0o604)).unwrap();
        AtomicFile::create(&path).unwrap().commit().unwrap();
        assert_eq!(mode(&path), 0o604);
    }
}
