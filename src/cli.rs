//! Arguments in, exit code out. One file per command.

mod adapters;
mod bench;
mod check;
mod describe;
mod progress;
mod render;
mod run;
mod solve;
mod table;
mod tune;

use clap::{
    Args, Parser, Subcommand,
    builder::{PossibleValuesParser, TypedValueParser},
};
use packstone::{
    Error,
    gpu::Arrays,
    model::Precision,
    scene::{Assembly, Scene},
    simulation::{EngineChoice, Options},
};
use std::{
    fmt::Display,
    io::Write,
    path::{Path, PathBuf},
    process::ExitCode,
};

/// Exit codes besides 0; 2 is also clap's for wrong usage.
const STOPPED: u8 = 1;
const BAD_INPUT: u8 = 2;
const UNCONVERGED: u8 = 3;
const INTERRUPTED: u8 = 130;

/// Simulate packings of grains with the discrete element method, on GPU or CPU.
#[derive(Parser)]
#[command(
    version,
    after_help = "Exit codes: 0 done, 1 run stopped, check exceeded, bench failed or tune without success, 2 bad input, 3 solve without convergence, 130 interrupted."
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
    outcome.unwrap_or_else(|error| {
        complain(&error);
        let stopped = matches!(error.downcast_ref(), Some(Error::Run { .. }));
        ExitCode::from(if stopped { STOPPED } else { BAD_INPUT })
    })
}

/// What it takes to read a scene.
#[derive(Args)]
struct SceneArgs {
    /// Scene file
    scene: PathBuf,
    /// Change a value of the scene, such as solver.dt=1e-6; may be repeated
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Arithmetic of the GPU; the CPU always computes in double
    #[arg(long, default_value = "single", value_parser = precisions())]
    precision: Precision,
    /// What arrays are on the device; images are faster on software drivers
    #[arg(long, value_enum, default_value_t)]
    arrays: Arrays,
}

impl SceneArgs {
    /// How to run it, as far as the command line says so here.
    fn options(&self) -> Options {
        Options { precision: self.precision, arrays: self.arrays, ..Options::default() }
    }

    /// The scene with `--set` and `more` of the kind applied, and what it comes down to.
    fn load(&self, more: &[String]) -> anyhow::Result<(Scene, Assembly)> {
        let scene = Scene::load(&self.scene, &[&self.set, more].concat())?;
        let assembly = scene.assemble()?;
        Ok((scene, assembly))
    }
}

fn precisions() -> impl TypedValueParser<Value = Precision> {
    PossibleValuesParser::new(Precision::ALL.iter().map(|p| p.label()))
        .map(|label| *Precision::ALL.iter().find(|p| p.label() == label).expect("clap lets only labels through"))
}

/// Those of "auto", "gpu" and "cpu" that a command knows.
fn engines<const N: usize>(names: [&'static str; N]) -> impl TypedValueParser<Value = EngineChoice> {
    PossibleValuesParser::new(names).map(|name| match name.as_str() {
        "gpu" => EngineChoice::Gpu,
        "cpu" => EngineChoice::Cpu,
        _ => EngineChoice::Auto,
    })
}

/// A line on the standard output. That nobody reads it any more (`| head`) is no reason to panic.
fn say(line: impl Display) {
    let _ = writeln!(std::io::stdout().lock(), "{line}");
}

/// An error, on one line.
fn complain(error: impl Display) {
    let line = error.to_string().lines().map(str::trim).collect::<Vec<_>>().join(" ");
    eprintln!("error: {line}");
}

/// The name of a file without folder and ending.
fn stem(path: &Path) -> String {
    path.file_stem().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}
