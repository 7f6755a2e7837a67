//! What the engine is asked for.

use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;

use atomesh_job::options::RunConfig;

use crate::protocol::Command;

/// Takes an answer, or a refusal in words.
pub type Reply<T> = Box<dyn FnOnce(Result<T, String>) + Send>;

/// What the engine is asked for.
pub enum Request {
    /// A page's command; the answer is text, if it asked for some.
    Command(Command, Reply<Option<String>>),
    /// To open an image that was dropped, by its name in the session's folder.
    OpenDropped {
        /// Its name.
        name: String,
        /// The options to begin with.
        run: Box<RunConfig>,
        /// Told when it is open.
        reply: Reply<Option<String>>,
    },
    /// To write the mesh into the session's folder.
    Export {
        /// As what.
        format: Export,
        /// Told the file.
        reply: Reply<PathBuf>,
    },
    /// To end.
    End,
}

impl Request {
    /// Whether the work under way is of no use any more.
    pub fn interrupts(&self) -> bool {
        match self {
            Self::Command(command, _) => !matches!(
                command,
                Command::Atoms { .. }
                    | Command::Parts { .. }
                    | Command::CommandLine
                    | Command::Ack { .. }
            ),
            Self::OpenDropped { .. } | Self::End => true,
            Self::Export { .. } => false,
        }
    }
}

impl fmt::Debug for Request {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Command(command, _) => f.debug_tuple("Command").field(command).finish(),
            Self::OpenDropped { name, .. } => f.debug_tuple("OpenDropped").field(name).finish(),
            Self::Export { format, .. } => f.debug_tuple("Export").field(format).finish(),
            Self::End => f.write_str("End"),
        }
    }
}

/// A format that a mesh is exported in: one file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Export(&'static str);

impl Export {
    /// The endings of all formats.
    pub const ENDINGS: [&'static str; 6] = ["vtu", "vtk", "msh", "msh2", "npz", "inp"];

    /// The file's name in the session's folder.
    pub fn file_name(self) -> String {
        format!("mesh.{}", self.0)
    }
}

impl FromStr for Export {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let known = Self::ENDINGS.into_iter().find(|ending| *ending == text);
        let expected = Self::ENDINGS.join(", ");
        known.map(Self).ok_or_else(|| format!("no format {text:?}; expected one of {expected}"))
    }
}
