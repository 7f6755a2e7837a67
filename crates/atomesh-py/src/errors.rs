//! Refusals as exceptions, in the words of Python's callers.

use atomesh_job::options::RunConfig;
use atomesh_job::{ErrorKind, JobError, Note, NoteKind};
use pyo3::prelude::*;
use std::ffi::CString;

/// Options of the command that have other names as keywords.
pub const RENAMED: [(&str, &str); 7] = [
    ("mesh", "kind"),
    ("seed_point", "fixed"),
    ("side", "sides"),
    ("source", "sources"),
    ("sink", "sinks"),
    ("barrier", "barriers"),
    ("permeability", "k"),
];

/// Options of commands that are no sections of a run's options.
const OTHERS: [&str; 19] = [
    "side",
    "source",
    "sink",
    "barrier",
    "multiplier",
    "below",
    "close_gaps",
    "min_facets",
    "min_measure",
    "permeability",
    "porosity",
    "order",
    "solver",
    "solver_tolerance",
    "statistic",
    "outside",
    "region",
    "strict",
    "threads",
];

/// The keyword of an option whose name is spelt with underscores.
pub fn keyword(option: &str) -> &str {
    let renamed = RENAMED.iter().find(|(name, _)| *name == option);
    renamed.map_or(option, |(_, keyword)| keyword)
}

/// A message with the command's options, as in `--seed-point`, spelt as keywords.
pub fn in_keywords(text: &str) -> String {
    let mut parts = text.split("--");
    let mut out = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let end = part.find(|c: char| !(c.is_ascii_lowercase() || c == '-')).unwrap_or(part.len());
        let (name, rest) = part.split_at(end);
        let option = name.replace('-', "_");
        let known = RunConfig::SECTIONS.iter().any(|(_, names)| names.contains(&option.as_str()));
        if known || OTHERS.contains(&option.as_str()) {
            out += keyword(&option);
            // a placeholder for its value
            let mut after = rest.chars().skip(1);
            let is_upper = |c: Option<char>| c.is_some_and(|c| c.is_ascii_uppercase());
            if rest.starts_with(' ') && is_upper(after.next()) && is_upper(after.next()) {
                out = out + "=" + &rest[1..];
                continue;
            }
        } else {
            out = out + "--" + name;
        }
        out += rest;
    }
    out
}

/// The class of an exception of the package.
fn class<'py>(py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
    py.import("atomesh._errors")?.getattr(name)
}

/// An exception of the package's.
pub fn exception(py: Python<'_>, name: &str, message: &str) -> PyErr {
    match class(py, name).and_then(|class| class.call1((message,))) {
        Ok(exception) => PyErr::from_value(exception),
        Err(error) => error,
    }
}

/// An `InputError`.
pub fn input(py: Python<'_>, message: impl std::fmt::Display) -> PyErr {
    exception(py, "InputError", &message.to_string())
}

/// The exception for a refusal.
pub fn raise(py: Python<'_>, error: &JobError) -> PyErr {
    let name = match error.kind() {
        ErrorKind::Misuse | ErrorKind::Content => "InputError",
        ErrorKind::File | ErrorKind::ClosedPipe => "FileError",
        ErrorKind::Memory => "MemoryForecastError",
        ErrorKind::Cancelled => return exception(py, "Cancelled", "cancelled"),
        _ => "Error",
    };
    let message = match error.advice() {
        Some(advice) => format!("{error}; {advice}"),
        None => error.to_string(),
    };
    let raised = exception(py, name, &in_keywords(&message));
    if name == "FileError" {
        // as of Python's own refusals; the message stays ours
        let value = raised.value(py);
        let file = error.path().map(|path| path.to_string_lossy().into_owned());
        let _ = value.setattr("errno", error.os_code());
        let _ = value.setattr("filename", file);
    }
    raised
}

/// Says notes as warnings: what was changed or guessed as `AtomeshNote`, the rest as `AtomeshWarning`. Remarks are kept
/// with what they are about alone.
///
/// # Errors
/// The warning, where a filter makes it an exception.
pub fn warn(py: Python<'_>, notes: &[Note]) -> PyResult<()> {
    for note in notes {
        let name = match note.kind {
            NoteKind::Remark => continue,
            NoteKind::Change => "AtomeshNote",
            NoteKind::Warning => "AtomeshWarning",
        };
        let text = words(note).replace('\0', "?");
        let text = CString::new(text).expect("there is no zero byte");
        PyErr::warn(py, &class(py, name)?, &text, 1)?;
    }
    Ok(())
}

/// A note in words, without its kind.
pub fn words(note: &Note) -> String {
    let text = in_keywords(&note.text);
    match &note.file {
        Some(file) => format!("{}: {text}", file.display()),
        None => text,
    }
}
