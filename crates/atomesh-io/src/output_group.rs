//! Outputs that appear together, or none of them.
//!
//! Each output is written under its own name into a hidden folder beside its place. When all are whole, devices,
//! pipes and standard output are handed their bytes, since these cannot be put back; then files are renamed one
//! after the other. If one cannot be, those before it are put back.
//!
//! Renaming is atomic for each file, not for all of them: a process that is killed outright or loses its power
//! in between leaves some new and some old, and hidden folders named `.atomesh-….part`.

use std::ffi::OsStr;
use std::fs::{self, File};
use std::io::{self, Seek, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use tempfile::TempDir;

use crate::atomic_file::{AtomicFile, UNFINISHED, without_name};
use crate::place::{FilePlace, Place, hand_on};

/// The hidden folders of this process.
static ROOMS: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

fn rooms() -> MutexGuard<'static, Vec<PathBuf>> {
    ROOMS.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Removes what is written of all groups of this process. For one who ends the process while no file is being
/// written; a group that is dropped removes its own.
pub fn remove_unfinished() {
    for room in rooms().drain(..) {
        let _ = fs::remove_dir_all(room);
    }
}

/// A hidden folder, removed with all that is in it.
#[derive(Debug)]
struct Room(TempDir);

impl Room {
    fn new(folder: &Path) -> io::Result<Self> {
        let mut builder = tempfile::Builder::new();
        builder.prefix(UNFINISHED[0]).suffix(UNFINISHED[1]);
        let room = builder.tempdir_in(folder).map_err(without_name)?;
        rooms().push(room.path().into());
        Ok(Self(room))
    }
}

impl Drop for Room {
    fn drop(&mut self) {
        let own = self.0.path();
        rooms().retain(|room| room != own);
    }
}

/// What becomes of an output once it is whole.
#[derive(Debug)]
enum Goal {
    File(FilePlace),
    Stream(PathBuf),
    /// A folder; that which exists keeps its files of other names.
    Folder(PathBuf),
    StandardOutput,
}

/// An output being written.
#[derive(Debug)]
struct Output {
    wanted: PathBuf,
    /// Where it is written until it is whole.
    staged: PathBuf,
    goal: Goal,
    room: Room,
}

/// Why outputs did not take their places.
#[derive(Debug)]
pub struct PlacingError {
    /// The output that could not, as it was named.
    pub path: PathBuf,
    /// What the system said.
    pub error: io::Error,
    /// Files that are new and could not be put back.
    pub replaced: Vec<PathBuf>,
}

/// Outputs that appear together: [`stage`](Self::stage) each, write to the paths that it returns, then
/// [`place`](Self::place) them. Dropped without that, nothing is left of them.
#[derive(Debug, Default)]
pub struct OutputGroup {
    outputs: Vec<Output>,
}

impl OutputGroup {
    /// The path to write a file to, in place of its own; of the same name, in a folder that exists.
    ///
    /// # Errors
    /// As [`Place::of`], and if its folder may not be written to.
    pub fn stage(&mut self, path: &Path) -> io::Result<PathBuf> {
        let (goal, room) = match Place::of(path)? {
            Place::File(place) => {
                let room = Room::new(place.folder())?;
                (Goal::File(place), room)
            }
            Place::Stream(path) => (Goal::Stream(path), Room::new(&std::env::temp_dir())?),
        };
        Ok(self.add(path, path.file_name().unwrap_or_default(), goal, room))
    }

    /// The path of a folder to write in place of another.
    ///
    /// # Errors
    /// If the name is a file's, or the folder, or that which it is to be in, may not be written to.
    pub fn stage_folder(&mut self, path: &Path) -> io::Result<PathBuf> {
        let name = path.file_name().unwrap_or_default();
        let (place, room) = match path.is_dir() {
            true => (path.canonicalize()?, Room::new(path)?),
            false => match Place::of(path)? {
                Place::File(place) if !place.is_taken() => {
                    (path.into(), Room::new(place.folder())?)
                }
                _ => return Err(io::Error::from(io::ErrorKind::NotADirectory)),
            },
        };
        Ok(self.add(path, name, Goal::Folder(place), room))
    }

    /// The path of a file whose bytes go to standard output; its name tells its format.
    ///
    /// # Errors
    /// If there is no room for temporary files.
    pub fn stage_standard_output(&mut self, path: &Path, name: &OsStr) -> io::Result<PathBuf> {
        let room = Room::new(&std::env::temp_dir())?;
        Ok(self.add(path, name, Goal::StandardOutput, room))
    }

    fn add(&mut self, path: &Path, name: &OsStr, goal: Goal, room: Room) -> PathBuf {
        let staged = room.0.path().join(name);
        self.outputs.push(Output { wanted: path.into(), staged: staged.clone(), goal, room });
        staged
    }

    /// The name of the output that is written to a path, or into a folder of it.
    pub fn wanted(&self, staged: &Path) -> Option<&Path> {
        let found = self.outputs.iter().find(|output| staged.starts_with(output.room.0.path()));
        found.map(|output| output.wanted.as_path())
    }

    /// Whether some of the outputs are handed on, which may wait for a reader.
    pub fn has_streams(&self) -> bool {
        self.outputs.iter().any(|o| matches!(o.goal, Goal::Stream(_) | Goal::StandardOutput))
    }

    /// Hands devices, pipes and standard output their bytes. [`place`](Self::place) does not do it again.
    ///
    /// # Errors
    /// [`PlacingError`] names the first that does not take them.
    pub fn hand_on(&mut self) -> Result<(), PlacingError> {
        let is_stream =
            |output: &Output| matches!(output.goal, Goal::Stream(_) | Goal::StandardOutput);
        let (streams, files) = std::mem::take(&mut self.outputs).into_iter().partition(is_stream);
        self.outputs = files;
        let streams: Vec<Output> = streams;
        streams.into_iter().try_for_each(|Output { wanted, staged, goal, .. }| {
            let handed = File::open(&staged).and_then(|mut file| match &goal {
                Goal::Stream(path) => hand_on(&mut file, path),
                _ => to_standard_output(&mut file),
            });
            handed.map_err(|error| PlacingError { path: wanted, error, replaced: Vec::new() })
        })
    }

    /// Puts all outputs in their places.
    ///
    /// # Errors
    /// [`PlacingError`] names the first that could not be; those before it are put back.
    pub fn place(mut self) -> Result<(), PlacingError> {
        self.hand_on()?;
        let mut done = Vec::new();
        for output in &self.outputs {
            if let Err(error) = output.place(&mut done) {
                let undone = done.into_iter().rev().filter_map(Move::take_back);
                let replaced = undone.collect();
                return Err(PlacingError { path: output.wanted.clone(), error, replaced });
            }
        }
        Ok(())
    }
}

impl Output {
    /// Puts the output in its place, and adds what that took.
    fn place(&self, done: &mut Vec<Move>) -> io::Result<()> {
        let room = self.room.0.path();
        match &self.goal {
            Goal::File(place) => done.push(Move::of(&self.staged, place, room)?),
            Goal::Folder(folder) if folder.is_dir() => {
                for entry in fs::read_dir(&self.staged)? {
                    let entry = entry?;
                    let Place::File(place) = Place::of(&folder.join(entry.file_name()))? else {
                        return Err(io::Error::other("it holds something that is not a file"));
                    };
                    done.push(Move::of(&entry.path(), &place, room)?);
                }
            }
            Goal::Folder(folder) => {
                fs::rename(&self.staged, folder)?;
                done.push(Move { to: folder.clone(), old: Old::None });
            }
            Goal::Stream(_) | Goal::StandardOutput => {}
        }
        Ok(())
    }
}

/// What was at a place before.
#[derive(Debug)]
enum Old {
    None,
    /// A file, which has another name now.
    Kept(PathBuf),
    /// A file that is lost.
    Lost,
}

/// An output that is in its place.
#[derive(Debug)]
struct Move {
    to: PathBuf,
    old: Old,
}

impl Move {
    /// Moves a file to its place; the old one stays in the room, on file systems that have links.
    fn of(from: &Path, place: &FilePlace, room: &Path) -> io::Result<Self> {
        let to = place.path().to_path_buf();
        place.dress(from)?;
        let mut name = from.file_name().unwrap_or_default().to_owned();
        name.push(".old");
        let kept = room.join(name);
        let old = match place.is_taken() {
            false => Old::None,
            true if fs::hard_link(&to, &kept).is_ok() => Old::Kept(kept),
            true => Old::Lost,
        };
        match fs::rename(from, &to) {
            Err(e) if e.kind() == io::ErrorKind::CrossesDevices => copy(from, &to)?,
            moved => moved?,
        }
        Ok(Self { to, old })
    }

    /// Puts back what was there before; gives the path if that is not possible.
    fn take_back(self) -> Option<PathBuf> {
        let undone = match &self.old {
            Old::None if self.to.is_dir() => fs::remove_dir_all(&self.to).is_ok(),
            Old::None => fs::remove_file(&self.to).is_ok(),
            Old::Kept(old) => fs::rename(old, &self.to).is_ok(),
            Old::Lost => false,
        };
        (!undone).then_some(self.to)
    }
}

/// Copies a file to another file system, where it appears whole.
fn copy(from: &Path, to: &Path) -> io::Result<()> {
    let mut out = AtomicFile::create(to)?;
    io::copy(&mut File::open(from)?, &mut out)?;
    out.commit()
}

fn to_standard_output(from: &mut File) -> io::Result<()> {
    from.rewind()?;
    let mut out = io::stdout().lock();
    io::copy(from, &mut out)?;
    out.flush()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A folder with the old files `a` and `b`.
    fn folder() -> TempDir {
        let folder = tempfile::tempdir().unwrap();
        for name in ["a", "b"] {
            fs::write(folder.path().join(name), format!("old {name}")).unwrap();
        }
        folder
    }

    /// The files of a folder and their content, in order; folders end in `/`.
    fn content(folder: &Path) -> Vec<(String, String)> {
        let mut all: Vec<_> = (fs::read_dir(folder).unwrap())
            .map(|entry| {
                let entry = entry.unwrap();
                let name = entry.file_name().into_string().unwrap();
                match entry.path().is_dir() {
                    true => (name + "/", String::new()),
                    false => (name, fs::read_to_string(entry.path()).unwrap()),
                }
            })
            .collect();
        all.sort();
        all
    }

    fn is(folder: &Path, expected: &[(&str, &str)]) {
        let expected: Vec<_> =
            expected.iter().map(|(a, b)| (a.to_string(), b.to_string())).collect();
        assert_eq!(content(folder), expected);
    }

    fn write(group: &mut OutputGroup, path: PathBuf, text: &str) -> PathBuf {
        let staged = group.stage(&path).unwrap();
        assert_eq!(
            (staged.file_name(), group.wanted(&staged)),
            (path.file_name(), Some(path.as_path()))
        );
        fs::write(&staged, text).unwrap();
        staged
    }

    #[test]
    fn outputs_appear_together_and_a_dropped_group_leaves_nothing() {
        let folder = folder();
        let folder = folder.path();
        for is_placed in [false, true] {
            let mut group = OutputGroup::default();
            write(&mut group, folder.join("a"), "new a");
            write(&mut group, folder.join("c"), "new c");
            assert_eq!(fs::read_to_string(folder.join("a")).unwrap(), "old a");
            assert!(!folder.join("c").exists());
            if is_placed {
                group.place().unwrap();
                is(folder, &[("a", "new a"), ("b", "old b"), ("c", "new c")]);
            } else {
                drop(group);
                is(folder, &[("a", "old a"), ("b", "old b")]);
            }
        }
    }

    #[test]
    fn outputs_before_one_that_fails_are_put_back() {
        let folder = folder();
        let folder = folder.path();
        let mut group = OutputGroup::default();
        for name in ["a", "c", "b"] {
            write(&mut group, folder.join(name), "new");
        }
        // somebody puts a folder there meanwhile
        fs::remove_file(folder.join("b")).unwrap();
        fs::create_dir(folder.join("b")).unwrap();
        let error = group.place().unwrap_err();
        assert_eq!((error.path, error.replaced), (folder.join("b"), vec![]));
        is(folder, &[("a", "old a"), ("b/", "")]);
    }

    #[test]
    fn a_writer_that_fails_in_the_midst_leaves_all_as_it_was() {
        let folder = folder();
        let folder = folder.path();
        let mut group = OutputGroup::default();
        write(&mut group, folder.join("a"), "new");
        let _unwritten = group.stage(&folder.join("b")).unwrap();
        assert!(group.place().is_err());
        is(folder, &[("a", "old a"), ("b", "old b")]);
    }

    #[test]
    fn a_folder_keeps_its_other_files_and_a_new_one_appears_whole() {
        let folder = folder();
        let (old, new) = (folder.path(), folder.path().join("polyMesh"));
        for place in [&old.to_path_buf(), &new] {
            let mut group = OutputGroup::default();
            let staged = group.stage_folder(place).unwrap();
            assert_eq!(staged.file_name(), place.file_name());
            fs::create_dir(&staged).unwrap();
            fs::write(staged.join("a"), "new a").unwrap();
            assert!(!new.exists());
            group.place().unwrap();
        }
        is(old, &[("a", "new a"), ("b", "old b"), ("polyMesh/", "")]);
        is(&new, &[("a", "new a")]);
        let mut group = OutputGroup::default();
        let error = group.stage_folder(&old.join("a")).unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::NotADirectory);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_device_that_takes_nothing_keeps_the_files_as_they_were() {
        let folder = folder();
        let folder = folder.path();
        let mut group = OutputGroup::default();
        write(&mut group, folder.join("a"), "new");
        write(&mut group, "/dev/full".into(), "new");
        let error = group.place().unwrap_err();
        assert_eq!(error.path, Path::new("/dev/full"));
        assert_eq!(error.error.kind(), io::ErrorKind::StorageFull);
        is(folder, &[("a", "old a"), ("b", "old b")]);
    }

    #[cfg(unix)]
    #[test]
    fn a_link_stays_and_the_file_it_leads_to_is_replaced() {
        let (folder, other) = (folder(), tempfile::tempdir().unwrap());
        let link = other.path().join("link");
        std::os::unix::fs::symlink(folder.path().join("a"), &link).unwrap();
        let mut group = OutputGroup::default();
        let staged = write(&mut group, link.clone(), "new");
        assert!(staged.starts_with(folder.path().canonicalize().unwrap()));
        group.place().unwrap();
        assert!(link.is_symlink());
        is(folder.path(), &[("a", "new"), ("b", "old b")]);
    }

    #[test]
    fn what_a_process_leaves_unfinished_is_removed_at_its_end() {
        let folder = folder();
        let mut group = OutputGroup::default();
        write(&mut group, folder.path().join("a"), "new");
        // only the own room: other tests have theirs
        let room = group.outputs[0].room.0.path().to_path_buf();
        assert!(rooms().contains(&room));
        drop(group);
        assert!(!rooms().contains(&room) && !room.exists());
    }
}
