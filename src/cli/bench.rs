//! `packstone bench`

use super::bench_gpu::{GpuArgs, gpu};
use super::common::{INTERRUPTED, STOPPED, SceneArgs, complain, say, tell};
use super::run::{interrupted, listen};
use packstone::{
    bench::{self, Effort, Point, Suite, hard, report, traffic},
    simulation::LISTS_ABREAST,
};
use std::{ops::ControlFlow, path::PathBuf, process::ExitCode};

/// Speed beside error: fixed cases over engine, precision and time step
#[derive(clap::Args)]
#[command(
    args_conflicts_with_subcommands = true,
    disable_help_subcommand = true,
    after_help = "Suites:\n  \
    local       force and moment on the same state\n  \
    trajectory  closed forms, and a collapse against a fine reference\n  \
    invariants  energy and momenta of elastic gases, energy balance of rough grains\n  \
    ensembles   settled beds, averaged over seeds\n  \
    speed       particle-steps/s against the number of grains, stage by stage\n  \
    sizes       wide sizes against equal ones: time and memory of a particle-step\n  \
    relaxation  contact dynamics: residual of a step against wall time, solver by solver\n  \
    precision   what single precision loses: closed forms, and energy and momentum over long runs\n\n\
    Examples:\n  packstone bench --quick\n  packstone bench trajectory speed --out out/here\n  packstone bench hard gas\n  packstone bench gpu --out out/gpu\n\n\
    Ctrl-C ends after the run that is under way, with a report of what was measured; a second one at once, without."
)]
pub struct BenchArgs {
    #[command(subcommand)]
    command: Option<Command>,
    /// What to measure [default: all]
    #[arg(value_name = "SUITE")]
    suites: Vec<Suite>,
    /// Fewer and smaller cases: two and a half minutes on two cores
    #[arg(long)]
    quick: bool,
    /// The long runs of precision a hundred times as long, 10^7 steps: an hour on a software driver
    #[arg(long, conflicts_with = "quick")]
    long: bool,
    /// Folder for table, plots and report
    #[arg(long, value_name = "DIR", default_value = "out/bench")]
    out: PathBuf,
    /// Print the table as JSON
    #[arg(long)]
    json: bool,
}

#[derive(clap::Subcommand)]
enum Command {
    Gpu(GpuArgs),
    Hard(HardArgs),
    Traffic(TrafficArgs),
}

/// What the warps of the kernels that walk neighbour lists ask of the caches, counted on the lists of a scene
#[derive(clap::Args)]
struct TrafficArgs {
    #[command(flatten)]
    scene: SceneArgs,
    /// Steps before the one that is counted
    #[arg(long, value_name = "N", default_value_t = 100)]
    steps: u64,
    /// Lists that lie side by side, a power of two
    #[arg(long, value_name = "N", default_value_t = LISTS_ABREAST, value_parser = powers_of_two)]
    lists_abreast: u32,
}

/// 1 to 512.
fn powers_of_two(text: &str) -> Result<u32, String> {
    let number = text.parse().ok().filter(|n: &u32| n.is_power_of_two() && *n <= 512);
    number.ok_or_else(|| "must be 1, 2, 4 or another power of two, at most 512".to_owned())
}

/// The hard cases for DEM as the table of docs/hard-cases.md; needs the source tree, which has their scenes
#[derive(clap::Args)]
struct HardArgs {
    /// Only this case
    case: Option<String>,
    /// The long ones a twentieth as long, which is what the tests do
    #[arg(long)]
    short: bool,
}

fn hard(args: &HardArgs) -> anyhow::Result<ExitCode> {
    let folder = hard::folder();
    anyhow::ensure!(folder.is_dir(), "{}: is no folder; hard cases need packstone's source tree", folder.display());
    let length = if args.short { hard::Length::Short } else { hard::Length::Full };
    let printed = match &args.case {
        Some(case) => hard::print([hard::named(case)?], length, &mut std::io::stdout()),
        None => hard::print(hard::ALL, length, &mut std::io::stdout()),
    };
    // That nobody reads any more (`| head`) is the end of it, but no error.
    match printed {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => Err(error.into()),
        _ => Ok(ExitCode::SUCCESS),
    }
}

fn traffic(args: &TrafficArgs) -> anyhow::Result<ExitCode> {
    let (_, assembly) = args.scene.load(&[])?;
    say(traffic::table(assembly, args.steps, args.lists_abreast)?.trim_end());
    Ok(ExitCode::SUCCESS)
}

pub fn bench(args: &BenchArgs) -> anyhow::Result<ExitCode> {
    match &args.command {
        Some(Command::Gpu(args)) => return gpu(args),
        Some(Command::Hard(args)) => return hard(args),
        Some(Command::Traffic(args)) => return traffic(args),
        None => {}
    }
    // A folder that cannot be had is better noticed before three quarters of an hour than after it.
    std::fs::create_dir_all(&args.out).map_err(|source| packstone::Error::Io { path: args.out.clone(), source })?;
    listen()?;
    let suites = if args.suites.is_empty() { Suite::ALL.to_vec() } else { in_order(&args.suites) };
    let effort = match (args.quick, args.long) {
        (true, _) => Effort::Quick,
        (_, true) => Effort::Long,
        _ => Effort::Full,
    };
    let found = bench::run(&suites, effort, &mut |point| {
        tell(line(point));
        if interrupted() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    report::write(&args.out, &found)?;
    if args.json {
        say(report::json(&found).trim_end());
    } else {
        let path = args.out.join(report::REPORT);
        say(format!("{} points in {:.0} s, report in {}", found.points.len(), found.wall_seconds, path.display()));
    }
    let failed = found.points.iter().filter(|p| !p.passed()).count();
    if failed > 0 {
        complain(format!("{failed} of {} points failed, see the column `status`", found.points.len()));
    }
    Ok(match () {
        () if found.interrupted => ExitCode::from(INTERRUPTED),
        () if failed > 0 => ExitCode::from(STOPPED),
        () => ExitCode::SUCCESS,
    })
}

/// Each suite once, whatever the order they were asked for.
fn in_order(suites: &[Suite]) -> Vec<Suite> {
    Suite::ALL.into_iter().filter(|suite| suites.contains(suite)).collect()
}

fn line(point: &Point) -> String {
    let Point { case, quantity, engine, precision, dt_over_auto, unit, .. } = point;
    let step = (1e4 * dt_over_auto).round() / 1e4;
    let step = if step.is_nan() { String::new() } else { format!(", dt × {step}") };
    let setting = format!("{case}: {engine} {precision}{step}");
    let rate = point.particle_steps_per_second.map_or(String::new(), |rate| format!(", {rate:.2e} particle-steps/s"));
    match point.error {
        Some(error) => format!("{setting}: {quantity} {error:.2e} {unit}{rate}"),
        None => format!("{setting}: {quantity}, {}{rate}", point.status),
    }
}
