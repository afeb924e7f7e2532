//! Speed beside error: fixed cases over engine × precision × time step (`packstone bench`), and the same machinery on a
//! user's scene (`packstone tune`). What every suite measures, and all columns: `docs/bench.md`.
//!
//! A suite is a file here and an entry of [`Suite`]; its scenes are the TOML files in `scenes/`. It hands every setting of
//! every case to a [`Log`], which turns what came out, or what went wrong, into [`Point`]s.

mod copy;
mod ensembles;
mod front;
pub mod hard;
mod invariants;
mod lattice;
mod local;
pub mod machine;
pub mod plot;
mod relaxation;
pub mod report;
mod speed;
mod trajectory;
pub mod trial;
pub mod tune;

use crate::{
    error::{Error, Result},
    simulation::profile::{Profile, StageCost},
};
use machine::Machine;
use serde::Serialize;
use std::{ops::ControlFlow, str::FromStr};
use trial::{Cost, Setting};

/// What can be measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Suite {
    /// Force and moment on the same state.
    Local,
    /// Closed forms, and a collapse against a fine reference.
    Trajectory,
    /// Energy and momenta of elastic gases, and the energy balance of rough grains.
    Invariants,
    /// Settled beds, averaged over seeds.
    Ensembles,
    /// Particle-steps per second against the number of grains, and where the time goes.
    Speed,
    /// Contact dynamics: the residual of one step against wall time, solver by solver.
    Relaxation,
}

impl Suite {
    pub const ALL: [Suite; 6] =
        [Suite::Local, Suite::Trajectory, Suite::Invariants, Suite::Ensembles, Suite::Speed, Suite::Relaxation];

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Suite::Local => "local",
            Suite::Trajectory => "trajectory",
            Suite::Invariants => "invariants",
            Suite::Ensembles => "ensembles",
            Suite::Speed => "speed",
            Suite::Relaxation => "relaxation",
        }
    }

    fn run(self, log: &mut Log) {
        match self {
            Suite::Local => local::run(log),
            Suite::Trajectory => trajectory::run(log),
            Suite::Invariants => invariants::run(log),
            Suite::Ensembles => ensembles::run(log),
            Suite::Speed => speed::run(log),
            Suite::Relaxation => relaxation::run(log),
        }
    }
}

impl FromStr for Suite {
    type Err = String;

    fn from_str(name: &str) -> std::result::Result<Suite, String> {
        let names = Suite::ALL.map(Suite::name);
        let found = Suite::ALL.into_iter().find(|suite| suite.name() == name);
        found.ok_or_else(|| format!("there is no suite `{name}`; there are {}", names.join(", ")))
    }
}

/// How much of a suite is run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Effort {
    /// Two and a half minutes on two cores.
    Quick,
    /// Three quarters of an hour on two cores.
    Full,
}

/// One error of one run: a row of the table.
#[derive(Clone, Debug, Serialize)]
pub struct Point {
    pub suite: Suite,
    pub case: String,
    /// What the error is of; empty if the run failed.
    pub quantity: &'static str,
    /// `cpu` or `gpu`.
    pub engine: &'static str,
    /// `single` or `double`.
    pub precision: &'static str,
    /// Time step over the one that `dt = "auto"` gives.
    pub dt_over_auto: f64,
    /// None in what follows: the run failed, or the quantity has no such number.
    pub error: Option<f64>,
    /// Of error, value and spread; empty where they are ratios.
    pub unit: &'static str,
    /// Ensembles: mean over the seeds.
    pub value: Option<f64>,
    /// Ensembles: standard deviation over the seeds.
    pub spread: Option<f64>,
    /// Ensembles: error over its standard error.
    pub standard_errors: Option<f64>,
    pub grains: Option<usize>,
    /// Steps that were timed.
    pub steps: Option<u64>,
    /// s
    pub dt: Option<f64>,
    pub dt_over_bound: Option<f64>,
    /// Wall seconds per simulated second.
    pub wall_per_simulated: Option<f64>,
    pub particle_steps_per_second: Option<f64>,
    pub ms_per_step: Option<f64>,
    pub bytes_per_particle: Option<f64>,
    /// Speed: bytes that a particle-step has to move.
    pub bytes_per_step: Option<f64>,
    /// Speed: what that makes per second, over what a copy moves per second.
    pub copy_fraction: Option<f64>,
    /// No other setting of the same case has a smaller error in no more wall time.
    pub pareto: bool,
    /// `ok`, `reference` (what errors are taken against), or `failed: ` and why.
    pub status: String,
}

impl Point {
    /// Whether the run ended as it should.
    pub fn passed(&self) -> bool {
        !self.status.starts_with("failed")
    }

    /// What Pareto fronts and plots compare.
    pub fn group(&self) -> (Suite, &str, &'static str) {
        (self.suite, &self.case, self.quantity)
    }
}

/// Where the time of a run goes: a row of the table of stages.
#[derive(Clone, Debug, Serialize)]
pub struct StageRow {
    pub case: String,
    pub engine: &'static str,
    pub precision: &'static str,
    /// `rest` is what is left of the wall time: the host, and waiting for the device. It has none of the other numbers.
    pub stage: &'static str,
    pub calls: Option<u64>,
    pub ms_per_call: Option<f64>,
    /// Of the wall time.
    pub share: f64,
    /// Bytes that a call has to move, over the number of grains.
    pub bytes_per_particle: Option<f64>,
    /// 1e9 of these bytes per second.
    pub gigabytes_per_second: Option<f64>,
    /// The same over what a copy moves per second.
    pub copy_fraction: Option<f64>,
    /// What told the time.
    pub clock: &'static str,
}

/// How a solver of contact dynamics has fared in one step: a row of the table of relaxations.
#[derive(Clone, Debug, Serialize)]
pub struct RelaxationRow {
    pub case: String,
    /// With its order, where it has one.
    pub solver: String,
    pub engine: &'static str,
    pub precision: &'static str,
    pub grains: usize,
    /// That carry an impulse at the end.
    pub contacts: u64,
    pub passes: u32,
    /// Wall time of the relaxation, s.
    pub seconds: f64,
    /// Relative, at the end.
    pub residual: f64,
    pub contact_passes_per_second: f64,
    /// At the first look at a residual so small; None: not reached.
    #[serde(rename = "passes_to_1e-2")]
    pub passes_to_1e2: Option<u32>,
    #[serde(rename = "seconds_to_1e-2")]
    pub seconds_to_1e2: Option<f64>,
    #[serde(rename = "passes_to_1e-3")]
    pub passes_to_1e3: Option<u32>,
    #[serde(rename = "seconds_to_1e-3")]
    pub seconds_to_1e3: Option<f64>,
    #[serde(rename = "passes_to_1e-4")]
    pub passes_to_1e4: Option<u32>,
    #[serde(rename = "seconds_to_1e-4")]
    pub seconds_to_1e4: Option<f64>,
}

impl RelaxationRow {
    /// Passes and seconds to 1e-2, 1e-3 and 1e-4.
    pub fn marks(&self) -> [Option<(u32, f64)>; 3] {
        [
            self.passes_to_1e2.zip(self.seconds_to_1e2),
            self.passes_to_1e3.zip(self.seconds_to_1e3),
            self.passes_to_1e4.zip(self.seconds_to_1e4),
        ]
    }
}

/// A point of the curve that belongs to such a row.
#[derive(Clone, Debug, Serialize)]
pub struct ResidualRow {
    pub case: String,
    pub solver: String,
    pub engine: &'static str,
    pub precision: &'static str,
    /// So far; and s.
    pub passes: u32,
    pub seconds: f64,
    pub residual: f64,
}

/// One number that a run gives.
#[derive(Clone, Copy, Debug, Default)]
pub struct Measure {
    pub quantity: &'static str,
    pub unit: &'static str,
    /// None: the run is the reference.
    pub error: Option<f64>,
    pub value: Option<f64>,
    pub spread: Option<f64>,
    pub standard_errors: Option<f64>,
}

impl Measure {
    /// A plain error.
    pub fn error(quantity: &'static str, unit: &'static str, error: f64) -> Measure {
        Measure { quantity, unit, error: Some(error), ..Measure::default() }
    }

    /// What other errors are taken against.
    pub fn reference(quantity: &'static str, unit: &'static str) -> Measure {
        Measure { quantity, unit, ..Measure::default() }
    }
}

/// Everything a benchmark finds.
#[derive(Clone, Debug, Serialize)]
pub struct Bench {
    pub machine: Machine,
    pub effort: Effort,
    /// Ended before all cases were run.
    pub interrupted: bool,
    /// s
    pub wall_seconds: f64,
    pub points: Vec<Point>,
    /// Of the suite `speed`.
    pub stages: Vec<StageRow>,
    /// Of the suite `relaxation`.
    pub relaxation: Vec<RelaxationRow>,
    pub residuals: Vec<ResidualRow>,
}

/// Where suites put their points.
pub struct Log<'a> {
    pub effort: Effort,
    machine: &'a Machine,
    suite: Suite,
    points: Vec<Point>,
    stages: Vec<StageRow>,
    relaxation: Vec<RelaxationRow>,
    residuals: Vec<ResidualRow>,
    watch: &'a mut dyn FnMut(&Point) -> ControlFlow<()>,
    interrupted: bool,
}

impl Log<'_> {
    /// The first under `--quick`, else the second.
    pub fn pick<T>(&self, quick: T, full: T) -> T {
        if self.effort == Effort::Quick { quick } else { full }
    }

    /// All engines and precisions of this machine, each at these steps over the automatic one.
    pub fn settings(&self, factors: &[f64]) -> Vec<Setting> {
        let all = |backend| factors.iter().map(move |factor| Setting { backend, factor: *factor });
        self.machine.backends().into_iter().flat_map(all).collect()
    }

    /// Run one setting of a case. What goes wrong becomes a row too.
    pub fn run(&mut self, case: &str, setting: Setting, work: impl FnOnce() -> Result<(Cost, Vec<Measure>)>) {
        if self.interrupted {
            return;
        }
        let rows = match work() {
            Ok((cost, measures)) => measures.iter().map(|m| self.point(case, setting, Some(&cost), m, None)).collect(),
            Err(error) => {
                vec![self.point(case, setting, None, &Measure::default(), Some(format!("failed: {error}")))]
            }
        };
        for row in rows {
            self.interrupted |= (self.watch)(&row).is_break();
            self.points.push(row);
        }
    }

    /// Put down where the time of a run went.
    pub fn stages(&mut self, case: &str, setting: Setting, profile: &Profile) {
        let Setting { backend, .. } = setting;
        let row = |stage, seconds: f64, cost: Option<&StageCost>| {
            let rate = cost.map(|c| c.calls as f64 * c.bytes as f64 / c.seconds);
            StageRow {
                case: case.to_owned(),
                engine: backend.engine(),
                precision: backend.precision().label(),
                stage,
                calls: cost.map(|c| c.calls),
                ms_per_call: cost.map(|c| 1e3 * c.seconds / c.calls as f64),
                share: seconds / profile.wall_seconds,
                bytes_per_particle: cost.map(|c| c.bytes as f64 / profile.grains as f64),
                gigabytes_per_second: rate.map(|r| 1e-9 * r),
                copy_fraction: rate.zip(self.machine.copy_bandwidth(backend)).map(|(r, copy)| r / copy),
                clock: profile.clock,
            }
        };
        let timed: f64 = profile.stages.iter().map(|s| s.seconds).sum();
        let rest = row("rest", profile.wall_seconds - timed, None);
        self.stages.extend(profile.stages.iter().map(|s| row(s.name, s.seconds, Some(s))).chain([rest]));
    }

    fn point(
        &self,
        case: &str,
        setting: Setting,
        cost: Option<&Cost>,
        measure: &Measure,
        failure: Option<String>,
    ) -> Point {
        let bytes_per_step = cost.and_then(|c| c.bytes_per_step);
        let copy = self.machine.copy_bandwidth(setting.backend);
        let moved = cost.zip(bytes_per_step).map(|(cost, bytes)| cost.rate() * bytes);
        let settled = if measure.error.is_some() { "ok" } else { "reference" };
        Point {
            suite: self.suite,
            case: case.to_owned(),
            quantity: measure.quantity,
            engine: setting.backend.engine(),
            precision: setting.backend.precision().label(),
            dt_over_auto: setting.factor,
            error: measure.error,
            unit: measure.unit,
            value: measure.value,
            spread: measure.spread,
            standard_errors: measure.standard_errors,
            grains: cost.map(|c| c.grains),
            steps: cost.map(|c| c.steps),
            dt: cost.map(|c| c.dt),
            dt_over_bound: cost.map(|c| c.dt / c.dt_bound),
            wall_per_simulated: cost.map(Cost::wall_per_simulated),
            particle_steps_per_second: cost.map(Cost::rate),
            ms_per_step: cost.map(Cost::ms_per_step),
            bytes_per_particle: cost.map(|c| c.bytes_per_particle),
            bytes_per_step,
            copy_fraction: moved.zip(copy).map(|(moved, copy)| moved / copy),
            pareto: false,
            status: failure.unwrap_or_else(|| settled.to_owned()),
        }
    }
}

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
        suite.run(&mut log);
    }
    let Log { mut points, stages, relaxation, residuals, interrupted, .. } = log;
    front::mark(&mut points);
    let wall_seconds = start.elapsed().as_secs_f64();
    Bench { machine, effort, interrupted, wall_seconds, points, stages, relaxation, residuals }
}

/// An error once more, for every point that it spoils; errors are no `Clone`.
fn again(error: &Error) -> Error {
    Error::Device(error.to_string())
}

/// For points whose reference has failed, which has a row of its own.
fn no_reference() -> Error {
    Error::Device("the reference failed".to_owned())
}
