//! Files of samples beside the header that names them.
//!
//! A header comes from anyone. It may name files in its own folder and below, and in a folder that the caller
//! allows; what else it names is neither opened nor looked at. Links are followed before that is decided.
//! Only plain files are opened: a device may have no end, a pipe no beginning.

use std::fs::{self, File};
use std::io;
use std::path::{Component, Path, PathBuf};

use super::error::ReadReason;

/// Where the data files of a header may be.
#[derive(Clone, Copy, Debug)]
pub(super) struct DataFolders<'a> {
    /// The header's own.
    pub own: &'a Path,
    /// Another one, with all below it.
    pub root: Option<&'a Path>,
}

impl DataFolders<'_> {
    /// The file that a header names and its length. The path has no links.
    ///
    /// # Errors
    /// [`ReadReason::DataOutside`] of a file elsewhere, [`ReadReason::DataFile`] of one that is not there or no
    /// plain file.
    pub fn find(&self, name: &str) -> Result<(PathBuf, u64), ReadReason> {
        let named = Path::new(name);
        let outside = || ReadReason::DataOutside { path: named.into() };
        let failure = |error| ReadReason::DataFile { path: named.into(), error };
        let folders = || [Some(self.own), self.root].into_iter().flatten().map(here);
        let real: Vec<PathBuf> = folders().filter_map(|f| f.canonicalize().ok()).collect();
        let spelt = folders().filter_map(|f| plain(&std::path::absolute(f).ok()?));
        let own = here(self.own).canonicalize().map_err(failure)?;
        // what is elsewhere by its name alone is not looked at
        let path = plain(&own.join(named)).ok_or_else(outside)?;
        if !real.iter().cloned().chain(spelt).any(|folder| path.starts_with(folder)) {
            return Err(outside());
        }
        let path = path.canonicalize().map_err(failure)?;
        if !real.iter().any(|folder| path.starts_with(folder)) {
            return Err(outside());
        }
        let metadata = fs::metadata(&path).map_err(failure)?;
        if !metadata.is_file() {
            return Err(failure(io::Error::other("it is not a plain file")));
        }
        Ok((path, metadata.len()))
    }

    /// Opens the file that a header names, of the length that comes with it.
    ///
    /// # Errors
    /// As [`find`](Self::find).
    pub fn open(&self, name: &str) -> Result<(File, u64), ReadReason> {
        let (path, bytes) = self.find(name)?;
        let file = File::open(path);
        Ok((file.map_err(|error| ReadReason::DataFile { path: name.into(), error })?, bytes))
    }
}

/// The folder of a file whose name stands alone.
fn here(folder: &Path) -> &Path {
    if folder.as_os_str().is_empty() { Path::new(".") } else { folder }
}

/// An absolute path without `.` and `..`; none if it leaves the root.
fn plain(path: &Path) -> Option<PathBuf> {
    let mut plain = PathBuf::new();
    for part in path.components() {
        match part {
            Component::CurDir => {}
            Component::ParentDir if plain.pop() => {}
            Component::ParentDir => return None,
            other => plain.push(other),
        }
    }
    Some(plain)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder() -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::create_dir_all(at("scan/raw")).unwrap();
        fs::create_dir_all(at("data")).unwrap();
        for name in ["scan/a.raw", "scan/raw/b.raw", "data/c.raw", "d.raw"] {
            fs::write(at(name), [1, 2, 3]).unwrap();
        }
        folder
    }

    #[test]
    fn files_beside_the_header_and_below_are_found() {
        let folder = folder();
        let own = &folder.path().join("scan");
        let folders = DataFolders { own, root: None };
        let whole = own.join("a.raw");
        for name in ["a.raw", "./a.raw", "raw/b.raw", "raw/../a.raw", whole.to_str().unwrap()] {
            assert_eq!(folders.find(name).unwrap().1, 3, "{name}");
        }
    }

    #[test]
    fn files_elsewhere_are_refused_unless_their_folder_is_allowed() {
        let folder = folder();
        let own = &folder.path().join("scan");
        let far = folder.path().join("data/c.raw");
        for name in ["../d.raw", "../data/c.raw", "/etc/passwd", "/no/such/file", "../../../../.."]
        {
            let error = DataFolders { own, root: None }.find(name).unwrap_err();
            assert!(matches!(error, ReadReason::DataOutside { .. }), "{name}: {error}");
        }
        let allowed = DataFolders { own, root: Some(&folder.path().join("data")) };
        for name in ["../data/c.raw", far.to_str().unwrap(), "a.raw"] {
            assert_eq!(allowed.find(name).unwrap().1, 3, "{name}");
        }
        assert!(matches!(allowed.find("../d.raw"), Err(ReadReason::DataOutside { .. })));
    }

    #[test]
    fn what_is_no_plain_file_is_not_opened() {
        let folder = folder();
        let own = folder.path();
        let folders = DataFolders { own, root: Some(Path::new("/dev")) };
        for name in ["scan", "none.raw", "/dev/zero"] {
            let error = folders.find(name).unwrap_err();
            assert!(matches!(error, ReadReason::DataFile { .. }), "{name}: {error}");
        }
    }

    #[cfg(unix)]
    #[test]
    fn links_lead_where_they_lead() {
        let folder = folder();
        let own = &folder.path().join("scan");
        let link = |to: &str, name: &str| {
            std::os::unix::fs::symlink(folder.path().join(to), own.join(name)).unwrap();
        };
        link("scan/raw", "near");
        link("data", "far");
        let folders = DataFolders { own, root: None };
        assert_eq!(folders.find("near/b.raw").unwrap().1, 3);
        assert!(matches!(folders.find("far/c.raw"), Err(ReadReason::DataOutside { .. })));
        let allowed = DataFolders { own, root: Some(&own.join("far")) };
        assert_eq!(allowed.find("far/c.raw").unwrap().1, 3);
    }
}
