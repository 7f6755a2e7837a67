//! `atomesh studio`: an image and its mesh in a browser page.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

use atomesh_job::JobError;
use atomesh_job::options::{
    FrameOptions, ImprovementOptions, InputOptions, LatticeOptions, OptimizerOptions,
    PotentialOptions, RegionOptions, RunConfig,
};
use atomesh_studio::log::Source;
use atomesh_studio::{Server, Session};

use crate::progress::{Progress, is_signalled};
use crate::words::say;

/// How long the studio waits without a page before it ends.
const PATIENCE: Duration = Duration::from_secs(600);

/// See an image and its mesh, tune, paint, and edit atoms, in a browser page
///
/// The page is served by this process to this machine alone. It can only read what is named here or dropped on it, and only
/// writes into the session's folder, where everything that is done is logged as it is done. Start it again with the same
/// session to go on. It ends with Ctrl-C, or ten minutes after the last page was closed.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES, allow_negative_numbers = true)]
pub struct StudioArgs {
    #[command(flatten, next_help_heading = "Input")]
    input: InputOptions,
    #[command(flatten, next_help_heading = "Lattice")]
    lattice: LatticeOptions,
    #[command(flatten, next_help_heading = "Features")]
    features: PotentialOptions,
    #[command(flatten, next_help_heading = "Regions")]
    regions: RegionOptions,
    #[command(flatten, next_help_heading = "Frame")]
    frame: FrameOptions,
    #[command(flatten, next_help_heading = "Optimisation")]
    optimize: OptimizerOptions,
    #[command(flatten, next_help_heading = "Improvement")]
    improve: ImprovementOptions,
    /// Folder of the session: its log, dropped images and exports. Default: NAME-studio for an image NAME.png,
    /// atomesh-studio without one
    #[arg(long, value_name = "FOLDER", help_heading = "Run")]
    session: Option<PathBuf>,
    /// Do not open a browser; the address is printed
    #[arg(long, help_heading = "Run")]
    no_open: bool,
}

const EXAMPLES: &str = "\
Examples:
  atomesh studio faults.png --size 8
  atomesh studio t1.nii.gz --features edges --session brain
  Without a browser, the mesh of a session:
    atomesh replay faults-studio/log.jsonl -o faults.vtu";

/// Runs the command; the text is for standard output.
///
/// # Errors
/// [`JobError`] if options make no sense, a file cannot be used, or the user ends the work.
pub fn run(args: StudioArgs, progress: &mut Progress) -> Result<String, JobError> {
    let StudioArgs { input, lattice, features, regions, frame, optimize, improve, .. } = args;
    let output = Default::default();
    let mut run = RunConfig { input, output, lattice, features, regions, frame, optimize, improve };
    if run.input.image.is_none() && run.input.potential.is_none() && run.input.labels.is_some() {
        run.follow_labels();
    }
    if let Some(path) = run.input.shown() {
        // before a folder is made for it
        std::fs::metadata(path).map_err(|e| JobError::unreadable(&e).about(path))?;
    }
    let folder = args.session.unwrap_or_else(|| default_folder(run.input.shown()));
    let mut session = Session::open(&folder, progress)?;
    match session.source() {
        Some(source) => check_same(source, &run, &folder)?,
        None if run.input.shown().is_some() => session.open_file(run, progress)?,
        None if run == RunConfig::default() => {}
        None => return Err(JobError::misuse("options without an image; expected IMAGE too")),
    }
    progress.finish();
    let unserved = |e| JobError::file(format!("the loopback cannot be served: {e}"));
    let server = Server::new(session, PATIENCE).map_err(unserved)?;
    let address = server.address();
    say(format_args!("session in {}", folder.display()));
    say(format_args!("open {address}"));
    if !args.no_open {
        open(&address);
    }
    server.run(is_signalled).map_err(unserved)?;
    if is_signalled() { Err(JobError::cancelled()) } else { Ok(String::new()) }
}

/// The folder of a session on an image.
fn default_folder(image: Option<&Path>) -> PathBuf {
    let name = image.and_then(Path::file_name).map(|name| name.to_string_lossy().into_owned());
    let name = name.unwrap_or_else(|| "atomesh".into());
    let stem = name.split('.').next().filter(|stem| !stem.is_empty()).unwrap_or("atomesh");
    format!("{stem}-studio").into()
}

/// Refuses a session that was begun on another image, or options for one that has begun.
fn check_same(source: &Source, run: &RunConfig, folder: &Path) -> Result<(), JobError> {
    let Some(shown) = run.input.shown() else { return Ok(()) };
    let shown = std::path::absolute(shown).map_err(|e| JobError::unreadable(&e).about(shown))?;
    if !matches!(source, Source::File { path, .. } if *path == shown) {
        return Err(JobError::misuse("is the session of another image")
            .about(folder)
            .advise("choose another folder by --session, or leave out the image to go on"));
    }
    let image = InputOptions { image: run.input.image.clone(), ..InputOptions::default() };
    if *run != (RunConfig { input: image, ..RunConfig::default() }) {
        return Err(JobError::misuse("has begun, with options of its own; expected none here")
            .about(folder)
            .advise("begin another by --session FOLDER"));
    }
    Ok(())
}

/// Asks the desktop to open an address; without one the user does.
fn open(address: &str) {
    let (program, before): (&str, &[&str]) = match () {
        () if cfg!(target_os = "macos") => ("open", &[]),
        () if cfg!(windows) => ("rundll32", &["url.dll,FileProtocolHandler"]),
        () => ("xdg-open", &[]),
    };
    let mut command = Command::new(program);
    command.args(before).arg(address);
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    if let Ok(mut child) = command.spawn() {
        std::thread::spawn(move || child.wait());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_folder_is_called_as_the_image() {
        let of = |name: &str| default_folder(Some(Path::new(name)));
        assert_eq!(of("a/faults.png"), PathBuf::from("faults-studio"));
        assert_eq!(of("t1.nii.gz"), PathBuf::from("t1-studio"));
        assert_eq!(default_folder(None), PathBuf::from("atomesh-studio"));
    }

    #[test]
    fn a_session_is_of_one_image_and_keeps_its_options() {
        let path = std::path::absolute("a.png").unwrap();
        let source = Source::File { path, sha256: None };
        let run = |text: &str, name: &str| {
            let mut run = RunConfig::parse(text).unwrap();
            run.input.image = Some(name.into());
            check_same(&source, &run, Path::new("s"))
        };
        assert!(run("", "a.png").is_ok());
        assert!(run("", "b.png").unwrap_err().to_string().contains("another image"));
        assert!(run("[lattice]\nsize = 8.0", "a.png").unwrap_err().to_string().contains("begun"));
    }
}
