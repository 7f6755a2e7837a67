//! Files that appear whole or not at all.

use std::fs::File;
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

/// A file under construction: bytes go to a hidden file in the same folder, which takes the wanted
/// name in [`commit`](Self::commit). Dropped without that, it is removed, and what was there before
/// stays untouched. Writes are buffered.
///
/// A link is followed, so that it goes on pointing to the new file. Devices and pipes (`/dev/null`,
/// `/dev/stdout`) have no name to take: they are written to directly, and writers that seek fail
/// there if the system says so.
#[derive(Debug)]
pub struct AtomicFile {
    out: BufWriter<Target>,
    path: PathBuf,
}

/// Where the bytes go until the commit.
#[derive(Debug)]
enum Target {
    /// A regular file: renamed at the end.
    Temporary(NamedTempFile),
    /// A device or a pipe.
    Direct(File),
}

impl AtomicFile {
    /// Starts a file that will be called `path`.
    ///
    /// # Errors
    /// If `path` is a folder, or its folder does not exist or may not be written to.
    pub fn create(path: &Path) -> io::Result<Self> {
        let (path, target) = match path.metadata() {
            Ok(m) if m.is_dir() => return Err(io::Error::from(io::ErrorKind::IsADirectory)),
            Ok(m) if m.is_file() => {
                let path = path.canonicalize()?;
                let file = temporary_beside(&path)?;
                (path, Target::Temporary(file))
            }
            Ok(_) => (path.into(), Target::Direct(File::options().write(true).open(path)?)),
            Err(_) => (path.into(), Target::Temporary(temporary_beside(path)?)),
        };
        Ok(Self { out: BufWriter::with_capacity(1 << 18, target), path })
    }

    /// The name that the file will have.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Writes what is buffered and gives the file its name, replacing a file of that name.
    ///
    /// # Errors
    /// If the disk is full or the name cannot be taken; the unfinished file is then removed.
    pub fn commit(self) -> io::Result<()> {
        match self.out.into_inner().map_err(|e| e.into_error())? {
            Target::Temporary(file) => file.persist(&self.path).map(drop).map_err(|e| e.error),
            Target::Direct(_) => Ok(()),
        }
    }
}

/// An unnamed-as-yet file in the folder of `path`, readable by those whom the umask allows.
fn temporary_beside(path: &Path) -> io::Result<NamedTempFile> {
    if path.file_name().is_none() {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "the path names no file"));
    }
    let folder = match path.parent() {
        Some(p) if !p.as_os_str().is_empty() => p,
        _ => Path::new("."),
    };
    if !folder.metadata()?.is_dir() {
        return Err(io::Error::from(io::ErrorKind::NotADirectory));
    }
    let mut builder = tempfile::Builder::new();
    builder.prefix(".atomesh-").suffix(".part");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    // the random name says nothing to the user: only the reason is kept
    builder.tempfile_in(folder).map_err(|e| io::Error::from(e.kind()))
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
        match self {
            Target::Temporary(file) => file.write(bytes),
            Target::Direct(file) => file.write(bytes),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        match self {
            Target::Temporary(file) => file.flush(),
            Target::Direct(file) => file.flush(),
        }
    }
}

impl Seek for Target {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        match self {
            Target::Temporary(file) => file.seek(to),
            Target::Direct(file) => file.seek(to),
        }
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
}
