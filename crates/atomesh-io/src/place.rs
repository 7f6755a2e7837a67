//! Where an output goes: links are followed, devices and pipes are known, and the permissions of a file
//! that is replaced are kept.

use std::fs::{self, File, Metadata};
use std::io::{self, Seek};
use std::path::{Path, PathBuf};

/// What the name of an output leads to.
#[derive(Debug)]
pub enum Place {
    /// A regular file, new or to be replaced.
    File(FilePlace),
    /// A character device or a pipe, which takes bytes in their order.
    Stream(PathBuf),
}

/// The place of a regular file.
#[derive(Debug)]
pub struct FilePlace {
    path: PathBuf,
    old: Option<Metadata>,
}

impl Place {
    /// What a name leads to; nothing is created or opened.
    ///
    /// # Errors
    /// If it is a folder, a block device, a socket, or a link to nothing, or its folder is missing.
    pub fn of(path: &Path) -> io::Result<Self> {
        let found = match path.metadata() {
            Ok(found) => found,
            Err(e) => return FilePlace::new(path, e).map(Self::File),
        };
        if found.is_dir() {
            return Err(io::Error::from(io::ErrorKind::IsADirectory));
        }
        if found.is_file() {
            return Ok(Self::File(FilePlace { path: path.canonicalize()?, old: Some(found) }));
        }
        refuse_special(&found)?;
        Ok(Self::Stream(path.into()))
    }

    /// The path, without links if it is a file's that exists.
    pub fn path(&self) -> &Path {
        match self {
            Self::File(file) => &file.path,
            Self::Stream(path) => path,
        }
    }
}

impl FilePlace {
    /// A file that does not exist yet; `missing` is why nothing was found there.
    fn new(path: &Path, missing: io::Error) -> io::Result<Self> {
        if let Ok(target) = fs::read_link(path) {
            let target = target.display();
            let text = match missing.kind() {
                io::ErrorKind::NotFound => {
                    format!("it is a link to {target}, which does not exist")
                }
                _ => format!("it is a link to {target}: {missing}"),
            };
            return Err(io::Error::new(missing.kind(), text));
        }
        if missing.kind() != io::ErrorKind::NotFound {
            return Err(missing);
        }
        if path.file_name().is_none() {
            return Err(io::Error::new(io::ErrorKind::InvalidInput, "the path names no file"));
        }
        if path.as_os_str().as_encoded_bytes().ends_with(b"/") {
            let text = "the name ends in /, as a folder's";
            return Err(io::Error::new(io::ErrorKind::InvalidInput, text));
        }
        let place = Self { path: path.into(), old: None };
        match place.folder().metadata()?.is_dir() {
            true => Ok(place),
            false => Err(io::Error::from(io::ErrorKind::NotADirectory)),
        }
    }

    /// The file's path.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Whether there is a file to be replaced.
    pub fn is_taken(&self) -> bool {
        self.old.is_some()
    }

    /// The folder that the file lies in.
    pub fn folder(&self) -> &Path {
        match self.path.parent() {
            Some(folder) if !folder.as_os_str().is_empty() => folder,
            _ => Path::new("."),
        }
    }

    /// Gives `new` the permissions of the file that it will replace; its owner and group too, where the system
    /// allows that.
    ///
    /// # Errors
    /// If the permissions cannot be set.
    pub fn dress(&self, new: &Path) -> io::Result<()> {
        match &self.old {
            Some(old) => inherit(old, new),
            None => Ok(()),
        }
    }
}

#[cfg(unix)]
fn inherit(old: &Metadata, new: &Path) -> io::Result<()> {
    use std::os::unix::fs::{MetadataExt, PermissionsExt, chown};
    let (uid, gid) = (old.uid(), old.gid());
    let now = new.metadata()?;
    let mut mode = old.mode() & 0o7777;
    if (now.uid(), now.gid()) != (uid, gid) && chown(new, Some(uid), Some(gid)).is_err() {
        // only root may give a file away; the rights of another owner are not handed on
        let _ = chown(new, None, Some(gid));
        mode &= 0o777;
    }
    match mode == now.mode() & 0o7777 {
        true => Ok(()),
        false => fs::set_permissions(new, fs::Permissions::from_mode(mode)),
    }
}

#[cfg(not(unix))]
fn inherit(_old: &Metadata, _new: &Path) -> io::Result<()> {
    Ok(())
}

/// Refuses what is neither a file nor takes bytes in their order.
#[cfg(unix)]
fn refuse_special(found: &Metadata) -> io::Result<()> {
    use std::os::unix::fs::FileTypeExt;
    let kind = found.file_type();
    let text = match (kind.is_block_device(), kind.is_socket()) {
        (true, _) => "it is a block device, whose content would be lost",
        (_, true) => "it is a socket",
        _ => return Ok(()),
    };
    Err(io::Error::new(io::ErrorKind::InvalidInput, text))
}

#[cfg(not(unix))]
fn refuse_special(_found: &Metadata) -> io::Result<()> {
    Ok(())
}

/// Hands a file's bytes on to a device or a pipe; waits for the reader of a pipe.
pub(crate) fn hand_on(from: &mut File, to: &Path) -> io::Result<()> {
    from.rewind()?;
    let mut to = File::options().write(true).open(to)?;
    io::copy(from, &mut to).map(drop)
}

#[cfg(test)]
#[cfg(unix)]
mod tests {
    use super::*;
    use std::os::unix::fs::{PermissionsExt, symlink};

    fn refusal(path: &Path) -> String {
        Place::of(path).unwrap_err().to_string()
    }

    #[test]
    fn links_that_lead_nowhere_are_refused_with_where_they_lead() {
        let folder = tempfile::tempdir().unwrap();
        let (link, round) = (folder.path().join("link"), folder.path().join("round"));
        symlink("gone/m.vtu", &link).unwrap();
        symlink("round", &round).unwrap();
        assert_eq!(refusal(&link), "it is a link to gone/m.vtu, which does not exist");
        assert!(refusal(&round).starts_with("it is a link to round: "), "{}", refusal(&round));
    }

    #[test]
    fn names_of_folders_and_sockets_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let name = |name: &str| folder.path().join(name);
        assert!(refusal(&name("new.vtu/")).contains("as a folder's"));
        let _socket = std::os::unix::net::UnixListener::bind(name("socket")).unwrap();
        assert_eq!(refusal(&name("socket")), "it is a socket");
        let long = "x".repeat(300);
        assert_eq!(Place::of(&name(&long)).unwrap_err().kind(), io::ErrorKind::InvalidFilename);
    }

    #[test]
    fn permissions_are_those_of_the_file_that_is_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let (old, new) = (folder.path().join("old"), folder.path().join("new"));
        for mode in [0o600, 0o640, 0o755, 0o444] {
            fs::write(&new, "").unwrap();
            let _ = fs::remove_file(&old);
            fs::write(&old, "").unwrap();
            fs::set_permissions(&old, fs::Permissions::from_mode(mode)).unwrap();
            let Place::File(place) = Place::of(&old).unwrap() else { panic!("it is a file") };
            place.dress(&new).unwrap();
            assert_eq!(new.metadata().unwrap().permissions().mode() & 0o7777, mode);
        }
    }
}
