//! Arguments in, exit code out. One file per command.

mod adapters;
mod bench;
mod bench_gpu;
mod check;
mod common;
mod completions;
mod describe;
mod from;
mod last;
mod man;
mod measure;
mod progress;
mod render;
mod run;
mod solve;
mod study;
mod table;
mod tune;

use clap::{CommandFactory, Parser, Subcommand};
use common::{BAD_INPUT, STOPPED, be_quiet, complain, unsaid};
use packstone::{Error, gpu, simulation::EngineChoice};
use std::process::ExitCode;

/// Simulate packings of grains with the discrete element method, on GPU or CPU.
#[derive(Parser)]
#[command(
    version,
    after_help = "Exit codes: 0 done, 1 run stopped or output not written, check exceeded, bench failed or tune without success, 2 bad input, 3 solve without convergence, 130 interrupted."
)]
struct Cli {
    #[command(subcommand)]
    command: Command,
    /// Take this GPU adapter: its number in the list of packstone adapters, or a part of its name, in capitals or not
    #[arg(long, value_name = "NAME|INDEX", global = true)]
    adapter: Option<String>,
    /// Print only results, what makes them doubtful, and errors: no progress, no notices
    #[arg(short, long, global = true)]
    quiet: bool,
}

#[derive(Subcommand)]
enum Command {
    Run(run::RunArgs),
    Check(check::CheckArgs),
    Measure(measure::MeasureArgs),
    Render(render::RenderArgs),
    Describe(describe::DescribeArgs),
    Bench(bench::BenchArgs),
    Tune(tune::TuneArgs),
    Solve(solve::SolveArgs),
    Study(study::StudyArgs),
    Adapters(adapters::AdaptersArgs),
    Completions(completions::CompletionsArgs),
    Man(man::ManArgs),
}

impl Command {
    /// The engine that it is told to run on, if it is told one.
    fn engine(&self) -> Option<EngineChoice> {
        match self {
            // A run that goes on has its own.
            Command::Run(run::RunArgs { resume: None, engine, .. }) => Some(*engine),
            Command::Describe(args) => Some(args.engine),
            Command::Solve(args) => Some(args.engine),
            _ => None,
        }
    }
}

/// Make the adapter that is asked for the only one.
fn select(cli: &Cli) -> packstone::Result<()> {
    match &cli.adapter {
        Some(adapter) if cli.command.engine() == Some(EngineChoice::Cpu) => Err(Error::Lacking(format!(
            "--adapter {adapter}: the cpu engine has no use for an adapter; use --engine gpu"
        ))),
        Some(adapter) => gpu::select(adapter),
        None => Ok(()),
    }
}

/// A file that has grown as long as the system lets it (`ulimit -f`) is an error in writing, not the end of the program
/// without a word.
#[cfg(unix)]
fn outlive_limits() {
    use signal_hook::{consts::SIGXFSZ, flag};
    // A signal that somebody listens to ends nothing; where that cannot be had it is as it was.
    let _ = flag::register(SIGXFSZ, std::sync::Arc::default());
}

#[cfg(not(unix))]
fn outlive_limits() {}

/// Run the command of the arguments.
pub fn main() -> ExitCode {
    outlive_limits();
    let cli = Cli::parse();
    if cli.quiet {
        be_quiet();
    }
    let outcome = select(&cli).map_err(anyhow::Error::from).and_then(|()| match &cli.command {
        Command::Run(args) => run::run(args),
        Command::Check(args) => check::check(args),
        Command::Measure(args) => measure::measure(args),
        Command::Render(args) => render::render(args),
        Command::Describe(args) => describe::describe(args),
        Command::Bench(args) => bench::bench(args),
        Command::Tune(args) => tune::tune(args),
        Command::Solve(args) => solve::solve(args),
        Command::Study(args) => study::study(args),
        Command::Adapters(_) => adapters::adapters(),
        Command::Completions(args) => completions::completions(args, &mut Cli::command()),
        Command::Man(args) => man::man(args, Cli::command()),
    });
    let code = outcome.unwrap_or_else(|error| {
        complain(&error);
        let stopped = matches!(error.downcast_ref(), Some(Error::Run { .. }));
        ExitCode::from(if stopped { STOPPED } else { BAD_INPUT })
    });
    match unsaid() {
        Some(error) => {
            complain(format!("standard output: {error}"));
            if code == ExitCode::SUCCESS { ExitCode::from(STOPPED) } else { code }
        }
        None => code,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Command;

    /// A command and all those below it, with their names.
    fn walk(command: &Command, path: &str, see: &mut impl FnMut(&str, &Command)) {
        let path = format!("{path} {}", command.get_name());
        see(path.trim(), command);
        command.get_subcommands().for_each(|below| walk(below, &path, see));
    }

    /// It is for a terminal: what rustdoc makes links and code of would be seen as it is.
    #[test]
    fn help_has_no_rustdoc_in_it() {
        let mut seen = 0;
        walk(&Cli::command(), "", &mut |path, command| {
            let help = command.clone().render_long_help().to_string();
            for syntax in ["[`", "::", "`"] {
                assert!(!help.contains(syntax), "{path}: {syntax} in\n{help}");
            }
            seen += 1;
        });
        assert!(seen >= 15, "{seen} commands");
    }

    #[test]
    fn the_command_line_is_well_formed() {
        Cli::command().debug_assert();
    }
}
