//! The command `atomesh`, from within Python.

use std::ffi::OsString;

use pyo3::prelude::*;

/// Runs the command with these arguments, the program's name first, and gives its exit code. It takes over the
/// process's signals and threads: for the entry point alone.
#[pyfunction]
pub fn run_command(py: Python<'_>, arguments: Vec<OsString>) -> u8 {
    py.detach(|| atomesh_cli::run(arguments))
}
