//! Speed beside error: fixed cases over engine × precision × time step (`packstone bench`), and the same machinery on a
//! user's scene (`packstone tune`). What every suite measures, and all columns: `docs/bench.md`.
//!
//! A suite is a file here and an entry of [`Suite`]; its scenes are the TOML files in `scenes/`. It hands every setting
//! of every case to a `Log`, which turns what came out, or what went wrong, into rows.

mod copy;
mod drift;
mod ensembles;
mod front;
pub mod gpu;
pub mod hard;
mod invariants;
mod lattice;
mod local;
mod log;
pub mod machine;
pub mod plot;
mod precision;
mod relaxation;
pub mod report;
mod results;
mod sizes;
mod speed;
pub mod traffic;
mod trajectory;
pub mod trial;
pub mod tune;

pub use results::{Bench, Effort, Point, RelaxationRow, ResidualRow, StageRow, Suite};

use log::Log;
use machine::Machine;
use std::ops::ControlFlow;

/// Run these suites. `watch` sees every point as it comes, and may end the benchmark there.
pub fn run(suites: &[Suite], effort: Effort, watch: &mut dyn FnMut(&Point) -> ControlFlow<()>) -> Bench {
    let start = std::time::Instant::now();
    let mut machine = Machine::here();
    if suites.contains(&Suite::Speed) {
        machine.measure_copies();
    }
    let mut log = Log {
        effort,
        machine: &machine,
        suite: Suite::Local,
        points: Vec::new(),
        stages: Vec::new(),
        relaxation: Vec::new(),
        residuals: Vec::new(),
        watch,
        interrupted: false,
    };
    for suite in suites {
        log.suite = *suite;
        run_suite(*suite, &mut log);
    }
    let Log { mut points, stages, relaxation, residuals, interrupted, .. } = log;
    front::mark(&mut points);
    let wall_seconds = start.elapsed().as_secs_f64();
    Bench { machine, effort, interrupted, wall_seconds, points, stages, relaxation, residuals }
}

fn run_suite(suite: Suite, log: &mut Log) {
    match suite {
        Suite::Local => local::run(log),
        Suite::Trajectory => trajectory::run(log),
        Suite::Invariants => invariants::run(log),
        Suite::Ensembles => ensembles::run(log),
        Suite::Speed => speed::run(log),
        Suite::Sizes => sizes::run(log),
        Suite::Relaxation => relaxation::run(log),
        Suite::Precision => precision::run(log),
    }
}
