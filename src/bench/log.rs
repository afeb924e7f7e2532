//! Where suites put their points: every setting of a case becomes rows, and so does what goes wrong.

use super::{
    machine::Machine,
    results::{Effort, Point, RelaxationRow, ResidualRow, StageRow, Suite},
    trial::{Cost, Setting},
};
use crate::{
    error::{Error, Result},
    simulation::profile::{Profile, StageCost},
};
use std::ops::ControlFlow;

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
    /// The largest error that is right.
    pub allowed: Option<f64>,
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

/// Where suites put their points.
pub struct Log<'a> {
    pub effort: Effort,
    pub machine: &'a Machine,
    pub suite: Suite,
    pub points: Vec<Point>,
    pub stages: Vec<StageRow>,
    pub relaxation: Vec<RelaxationRow>,
    pub residuals: Vec<ResidualRow>,
    pub watch: &'a mut dyn FnMut(&Point) -> ControlFlow<()>,
    pub interrupted: bool,
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
    pub fn run<C: Into<Option<Cost>>>(
        &mut self,
        case: &str,
        setting: Setting,
        work: impl FnOnce() -> Result<(C, Vec<Measure>)>,
    ) {
        if self.interrupted {
            return;
        }
        let rows = match work() {
            Ok((cost, measures)) => {
                let cost = cost.into();
                measures.iter().map(|m| self.point(case, setting, cost.as_ref(), m, None)).collect()
            }
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
            allowed: measure.allowed,
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

/// An error once more, for every point that it spoils; errors are no `Clone`.
pub fn again(error: &Error) -> Error {
    Error::Device(error.to_string())
}

/// For points whose reference has failed, which has a row of its own.
pub fn no_reference() -> Error {
    Error::Device("the reference failed".to_owned())
}
