//! Arguments in, exit code out. One file per command.

mod adapters;
mod bench;
mod bench_gpu;
mod check;
mod common;
mod describe;
mod progress;
mod render;
mod run;
mod solve;
mod table;
mod tune;

use clap::{Parser, Subcommand};
use common::{BAD_INPUT, STOPPED, complain, unsaid};
use packstone::Error;
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
}

#[derive(Subcommand)]
enum Command {
    Run(run::RunArgs),
    Check(check::CheckArgs),
    Render(render::RenderArgs),
    Describe(describe::DescribeArgs),
    Bench(bench::BenchArgs),
    Tune(tune::TuneArgs),
    Solve(solve::SolveArgs),
    Adapters(adapters::AdaptersArgs),
}

/// Run the command of the arguments.
pub fn main() -> ExitCode {
    let outcome = match Cli::parse().command {
        Command::Run(args) => run::run(&args),
        Command::Check(args) => check::check(&args),
        Command::Render(args) => render::render(&args),
        Command::Describe(args) => describe::describe(&args),
        Command::Bench(args) => bench::bench(&args),
        Command::Tune(args) => tune::tune(&args),
        Command::Solve(args) => solve::solve(&args),
        Command::Adapters(_) => adapters::adapters(),
    };
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
