//! `packstone man`

use super::common::show;
use clap::Command;
use clap_mangen::Man;
use std::process::ExitCode;

/// Print a page of the manual, in roff
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  packstone man | man -l -\n  packstone man run > packstone-run.1\n  packstone man bench gpu"
)]
pub struct ManArgs {
    /// Of this command, such as run or bench gpu [default: of packstone as a whole]
    command: Vec<String>,
}

pub fn man(args: &ManArgs, mut command: Command) -> anyhow::Result<ExitCode> {
    // Gives the commands below their names and what they share.
    command.build();
    let page = args.command.iter().try_fold(&command, |command, name| {
        let known = || command.get_subcommands().map(Command::get_name).collect::<Vec<_>>().join(", ");
        let found = command.find_subcommand(name);
        found.ok_or_else(|| anyhow::anyhow!("{name}: {} has no such command; it has {}", command.get_name(), known()))
    })?;
    let mut text = Vec::new();
    Man::new(page.clone()).render(&mut text)?;
    show(&text);
    Ok(ExitCode::SUCCESS)
}
