//! Why a job is not done: what kind of reason, about which file, and what the user might do.

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

use atomesh::enhance::EnhanceError;
use atomesh::features::FeaturesError;
use atomesh::measure::MeasureError;
use atomesh::sample::SampleError;
use atomesh_draw::DrawError;
use atomesh_flow::FlowError;
use atomesh_flow::solve::SolveError;
use atomesh_io::image::{WriteError, WriteReason};
use atomesh_io::mesh::MeshWriteError;
use atomesh_io::surface::SurfaceWriteError;

use crate::files::shown;

/// Why a job is not done.
#[derive(Clone, Debug, PartialEq)]
pub struct JobError {
    kind: ErrorKind,
    file: Option<PathBuf>,
    message: String,
    advice: Option<String>,
    os_code: Option<i32>,
}

/// What a shell tells apart: exit codes, exceptions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ErrorKind {
    /// Options that are out of range or contradict each other.
    Misuse,
    /// An image or mesh whose content cannot be used.
    Content,
    /// A file that cannot be read or written.
    File,
    /// Work that would not fit into memory, or did not.
    Memory,
    /// The [`Watch`](atomesh::watch::Watch) ended the work.
    Cancelled,
    /// The reader of standard output or of a pipe went away.
    ClosedPipe,
}

impl JobError {
    fn new(kind: ErrorKind, message: impl fmt::Display) -> Self {
        Self { kind, file: None, message: message.to_string(), advice: None, os_code: None }
    }

    /// Options that are out of range or contradict each other.
    pub fn misuse(message: impl fmt::Display) -> Self {
        Self::new(ErrorKind::Misuse, message)
    }

    /// An image or mesh whose content cannot be used.
    pub fn content(message: impl fmt::Display) -> Self {
        Self::new(ErrorKind::Content, message)
    }

    /// A file that cannot be read or written.
    pub fn file(message: impl fmt::Display) -> Self {
        Self::new(ErrorKind::File, message)
    }

    /// A file that the system does not let be read.
    pub fn unreadable(error: &io::Error) -> Self {
        Self::file(format!("cannot be read: {error}")).by_system(error)
    }

    /// The same, with the system's number for what it refused.
    pub(crate) fn by_system(mut self, error: &io::Error) -> Self {
        self.os_code = error.raw_os_error();
        self
    }

    /// A file that the system does not let be written, with what might help.
    pub fn unwritable(error: &io::Error) -> Self {
        use io::ErrorKind::{
            BrokenPipe, FileTooLarge, InvalidFilename, NotFound, PermissionDenied, QuotaExceeded,
            ReadOnlyFilesystem, StorageFull,
        };
        let refusal = Self::file(format!("cannot be written: {error}")).by_system(error);
        match error.kind() {
            BrokenPipe => Self::new(ErrorKind::ClosedPipe, "the reader went away"),
            StorageFull | QuotaExceeded => refusal.advise("make room, or choose another folder"),
            FileTooLarge => refusal.advise("the limit on file sizes (ulimit -f) is too low"),
            InvalidFilename => refusal.advise("choose a shorter name"),
            // a link that leads nowhere has its own words
            NotFound if error.get_ref().is_none() => refusal.advise("make its folder first"),
            PermissionDenied | ReadOnlyFilesystem => {
                refusal.advise("choose a folder that may be written to")
            }
            _ => refusal,
        }
    }

    /// Work that does not fit into memory.
    pub fn memory(message: impl fmt::Display) -> Self {
        Self::new(ErrorKind::Memory, message)
    }

    /// The watch ended the work.
    pub fn cancelled() -> Self {
        Self::new(ErrorKind::Cancelled, "cancelled; no unfinished file is left")
    }

    /// The same, with what the user might do.
    pub fn advise(mut self, advice: impl fmt::Display) -> Self {
        self.advice = Some(advice.to_string());
        self
    }

    /// The same, about a file, unless it is about one already, or what it is about is in memory and has no name.
    pub fn about(mut self, file: &Path) -> Self {
        if self.kind != ErrorKind::Cancelled && !file.as_os_str().is_empty() {
            self.file.get_or_insert_with(|| file.into());
        }
        self
    }

    /// The same, about the file that `other` gives for the one it is about, if it gives one.
    pub(crate) fn renamed(mut self, other: impl FnOnce(&Path) -> Option<PathBuf>) -> Self {
        let renamed = self.file.as_deref().and_then(other);
        self.file = renamed.or(self.file);
        self
    }

    /// The same, about a file if its content is to blame.
    pub(crate) fn about_content(self, file: &Path) -> Self {
        if self.kind == ErrorKind::Content { self.about(file) } else { self }
    }

    /// [`JobError::about`] where there is a file: inputs may be in memory.
    pub fn about_any(self, file: Option<&Path>) -> Self {
        match file {
            Some(file) => self.about(file),
            None => self,
        }
    }

    /// What kind of reason it is.
    pub fn kind(&self) -> ErrorKind {
        self.kind
    }

    /// The file that it is about.
    pub fn path(&self) -> Option<&Path> {
        self.file.as_deref()
    }

    /// The system's number (errno) for what it refused, if that was the reason.
    pub fn os_code(&self) -> Option<i32> {
        self.os_code
    }

    /// What the user might do.
    pub fn advice(&self) -> Option<&str> {
        self.advice.as_deref()
    }
}

/// The file, if there is one, and the message; without the advice.
impl fmt::Display for JobError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(file) = &self.file {
            write!(f, "{}: ", shown(file))?;
        }
        f.write_str(&self.message)
    }
}

impl std::error::Error for JobError {}

/// Whether an option is to blame, and not the image.
pub(crate) fn is_option(error: &EnhanceError) -> bool {
    use EnhanceError::{Denoise, EdgeScale, Option, Smooth};
    matches!(error, EdgeScale { .. } | Smooth { .. } | Denoise(_) | Option { .. })
}

impl From<EnhanceError> for JobError {
    fn from(error: EnhanceError) -> Self {
        match error {
            EnhanceError::Cancelled(_) => Self::cancelled(),
            _ if is_option(&error) => Self::misuse(error),
            _ => Self::content(error),
        }
    }
}

impl From<MeasureError> for JobError {
    fn from(error: MeasureError) -> Self {
        match error {
            MeasureError::Cancelled(_) => Self::cancelled(),
            _ => Self::content(error),
        }
    }
}

impl From<SampleError> for JobError {
    fn from(error: SampleError) -> Self {
        match error {
            SampleError::Cancelled(_) => Self::cancelled(),
            _ => Self::content(error),
        }
    }
}

impl From<FeaturesError> for JobError {
    fn from(error: FeaturesError) -> Self {
        match error {
            FeaturesError::Cancelled(_) => Self::cancelled(),
            FeaturesError::PointCount { .. } => Self::content(error),
            _ => Self::misuse(error),
        }
    }
}

impl From<DrawError> for JobError {
    fn from(error: DrawError) -> Self {
        Self::content(error)
    }
}

impl From<FlowError> for JobError {
    fn from(error: FlowError) -> Self {
        match &error {
            FlowError::Cancelled(_) | FlowError::Solve(SolveError::Cancelled(_)) => {
                Self::cancelled()
            }
            FlowError::Group { .. }
            | FlowError::Place { .. }
            | FlowError::Multiplier { .. }
            | FlowError::NotFinite { .. }
            | FlowError::WellOutside { .. }
            | FlowError::WellRadius { .. }
            | FlowError::Order { .. }
            | FlowError::Tensor => Self::misuse(error),
            FlowError::Solve(SolveError::Memory { .. }) => Self::memory(error),
            FlowError::Unbalanced { .. } => Self::content(error).advise(
                "give a pressure by --side or --sink ...:pressure=P:radius=R, open a barrier by --barrier \
                 NAME=M or --multiplier, or move the wells",
            ),
            _ => Self::content(error),
        }
    }
}

impl From<MeshWriteError> for JobError {
    fn from(error: MeshWriteError) -> Self {
        match error {
            MeshWriteError::Cancelled(_) => Self::cancelled(),
            MeshWriteError::Io(e) => Self::unwritable(&e),
            _ => Self::content(error),
        }
    }
}

impl From<SurfaceWriteError> for JobError {
    fn from(error: SurfaceWriteError) -> Self {
        match error {
            SurfaceWriteError::Cancelled(_) => Self::cancelled(),
            SurfaceWriteError::Io(e) => Self::unwritable(&e),
            _ => Self::content(error),
        }
    }
}

impl From<WriteError> for JobError {
    fn from(error: WriteError) -> Self {
        let WriteError { path, reason, .. } = error;
        match reason {
            WriteReason::Cancelled(_) => Self::cancelled(),
            WriteReason::Io(e) => Self::unwritable(&e),
            _ => Self::content(reason),
        }
        .about(&path)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_file_named_is_the_one_it_is_about() {
        let error = JobError::content("is bad").about(Path::new("a")).about(Path::new("b"));
        assert_eq!(error.to_string(), "a: is bad");
        assert_eq!(JobError::cancelled().about(Path::new("a")).path(), None);
    }
}
