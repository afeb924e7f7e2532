//! `packstone check`

use super::common::{STOPPED, SceneArgs, about, say};
use super::table::table;
use packstone::check::{self, Report, Row};
use std::process::ExitCode;

/// Compare every GPU kernel with its CPU twin on a scene
#[derive(clap::Args)]
#[command(after_help = "Example:\n  packstone check examples/scenes/heap_2d.toml --steps 20 --after 1000")]
pub struct CheckArgs {
    #[command(flatten)]
    scene: SceneArgs,
    /// Steps to compare
    #[arg(long, default_value_t = 10, value_parser = clap::value_parser!(u64).range(1..))]
    steps: u64,
    /// Steps to do before, so that there are contacts to compare
    #[arg(long, default_value_t = 0)]
    after: u64,
    /// Steps over which paths, momentum and energy have to balance; 0 for none, fewer by themselves if there are many
    /// grains
    #[arg(long, value_name = "STEPS")]
    balance: Option<u64>,
    /// Print the report as JSON
    #[arg(long)]
    json: bool,
}

pub fn check(args: &CheckArgs) -> anyhow::Result<ExitCode> {
    compare(args).map_err(|error| about(&args.scene.scene, error))
}

fn compare(args: &CheckArgs) -> anyhow::Result<ExitCode> {
    let (_, assembly) = args.scene.load(&[])?;
    // Forces are read after every step.
    let affordable = (2_000_000 / assembly.whole().grains.len() as u64).clamp(50, 1000);
    let balance = args.balance.unwrap_or(affordable);
    let report = check::check(&assembly, args.scene.device.options(), args.after, args.steps, balance)?;
    if args.json {
        say(serde_json::to_string_pretty(&report)?);
    } else {
        print(&report);
    }
    Ok(if report.passed { ExitCode::SUCCESS } else { ExitCode::from(STOPPED) })
}

fn print(report: &Report) {
    let Report { adapter, precision, steps, after, contacts, trajectory, .. } = report;
    say(format!("{adapter}, {precision}: {steps} steps after {after}, at most {contacts} contacts\n"));
    let header = ["stage", "array", "worst", "rms", "tolerance", "calls", "verdict"];
    say(table(&header, &report.rows.iter().map(row).collect::<Vec<_>>()));
    say(format!("\nAfter {} free steps the engines are {trajectory:.1e} mean radii apart.", after + steps));
    if *contacts == 0 {
        say("No grains touched, so no force was compared; see --after.");
    }
    let exceeded: Vec<String> =
        report.rows.iter().filter(|r| !r.passed).map(|r| format!("{} {}", r.stage, r.array)).collect();
    say(match exceeded.len() {
        0 => format!("passed: all {} rows are within their tolerances", report.rows.len()),
        n => format!("FAILED: {n} of {} rows exceed their tolerances: {}", report.rows.len(), exceeded.join(", ")),
    });
}

fn row(row: &Row) -> Vec<String> {
    vec![
        row.stage.to_string(),
        row.array.to_string(),
        format!("{:.1e}", row.worst),
        format!("{:.1e}", row.rms),
        format!("{:.1e}", row.tolerance),
        row.calls.to_string(),
        if row.passed { "ok" } else { "EXCEEDED" }.to_owned(),
    ]
}
