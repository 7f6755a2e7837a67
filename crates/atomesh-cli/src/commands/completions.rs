//! `atomesh completions`: what a shell needs to complete arguments.

use clap_complete::Shell;

/// Print completions for a shell
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  atomesh completions bash > ~/.local/share/bash-completion/completions/atomesh"
)]
pub struct CompletionsArgs {
    /// Shell to complete in
    #[arg(value_name = "SHELL")]
    shell: Shell,
}

/// The completions as text.
pub fn run(args: &CompletionsArgs, mut command: clap::Command) -> String {
    let mut text = Vec::new();
    clap_complete::generate(args.shell, &mut command, "atomesh", &mut text);
    String::from_utf8_lossy(&text).into_owned()
}
