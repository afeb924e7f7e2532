//! What single precision loses: the tables of `docs/precision.md`.

use super::{
    drift,
    hard::{
        self, Figure, Length,
        common::{Bench, CPU, GPU_SINGLE},
    },
    log::{Log, Measure},
    results::Effort,
    trial::{Backend, Cost, Setting, scene},
};
use crate::{
    check::{self, balance::BALANCED_STEPS},
    error::{Error, Result},
    scene::Assembly,
};

/// Hard cases whose figures are matters of precision; the first ones are short.
const CASES: [&str; 11] = [
    "stiff_contacts",
    "far_from_origin",
    "column",
    "wide_domain",
    "slow_creep",
    "resting_pyramid",
    "curved_walls",
    "oblique_planes",
    "carried_pair",
    "units",
    "slow_changes",
];

/// Steps that the stages are compared over, and how many come before.
const COMPARED: u64 = 5;
const BEFORE: u64 = 400;

pub fn run(log: &mut Log) {
    let (cases, decades) = match log.effort {
        Effort::Quick => (&CASES[..2], 1),
        Effort::Full => (&CASES[..], 2),
        Effort::Long => (&CASES[..], 4),
    };
    for case in cases {
        for setting in log.settings(&[f64::NAN]) {
            match setting.backend {
                Backend::Cpu => figures(log, case, setting, CPU),
                Backend::GpuSingle => figures(log, case, setting, GPU_SINGLE),
                Backend::GpuDouble => {}
            }
        }
    }
    for setting in log.settings(&[1.0]).into_iter().filter(|s| s.backend == Backend::GpuSingle) {
        log.run("rough rain", setting, || stages(&scene("rough", include_str!("scenes/rough.toml"), &[])?, setting));
        log.run("bodies", setting, || stages(&drift::bodies(), setting));
    }
    drift::run(log, decades);
}

/// A row for every figure of a hard case that is no count.
fn figures(log: &mut Log, name: &str, setting: Setting, bench: Bench) {
    let found = || -> Result<Vec<Figure>> {
        let (case, folder) = (hard::named(name)?, hard::folder());
        if !folder.is_dir() {
            let why = format!("{}: is no folder; hard cases need packstone's source tree", folder.display());
            return Err(Error::Scene(why));
        }
        Ok((case.run)(bench, Length::Short))
    };
    match found() {
        Ok(figures) => {
            for figure in figures.iter().filter(|figure| figure.expected == 0.0 || figure.allowed > 0.0) {
                let error = (figure.found - figure.expected).abs();
                let measure = Measure { allowed: Some(figure.allowed), ..Measure::error("error", "", error) };
                log.run(&format!("{name}: {}", figure.what), setting, || Ok((None::<Cost>, vec![measure])));
            }
        }
        Err(error) => log.run(name, setting, || Err::<(Option<Cost>, _), _>(error)),
    }
}

/// The stage that differs most from its twin, over what it may differ by, and what the balances lose.
fn stages(start: &Assembly, setting: Setting) -> Result<(Option<Cost>, Vec<Measure>)> {
    let report = check::check(start, setting.backend.options(), BEFORE, COMPARED, BALANCED_STEPS)?;
    let measure =
        |quantity, worst: f64, allowed| Measure { allowed: Some(allowed), ..Measure::error(quantity, "", worst) };
    let (balances, stages): (Vec<_>, Vec<_>) = report.rows.iter().partition(|row| row.stage == "balance");
    let worst = stages.iter().map(|row| row.worst / row.tolerance).fold(0.0, f64::max);
    let of_balances = balances.iter().map(|row| measure(row.array, row.worst, row.tolerance));
    Ok((
        None,
        [measure("stage against its twin, of what is allowed", worst, 1.0)].into_iter().chain(of_balances).collect(),
    ))
}
