//! The command `atomesh`, as a program of its own; all of it is in the library.

use std::process::ExitCode;

fn main() -> ExitCode {
    ExitCode::from(atomesh_cli::run(std::env::args_os()))
}
