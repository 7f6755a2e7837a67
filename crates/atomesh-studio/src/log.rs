//! The session's log: what was opened and done, a line each, only ever added to.
//!
//! A line is written whole, by one call, when the gesture is done. What a kill interrupts is the last line: it lacks its
//! end, and is cut off when the log is opened again. Undo and redo are lines as well.

use std::fs::{File, OpenOptions};
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use atomesh_job::JobError;
use atomesh_job::options::RunConfig;
use serde::{Deserialize, Serialize};

use crate::gesture::Gesture;

/// The version of the log's format.
const FORMAT: u32 = 1;

/// Bytes of the largest log that is read.
const MOST_BYTES: u64 = 1 << 30;

/// What is opened.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum Source {
    /// A file that the command line named.
    File {
        /// Its name; those of a dropped image are relative to the session's folder.
        path: PathBuf,
        /// SHA-256 of its bytes; none of a folder.
        sha256: Option<String>,
    },
    /// An image that was dropped, kept in the session's folder.
    Dropped {
        /// Its name there.
        name: String,
        /// SHA-256 of its bytes.
        sha256: String,
    },
    /// A synthetic image.
    Scene {
        /// The name of the scene.
        name: String,
        /// The seed of its random numbers.
        seed: u64,
    },
}

/// A line of the log.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum Entry {
    /// The first line.
    Log {
        /// The version of the format.
        format: u32,
        /// The version of the program.
        version: String,
    },
    /// An image is opened, with the options that the session begins with.
    Open {
        /// What.
        source: Source,
        /// The options.
        run: Box<RunConfig>,
    },
    /// Something is done.
    Do(Gesture),
    /// The last thing done is taken back.
    Undo,
    /// It is done again.
    Redo,
}

/// A log that is open.
#[derive(Debug)]
pub struct Log {
    file: File,
    path: PathBuf,
}

impl Log {
    /// Opens a log, or begins one, and gives what it holds.
    ///
    /// # Errors
    /// [`JobError`] if the file cannot be read or written, or is no log.
    pub fn open(path: &Path) -> Result<(Self, Vec<Entry>), JobError> {
        let mut options = OpenOptions::new();
        options.read(true).append(true).create(true);
        let opened = options.open(path).map_err(|e| JobError::unwritable(&e).about(path))?;
        let mut log = Self { file: opened, path: path.into() };
        if log.file.try_lock().is_err() {
            return Err(JobError::file("is in use by another studio").about(path));
        }
        let (entries, whole) = log.read()?;
        log.file.set_len(whole).map_err(|e| log.unwritable(&e))?;
        if whole == 0 {
            let version = env!("CARGO_PKG_VERSION").into();
            log.append(&Entry::Log { format: FORMAT, version })?;
        }
        Ok((log, entries))
    }

    /// What a log holds, whose last line may be torn.
    ///
    /// # Errors
    /// [`JobError`] if the file cannot be read, or is no log.
    pub fn read_file(path: &Path) -> Result<Vec<Entry>, JobError> {
        let file = File::open(path).map_err(|e| JobError::unreadable(&e).about(path))?;
        Self { file, path: path.into() }.read().map(|(entries, _)| entries)
    }

    /// Adds a line.
    ///
    /// # Errors
    /// [`JobError`] if it cannot be written.
    pub fn append(&mut self, entry: &Entry) -> Result<(), JobError> {
        let mut line = serde_json::to_string(entry).map_err(JobError::content)?;
        line.push('\n');
        self.file.write_all(line.as_bytes()).map_err(|e| self.unwritable(&e))
    }

    /// The entries after the first, and how many bytes the whole lines take.
    fn read(&mut self) -> Result<(Vec<Entry>, u64), JobError> {
        let path = &self.path;
        let mut bytes = Vec::new();
        self.file.seek(SeekFrom::Start(0)).map_err(|e| JobError::unreadable(&e).about(path))?;
        let mut limited = (&self.file).take(MOST_BYTES + 1);
        limited.read_to_end(&mut bytes).map_err(|e| JobError::unreadable(&e).about(path))?;
        if bytes.len() as u64 > MOST_BYTES {
            return Err(JobError::content("a log of more than 1 GiB").about(path));
        }
        let whole = bytes.iter().rposition(|byte| *byte == b'\n').map_or(0, |end| end + 1);
        let lines = bytes[..whole].split(|byte| *byte == b'\n').filter(|line| !line.is_empty());
        let mut entries = Vec::new();
        for (line, number) in lines.zip(1..) {
            let entry: Entry = serde_json::from_slice(line).map_err(|e| {
                JobError::content(format!("line {number} is none of a studio's log: {e}"))
                    .about(path)
            })?;
            match (number, entry) {
                (1, Entry::Log { format: FORMAT, .. }) => {}
                (1, Entry::Log { format, .. }) => {
                    let message = format!("a log of format {format}; expected {FORMAT}");
                    return Err(JobError::content(message).about(path));
                }
                (1, _) | (_, Entry::Log { .. }) => {
                    let message = format!("line {number} is none of a studio's log");
                    return Err(JobError::content(message).about(path));
                }
                (_, entry) => entries.push(entry),
            }
        }
        Ok((entries, whole as u64))
    }

    fn unwritable(&self, error: &std::io::Error) -> JobError {
        JobError::unwritable(error).about(&self.path)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_torn_line_is_lost_and_no_other() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log.jsonl");
        let wipe = Entry::Do(Gesture::Remove { atom: 3 });
        let (mut log, entries) = Log::open(&path).unwrap();
        assert!(entries.is_empty());
        log.append(&wipe).unwrap();
        log.append(&Entry::Undo).unwrap();
        drop(log);
        let whole = std::fs::read(&path).unwrap();
        for cut in 1..8 {
            std::fs::write(&path, &whole[..whole.len() - cut]).unwrap();
            let (mut log, entries) = Log::open(&path).unwrap();
            assert_eq!(entries, std::slice::from_ref(&wipe), "{cut} bytes short");
            log.append(&Entry::Redo).unwrap();
            assert_eq!(Log::read_file(&path).unwrap(), [wipe.clone(), Entry::Redo]);
        }
    }

    #[test]
    fn other_files_are_no_logs() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log.jsonl");
        for text in ["hello\n", "\"undo\"\n", "{\"log\":{\"format\":9,\"version\":\"9\"}}\n"] {
            std::fs::write(&path, text).unwrap();
            assert!(Log::open(&path).is_err(), "{text}");
            assert_eq!(std::fs::read_to_string(&path).unwrap(), text, "nothing is lost");
        }
    }
}
