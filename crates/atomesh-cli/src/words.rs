//! How a command ends when its work is not done: in words, and by its exit code.

use std::fmt::Display;

use atomesh_job::{ErrorKind, JobError};

/// What the user is told.
pub fn refusal(error: &JobError) -> String {
    match error.advice() {
        Some(advice) => format!("error: {error}\nadvice: {advice}"),
        None => format!("error: {error}"),
    }
}

/// The exit code of the process: 130, as shells say for an interrupt, after Ctrl-C; 2 for options; else 1.
pub fn exit_code(error: &JobError) -> u8 {
    match error.kind() {
        ErrorKind::Misuse => 2,
        ErrorKind::Cancelled => 130,
        _ => 1,
    }
}

/// A time in words.
pub fn seconds(time: std::time::Duration) -> impl Display {
    format!("{:.2} s", time.as_secs_f64())
}
