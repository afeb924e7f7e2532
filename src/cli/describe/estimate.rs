//! How long a run will take, from its first steps.

use packstone::{
    io::{
        schedule::{Forecast, Schedule},
        vtp,
    },
    scene::grain_file::Moment,
    simulation::Simulation,
};
use serde::Serialize;
use std::{
    fmt::{self, Display, Formatter},
    io::sink,
    time::{Duration, Instant},
};

/// What there is to say of a run without an end is said of so many steps.
pub const PER_STEPS: u64 = 1_000_000;

/// The wall time of a run, s.
#[derive(Serialize)]
pub struct Estimate {
    /// Of the run, or of so many of its steps if it has no end.
    seconds: f64,
    steps: u64,
    endless: bool,
    /// What it rests on.
    measured_steps: u64,
    measured_seconds: f64,
    pub seconds_per_step: f64,
    engine: String,
}

impl Display for Estimate {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        let Estimate { seconds, endless, measured_steps, measured_seconds, seconds_per_step, engine, .. } = self;
        let per = if *endless { " per million steps" } else { "" };
        write!(
            f,
            "wall time  about {}{per} without the disk's, {seconds_per_step:.1e} s a step: {measured_steps} steps in \
             {measured_seconds:.1} s; grains that come together take longer\n           {engine}",
            duration(*seconds),
        )
    }
}

/// Steps are measured for so long.
const MEASURED: Duration = Duration::from_secs(2);

/// From its first steps.
pub fn estimate(
    start: impl FnOnce() -> packstone::Result<Simulation>,
    schedule: &Schedule,
) -> packstone::Result<Estimate> {
    let began = Instant::now();
    let mut simulation = start()?;
    let setup = began.elapsed().as_secs_f64();
    let (began, end) = (Instant::now(), schedule.end.unwrap_or(u64::MAX));
    while simulation.step() < end && began.elapsed() < MEASURED {
        simulation.advance_chunk(end - simulation.step())?;
    }
    let measured_seconds = began.elapsed().as_secs_f64();
    let measured_steps = simulation.step();
    let seconds_per_step = measured_seconds / measured_steps as f64;
    let seconds = |did: Instant| did.elapsed().as_secs_f64();
    let began = Instant::now();
    simulation.sample()?;
    let per_row = seconds(began);
    let began = Instant::now();
    let grains = simulation.grains()?;
    let assembly = simulation.assembly();
    if assembly.output.vtp {
        // Nothing is written, so nothing fails.
        let (owners, numbers) = (&assembly.owners()[..], &assembly.numbers);
        let moment = Moment { step: 0, time: 0.0, grains: &grains, clumps: &[], owners, numbers };
        let _ = vtp::write(&mut sink(), &moment);
    }
    let per_snapshot = seconds(began);
    let steps = schedule.end.unwrap_or(PER_STEPS);
    let Forecast { rows, snapshots, .. } = Forecast::new(assembly, schedule, steps);
    Ok(Estimate {
        seconds: setup + seconds_per_step * steps as f64 + per_row * rows as f64 + per_snapshot * snapshots as f64,
        steps,
        endless: schedule.end.is_none(),
        measured_steps,
        measured_seconds,
        seconds_per_step,
        engine: simulation.notice().to_owned(),
    })
}

/// A time for people.
pub fn duration(seconds: f64) -> String {
    let units = [(86_400.0, "days"), (3600.0, "h"), (60.0, "min")];
    let found = units.into_iter().find(|(unit, _)| seconds >= 2.0 * unit);
    found.map_or(format!("{seconds:.1} s"), |(unit, name)| format!("{:.1} {name}", seconds / unit))
}
