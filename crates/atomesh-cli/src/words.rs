//! How a command ends when its work is not done: in words, and by its exit code.

use std::fmt::Display;
use std::io::Write;

use atomesh_job::{ErrorKind, JobError};

use crate::progress::signal;

/// Prints a line on standard error; nobody is told if that is closed.
pub fn say(line: impl Display) {
    let _ = writeln!(std::io::stderr(), "{line}");
}

/// What the user is told.
pub fn refusal(error: &JobError) -> String {
    match error.advice() {
        Some(advice) => format!("error: {error}\nadvice: {advice}"),
        None => format!("error: {error}"),
    }
}

/// The exit code of the process: 128 and the signal that ended it, as shells say, which is 130 for Ctrl-C; 2 for
/// options; else 1.
pub fn exit_code(error: &JobError) -> u8 {
    match error.kind() {
        ErrorKind::Misuse => 2,
        ErrorKind::Cancelled => 128 + signal(),
        _ => 1,
    }
}

/// A time in words.
pub fn seconds(time: std::time::Duration) -> impl Display {
    format!("{:.2} s", time.as_secs_f64())
}
