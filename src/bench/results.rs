//! What a benchmark finds: the rows of its tables.

use super::machine::Machine;
use serde::Serialize;
use std::str::FromStr;

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
    /// Wide sizes against equal ones: time and memory of a particle-step.
    Sizes,
    /// Contact dynamics: the residual of one step against wall time, solver by solver.
    Relaxation,
    /// What single precision loses: closed forms, and energy and momentum over long runs.
    Precision,
}

impl Suite {
    pub const ALL: [Suite; 8] = [
        Suite::Local,
        Suite::Trajectory,
        Suite::Invariants,
        Suite::Ensembles,
        Suite::Speed,
        Suite::Sizes,
        Suite::Relaxation,
        Suite::Precision,
    ];

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Suite::Local => "local",
            Suite::Trajectory => "trajectory",
            Suite::Invariants => "invariants",
            Suite::Ensembles => "ensembles",
            Suite::Speed => "speed",
            Suite::Sizes => "sizes",
            Suite::Relaxation => "relaxation",
            Suite::Precision => "precision",
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
    /// The same with runs of 10^7 steps.
    Long,
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
    /// Precision: the largest error that is right.
    pub allowed: Option<f64>,
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
