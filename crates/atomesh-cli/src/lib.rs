//! The command `atomesh`: from an image to a mesh that follows it.
//!
//! Arguments in, text out: each command takes its options from the command line, calls a job, and says what
//! became of it. Standard output carries what was asked for; progress, notes, summaries and
//! errors go to standard error. Exit codes: 0; 1 for content, files or memory; 2 for options; 128 and the
//! signal after one, which is 130 for Ctrl-C and 143 for a request to terminate.

mod commands;
mod progress;
mod words;

use std::ffi::OsString;
use std::io::Write;

use atomesh_job::{ErrorKind, JobError};
use clap::{CommandFactory, Parser, Subcommand};

use progress::{Progress, Verbosity, catch_signals};
use words::{exit_code, refusal, say};

/// Meshes aligned with images.
#[derive(Debug, Parser)]
#[command(name = "atomesh", version, arg_required_else_help = true, max_term_width = 100)]
struct Cli {
    #[command(subcommand)]
    command: Command,
    /// Print nothing but errors
    #[arg(short, long, global = true, conflicts_with = "verbose", help_heading = "Run")]
    quiet: bool,
    /// Print a line for every phase, with its time
    #[arg(short, long, global = true, help_heading = "Run")]
    verbose: bool,
    /// Write nothing, with exit code 1, if there are warnings, or notes that something was changed, guessed, filled,
    /// left out or not met
    #[arg(long, global = true, help_heading = "Run")]
    strict: bool,
    /// Threads to use, 1 to 1024; the result is the same with any number. Default: one per core
    #[arg(long, global = true, value_name = "COUNT", help_heading = "Run",
        value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
}

#[derive(Debug, Subcommand)]
enum Command {
    Mesh(Box<commands::mesh::MeshArgs>),
    Enhance(Box<commands::enhance::EnhanceArgs>),
    Features(Box<commands::features::FeaturesArgs>),
    Clusters(Box<commands::clusters::ClustersArgs>),
    Surfaces(commands::surfaces::SurfacesArgs),
    Flow(Box<commands::flow::FlowArgs>),
    Report(Box<commands::report::ReportArgs>),
    Sample(Box<commands::sample::SampleArgs>),
    Export(Box<commands::export::ExportArgs>),
    Info(Box<commands::info::InfoArgs>),
    Check(commands::check::CheckArgs),
    Synth(commands::synth::SynthArgs),
    #[cfg(feature = "studio")]
    Studio(Box<commands::studio::StudioArgs>),
    #[cfg(feature = "studio")]
    Replay(commands::replay::ReplayArgs),
    Completions(commands::completions::CompletionsArgs),
    Man(commands::man::ManArgs),
}

impl Command {
    /// Whether it writes what there may be notes about.
    fn has_notes(&self) -> bool {
        #[cfg(feature = "studio")]
        if matches!(self, Self::Studio(_) | Self::Replay(_)) {
            return false;
        }
        !matches!(self, Self::Info(_) | Self::Check(_) | Self::Completions(_) | Self::Man(_))
    }
}

impl Cli {
    fn verbosity(&self) -> Verbosity {
        match (self.quiet, self.verbose) {
            (true, _) => Verbosity::Quiet,
            (_, true) => Verbosity::Verbose,
            _ => Verbosity::Normal,
        }
    }

    fn run(self) -> Result<String, JobError> {
        let mut watch = Progress::new(self.verbosity(), self.strict);
        if self.strict && !self.command.has_notes() {
            let message =
                "--strict is for commands that write meshes, images or reports; expected none";
            return Err(JobError::misuse(message));
        }
        let result = match self.command {
            Command::Mesh(args) => commands::mesh::run(*args, &mut watch),
            Command::Enhance(args) => commands::enhance::run(*args, &mut watch),
            Command::Features(args) => commands::features::run(*args, &mut watch),
            Command::Clusters(args) => commands::clusters::run(*args, &mut watch),
            Command::Surfaces(args) => commands::surfaces::run(args, &mut watch),
            Command::Flow(args) => commands::flow::run(*args, &mut watch),
            Command::Report(args) => commands::report::run(*args, &mut watch),
            Command::Sample(args) => commands::sample::run(*args, &mut watch),
            Command::Export(args) => commands::export::run(&args, &mut watch),
            Command::Info(args) => commands::info::run(&args, &mut watch),
            Command::Check(args) => commands::check::run(&args, &mut watch),
            Command::Synth(args) => commands::synth::run(args, &mut watch),
            #[cfg(feature = "studio")]
            Command::Studio(args) => commands::studio::run(*args, &mut watch),
            #[cfg(feature = "studio")]
            Command::Replay(args) => commands::replay::run(&args, &mut watch),
            Command::Completions(args) => Ok(commands::completions::run(&args, Cli::command())),
            Command::Man(args) => commands::man::run(&args, Cli::command()),
        };
        watch.finish();
        result
    }
}

/// Runs the command with these arguments, the program's name first, and gives its exit code.
///
/// It takes over the process: signals, the panic hook, and the threads that all parallel work runs on.
pub fn run(arguments: impl IntoIterator<Item = OsString>) -> u8 {
    std::panic::set_hook(Box::new(|info| {
        say(format_args!("error: {info}\nadvice: this is a bug in atomesh; please report it"));
    }));
    let cli = match Cli::try_parse_from(arguments) {
        Ok(cli) => cli,
        Err(error) => {
            // help and version are answers, on standard output
            let _ = error.print();
            return error.exit_code() as u8;
        }
    };
    catch_signals();
    let threads = cli.threads.map_or(0, usize::from);
    // 0 lets rayon choose; it fails only if it was built before
    let _ = rayon::ThreadPoolBuilder::new().num_threads(threads).build_global();
    match std::panic::catch_unwind(|| cli.run()) {
        Ok(Ok(text)) => print(&text),
        Ok(Err(error)) => {
            // who closed a pipe wants no more of it, words about it neither
            if error.kind() != ErrorKind::ClosedPipe {
                say(refusal(&error));
            }
            exit_code(&error)
        }
        Err(_) => 1,
    }
}

/// Prints on standard output; a reader that goes away early is not an error.
fn print(text: &str) -> u8 {
    let mut out = std::io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(e) if e.kind() != std::io::ErrorKind::BrokenPipe => {
            say(format_args!("error: standard output cannot be written: {e}"));
            1
        }
        _ => 0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use atomesh_io::image::ImageFormat;
    use atomesh_job::options::RunConfig;
    use clap::Args;

    #[test]
    fn the_arguments_are_consistent() {
        Cli::command().debug_assert();
    }

    #[test]
    fn every_name_that_help_offers_is_understood() {
        let command = Cli::command();
        let mesh = command.find_subcommand("mesh").expect("there is a mesh command");
        let mut names = 0;
        let takes_value = |a: &&clap::Arg| a.get_long().is_some() && a.get_action().takes_values();
        for option in mesh.get_arguments().filter(takes_value) {
            for value in option.get_possible_values() {
                let text = format!("--{}={}", option.get_long().unwrap(), value.get_name());
                let parsed = Cli::try_parse_from(["atomesh", "mesh", "a.png", &text]);
                assert!(parsed.is_ok(), "{text}: {}", parsed.unwrap_err());
                names += 1;
            }
        }
        assert!(names > 20, "{names}");
    }

    /// The words of a text that are file extensions.
    fn extensions(text: &str) -> Vec<&str> {
        let words = text.split([' ', ',', ':', ';']).map(|word| word.trim_end_matches('.'));
        words.filter(|word| word.starts_with('.')).collect()
    }

    #[test]
    fn help_names_all_image_formats_that_are_written() {
        let command = Cli::command();
        for (name, option, floats) in [
            ("mesh", "write_potential", true),
            ("enhance", "output", true),
            ("synth", "output", false),
        ] {
            let subcommand = command.find_subcommand(name).unwrap();
            let option = subcommand.get_arguments().find(|a| a.get_id() == option).unwrap();
            let help = option.get_help().unwrap().to_string();
            let known = ImageFormat::usual_written_endings(" ", floats);
            let (stated, known) = (extensions(&help), extensions(&known));
            assert!(
                known.iter().all(|ending| stated.contains(ending)),
                "{name}: {help}; {known:?}"
            );
            assert!(
                stated.iter().all(|ending| known.contains(ending)),
                "{name}: {help}; {known:?}"
            );
        }
    }

    /// The defaults of a dimension by option.
    fn defaults<const D: usize>() -> Vec<(String, String)> {
        let run = RunConfig::default().with_defaults::<D>();
        let tables = serde_json::to_value(run).unwrap();
        let options = tables.as_object().unwrap().values().flat_map(|t| t.as_object().unwrap());
        options
            .map(|(name, value)| {
                (name.clone(), value.as_str().map_or_else(|| value.to_string(), str::to_owned))
            })
            .collect()
    }

    #[test]
    fn help_states_the_defaults_that_are_used() {
        let command = RunConfig::augment_args(clap::Command::new("mesh"));
        for (name, value) in [defaults::<2>(), defaults::<3>()].concat() {
            let option = command.get_arguments().find(|a| a.get_long() == Some(&name));
            let help = option.unwrap().get_help().unwrap().to_string();
            let (_, stated) = help.split_once("Default: ").unwrap_or_else(|| panic!("{name}"));
            let words: Vec<&str> = stated.split([' ', ',', ';']).collect();
            let stated: Vec<f64> = stated.split([' ', ',', ';']).flat_map(str::parse).collect();
            let same = match value.parse::<f64>() {
                Ok(value) => stated.contains(&value),
                Err(_) => words.contains(&value.as_str()),
            };
            assert!(same, "--{name} is {value}; help says: {help}");
        }
    }
}
