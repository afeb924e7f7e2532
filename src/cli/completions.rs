//! `packstone completions`

use super::common::show;
use clap::Command;
use clap_complete::{Shell, generate};
use std::process::ExitCode;

/// Print what a shell needs to complete arguments
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  \
                        packstone completions bash > ~/.local/share/bash-completion/completions/packstone\n  \
                        packstone completions zsh > _packstone, in a folder of $fpath\n  \
                        packstone completions fish > ~/.config/fish/completions/packstone.fish")]
pub struct CompletionsArgs {
    /// For which shell
    #[arg(value_enum)]
    shell: Shell,
}

pub fn completions(args: &CompletionsArgs, command: &mut Command) -> anyhow::Result<ExitCode> {
    let mut text = Vec::new();
    generate(args.shell, command, "packstone", &mut text);
    show(&text);
    Ok(ExitCode::SUCCESS)
}
