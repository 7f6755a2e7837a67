//! How a command ends when it does not succeed.

use std::fmt;
use std::path::Path;

/// Why a command did not do its work, as the user is told.
#[derive(Clone, Debug, PartialEq)]
pub struct Failure {
    kind: Kind,
    message: String,
    advice: Option<String>,
}

/// What the exit code tells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    /// The content, the memory or the output: 1.
    Content,
    /// The options: 2.
    Misuse,
    /// Ctrl-C: 130, as shells say for an interrupt.
    Cancelled,
}

impl Failure {
    /// Content that cannot be used, memory that does not suffice, or a file that cannot be written.
    pub fn content(message: impl fmt::Display) -> Self {
        Self { kind: Kind::Content, message: message.to_string(), advice: None }
    }

    /// Options that make no sense.
    pub fn misuse(message: impl fmt::Display) -> Self {
        Self { kind: Kind::Misuse, message: message.to_string(), advice: None }
    }

    /// The user ended the work.
    pub fn cancelled() -> Self {
        Self {
            kind: Kind::Cancelled,
            message: "cancelled; no unfinished file is left".into(),
            advice: None,
        }
    }

    /// The same, with what the user might do.
    pub fn advise(mut self, advice: impl fmt::Display) -> Self {
        self.advice = Some(advice.to_string());
        self
    }

    /// The same, with the file that it is about in front.
    pub fn about(mut self, path: &Path) -> Self {
        if self.kind != Kind::Cancelled {
            self.message = format!("{}: {}", path.display(), self.message);
        }
        self
    }

    /// The exit code of the process.
    pub fn code(&self) -> u8 {
        match self.kind {
            Kind::Content => 1,
            Kind::Misuse => 2,
            Kind::Cancelled => 130,
        }
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "error: {}", self.message)?;
        match &self.advice {
            Some(advice) => write!(f, "\nadvice: {advice}"),
            None => Ok(()),
        }
    }
}
