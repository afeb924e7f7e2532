//! `packstone tune`

use super::common::{STOPPED, load, say, tell};
use super::table::table;
use packstone::bench::tune::{self, Candidate, Tuning};
use std::{path::PathBuf, process::ExitCode};

/// Find the fastest engine, precision and time step that keep an error on a scene
#[derive(clap::Args)]
#[command(after_help = "Example:\n  packstone tune examples/scenes/heap_2d.toml --error 1e-3\n\n\
                        The error is the RMS distance of grains from a reference (cpu, f64, a sixteenth of the automatic \
                        step) after a short time, over their mean radius.")]
pub struct TuneArgs {
    /// Scene file
    scene: PathBuf,
    /// Error that is allowed, in mean radii
    #[arg(long, value_name = "ERROR", allow_negative_numbers = true)]
    error: f64,
    /// Change a value of the scene, such as solver.margin=0.3; may be repeated
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Print everything as JSON
    #[arg(long)]
    json: bool,
}

pub fn tune(args: &TuneArgs) -> anyhow::Result<ExitCode> {
    let (_, assembly) = load(&args.scene, &args.set)?;
    let tuning = tune::tune(&assembly, args.error, &mut |news| tell(news))?;
    if args.json {
        say(serde_json::to_string_pretty(&tuning)?);
    } else {
        print(&tuning);
    }
    Ok(if tuning.best.is_some() { ExitCode::SUCCESS } else { ExitCode::from(STOPPED) })
}

fn print(tuning: &Tuning) {
    let Tuning { asked, version, from, horizon, coordination_number, candidates, .. } = tuning;
    say(format!(
        "Errors: {version}; {horizon:.3e} s from t = {from:.3e} s, {coordination_number:.2} contacts per grain at its \
         begin.\nSpeeds: the first steps of the whole scene.\n"
    ));
    let header = ["engine", "precision", "dt", "dt/auto", "error", "wall s per s", "particle-steps/s", "verdict"];
    let rows: Vec<Vec<String>> = candidates.iter().enumerate().map(|(k, c)| row(tuning, k, c)).collect();
    say(table(&header, &rows));
    let named = |k: usize| {
        let Candidate { engine, precision, dt, error, .. } = &candidates[k];
        format!(
            "--engine {engine} --precision {precision} --set solver.dt={dt:e} (error {:.1e} mean radii)",
            error.unwrap_or(f64::NAN)
        )
    };
    say(match (tuning.best, tuning.closest) {
        (Some(k), _) => format!("\nfastest that keeps {asked:e}: {}", named(k)),
        (None, Some(k)) => format!("\nnothing keeps {asked:e}; closest is {}", named(k)),
        (None, None) => format!("\nnothing keeps {asked:e}: every run failed"),
    });
    if *coordination_number == 0.0 {
        say("Grains did not touch before the compared stretch; an error without contacts says little.");
    }
}

fn row(tuning: &Tuning, k: usize, c: &Candidate) -> Vec<String> {
    let number = |x: Option<f64>| x.map_or("-".to_owned(), |x| format!("{x:.2e}"));
    let verdict = match c.loses {
        _ if tuning.best == Some(k) => "fastest".to_owned(),
        _ if c.error.is_none() => c.status.clone(),
        Some((what, part)) => format!("loses {part:.1e} of {what}"),
        None if c.keeps(tuning.asked) => "ok".to_owned(),
        None => "too far".to_owned(),
    };
    vec![
        c.engine.to_owned(),
        c.precision.to_owned(),
        format!("{:.3e}", c.dt),
        c.dt_over_auto.to_string(),
        number(c.error),
        number(c.wall_per_simulated),
        number(c.particle_steps_per_second),
        verdict,
    ]
}
