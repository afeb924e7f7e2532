//! When a run writes what, and how much that is.

use super::{csv, export::Kind, vtp};
use crate::scene::{
    Assembly, Clump, Grain, Numbers, Output, Stop,
    grain_file::{self, Moment, Names},
};
use glam::{DQuat, DVec3};
use serde::{Deserialize, Serialize};
use std::io::{self, Write};

/// Something that happens every so many steps, which need not be a whole number.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Clock {
    pub interval: f64,
    pub ticks: u64,
}

impl Clock {
    pub fn new(interval: f64) -> Clock {
        Clock { interval: interval.max(1.0), ticks: 0 }
    }

    /// The step at which it happens next; 0 at first.
    pub fn next(&self) -> u64 {
        whole(self.ticks as f64 * self.interval)
    }

    /// Whether it happens at this step, which is then over.
    pub fn strikes(&mut self, step: u64) -> bool {
        let now = self.next() <= step;
        self.ticks += u64::from(now);
        now
    }

    /// The steps at which it has happened.
    pub fn past(&self) -> impl Iterator<Item = u64> {
        let interval = self.interval;
        (0..self.ticks).map(move |tick| Clock { interval, ticks: tick }.next())
    }

    /// How often it strikes up to this step.
    fn count(&self, end: u64) -> u64 {
        (end as f64 / self.interval * (1.0 + 1e-9)) as u64 + 1
    }
}

/// The first step that is not before this one; a number that is whole up to rounding is itself.
fn whole(steps: f64) -> u64 {
    (steps * (1.0 - 1e-9)).ceil() as u64
}

/// The step at whose end a time has come.
pub fn step_at(time: f64, dt: f64) -> u64 {
    whole(time / dt)
}

/// The last step, if the scene sets a time or a number of steps, or when the cell meets a target.
fn last_step(stop: &Stop, time_of_target: Option<f64>, dt: f64) -> Option<u64> {
    let of_time = stop.time.into_iter().chain(time_of_target).map(|time| step_at(time, dt));
    of_time.chain(stop.steps).min()
}

/// From one look at a packing that is to come to rest to the next: it does so in some hundreds to thousands of steps.
const STEPS_OF_RELAXATION: f64 = 200.0;

/// From one look at a pressure that ends a run to the next.
const STEPS_TO_PRESSURE: f64 = 100.0;

/// What a run does when.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Schedule {
    /// The last step, if it is known.
    pub end: Option<u64>,
    pub history: Clock,
    pub snapshots: Option<Clock>,
}

impl Schedule {
    pub fn new(assembly: &Assembly, dt: f64) -> Schedule {
        let end = last_step(&assembly.stop, assembly.time_of_target(), dt);
        let history = match (assembly.output.history, end) {
            (Some(seconds), _) => seconds / dt,
            (None, _) if assembly.stop.jamming.is_some() => STEPS_OF_RELAXATION,
            (None, _) if assembly.stop.pressure.is_some() => STEPS_TO_PRESSURE,
            (None, Some(end)) => end as f64 / 100.0,
            (None, None) => 1000.0,
        };
        Schedule { end, history: Clock::new(history), snapshots: assembly.output.snapshots.map(|s| Clock::new(s / dt)) }
    }

    /// The next step at which anything is due.
    pub fn next(&self) -> u64 {
        let all = [Some(self.history.next()), self.snapshots.as_ref().map(Clock::next), self.end];
        all.into_iter().flatten().min().expect("there is always a next row")
    }
}

/// Files and bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Amount {
    pub files: u64,
    pub bytes: u64,
}

impl Amount {
    /// So many files of so many bytes each.
    fn add(&mut self, files: u64, bytes: u64) {
        self.files += files;
        self.bytes = self.bytes.saturating_add(files.saturating_mul(bytes));
    }
}

/// What a run will write, for as long as numbers have their usual lengths.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Forecast {
    pub rows: u64,
    /// Times at which there are snapshots.
    pub snapshots: u64,
    pub of_snapshots: Amount,
    /// Snapshots included.
    pub all: Amount,
}

/// Bytes of a checkpoint per grain of a dense packing of spheres.
const CHECKPOINT_OF_GRAIN: u64 = 300;
/// Bytes of a row of the history.
const HISTORY_ROW: u64 = 220;
/// Of the load on a wall in it.
const WALL_OF_ROW: u64 = 160;
/// Of a file for other programs, per grain of a dense packing of spheres, which has three contacts.
fn of_export(kind: Kind) -> u64 {
    match kind {
        Kind::ContactsCsv => 3 * 360,
        Kind::ContactsVtp => 3 * 290,
        Kind::Npz => 88 + 3 * 185,
        Kind::Xyz | Kind::Dump => 220,
    }
}

/// Of summary, record and scene, which do not grow with the grains.
const SMALL_FILE: u64 = 2000;
/// Of what the list of snapshots says of each.
const SERIES_ROW: u64 = 90;

impl Forecast {
    /// Of a run of this many steps.
    pub fn new(assembly: &Assembly, schedule: &Schedule, steps: u64) -> Forecast {
        let Output { csv, bin, vtp, .. } = assembly.output;
        let size = Sizes::of(assembly);
        let rows = schedule.history.count(steps);
        let snapshots = schedule.snapshots.map_or(0, |clock| clock.count(steps));
        let (mut of_snapshots, mut others) = (Amount::default(), Amount::default());
        if vtp {
            // There is one of the last state in any case.
            let of_last = schedule.snapshots.filter(|clock| Clock { ticks: snapshots - 1, ..*clock }.next() == steps);
            of_snapshots.add(snapshots + u64::from(of_last.is_none()), size.vtp);
            others.add(1, SERIES_ROW * (snapshots + 1));
        }
        if bin {
            of_snapshots.add(snapshots, size.bin);
            others.add(1, size.bin);
        }
        if csv {
            others.add(1, size.csv);
            others.files += u64::from(!assembly.clumps.is_empty());
        }
        for kind in Kind::wanted(&assembly.output) {
            let bytes = of_export(kind) * assembly.grains.len() as u64;
            of_snapshots.add(snapshots, bytes);
            others.add(1, bytes);
        }
        others.add(1, (HISTORY_ROW + WALL_OF_ROW * assembly.walls.len() as u64) * rows);
        if assembly.output.checkpoint > 0.0 {
            others.add(1, CHECKPOINT_OF_GRAIN * assembly.grains.len() as u64);
        }
        others.add(3, SMALL_FILE);
        let all =
            Amount { files: of_snapshots.files + others.files, bytes: of_snapshots.bytes.saturating_add(others.bytes) };
        Forecast { rows, snapshots, of_snapshots, all }
    }
}

/// Bytes of the files with all grains; of tables those of clumps and members together.
#[derive(Clone, Copy)]
struct Sizes {
    vtp: u64,
    bin: u64,
    csv: u64,
}

/// Grains that are written to nowhere, to see how long they are.
const SAMPLE: usize = 100;

impl Sizes {
    /// Every grain and every clump is as long as others.
    fn of(assembly: &Assembly) -> Sizes {
        let (grains, clumps) = (assembly.grains.len(), assembly.clumps.len());
        // Where there are clumps files have other columns.
        let one = clumps.min(1);
        let (base, of_grain) = (Sizes::with(assembly, 0, one), Sizes::with(assembly, SAMPLE, one));
        let of_clump = Sizes::with(assembly, 0, one + SAMPLE * one);
        let linear = |of: fn(&Sizes) -> u64| {
            let each = |more: &Sizes| (of(more) - of(&base)) as f64 / SAMPLE as f64;
            (of(&base) as f64 + each(&of_grain) * grains as f64 + each(&of_clump) * (clumps - one) as f64) as u64
        };
        Sizes { vtp: linear(|s| s.vtp), bin: linear(|s| s.bin), csv: linear(|s| s.csv) }
    }

    /// With so many of them, whose numbers have as many digits as numbers can have.
    fn with(assembly: &Assembly, grains: usize, clumps: usize) -> Sizes {
        let (digits, radius) = (DVec3::new(1.0, -2.0, 3.0) / 7.0, 1.0 / 7.0);
        let orientation = DQuat::from_rotation_y(0.3) * DQuat::from_rotation_x(0.7);
        let (position, velocity, spin, material, fixed) = (digits, digits, digits, 0, false);
        let grain = Grain { position, velocity, spin, radius, material, fixed };
        let clump = Clump { shape: 0, first: 0, position, orientation, velocity, spin, radius, material, fixed };
        let (materials, shapes) = (&assembly.materials[..], &assembly.shapes[..]);
        let owners = vec![0; if assembly.clumps.is_empty() { 0 } else { grains }];
        let (grains, clumps) = (vec![grain; grains], vec![clump; clumps]);
        let names = Names { dimension: assembly.dimension, materials, shapes };
        let (numbers, owners) = (&Numbers::default(), &owners[..]);
        let moment = Moment { step: 0, time: radius, grains: &grains, clumps: &clumps, owners, numbers };
        Sizes {
            vtp: count(|out| vtp::write(out, &moment)),
            bin: count(|out| grain_file::write(out, &moment, &names)),
            csv: count(|out| {
                csv::grains(&mut *out, &grains, materials, numbers)?;
                match assembly.clumps.is_empty() {
                    true => Ok(()),
                    false => csv::clumps(out, &clumps, shapes, materials, numbers),
                }
            }),
        }
    }
}

/// What is written, in bytes.
fn count(write: impl FnOnce(&mut Counter) -> io::Result<()>) -> u64 {
    let mut counter = Counter(0);
    // Counting does not fail.
    let _ = write(&mut counter);
    counter.0
}

/// Counts bytes.
struct Counter(u64);

impl Write for Counter {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0 += bytes.len() as u64;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clocks_keep_time() {
        let mut clock = Clock::new(2.5);
        let steps: Vec<u64> = (0..=10).filter(|step| clock.strikes(*step)).collect();
        assert_eq!(steps, [0, 3, 5, 8, 10]);
        assert_eq!(Clock::new(2.5).count(10), 5);
        assert_eq!(Clock::new(0.01).interval, 1.0);
        assert_eq!(Clock { interval: 0.3 / 0.1, ticks: 1 }.next(), 3);
    }

    #[test]
    fn the_first_condition_ends_the_run() {
        let stop = |time, steps| Stop { time, steps, ..Stop::default() };
        assert_eq!(last_step(&stop(Some(0.3), None), None, 0.1), Some(3));
        assert_eq!(last_step(&stop(Some(0.25), Some(10)), None, 0.1), Some(3));
        assert_eq!(last_step(&stop(Some(1e-9), None), None, 0.1), Some(1));
        assert_eq!(last_step(&stop(None, None), None, 0.1), None);
        assert_eq!(last_step(&stop(Some(0.3), None), Some(0.15), 0.1), Some(2));
    }
}
