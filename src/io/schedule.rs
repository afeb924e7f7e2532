//! When a run writes what, and how much that is.

use super::{csv, vtp};
use crate::scene::{
    Assembly, Clump, Grain, Stop,
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

/// The last step, if the scene sets a time or a number of steps.
fn last_step(stop: &Stop, dt: f64) -> Option<u64> {
    let of_time = stop.time.map(|time| whole(time / dt));
    of_time.into_iter().chain(stop.steps).min()
}

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
        let end = last_step(&assembly.stop, dt);
        let history = match (assembly.output.history, end) {
            (Some(seconds), _) => seconds / dt,
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
    fn add(&mut self, files: u64, bytes: u64) {
        self.files += files;
        self.bytes = self.bytes.saturating_add(files.saturating_mul(bytes));
    }
}

/// What a run will write; without a last step, what it writes at the end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Forecast {
    pub rows: u64,
    /// Times at which there are snapshots.
    pub snapshots: u64,
    pub of_snapshots: Amount,
    /// Snapshots included.
    pub all: Amount,
}

/// Grains that are written to nowhere, to see how long they are.
const SAMPLE: usize = 100;

impl Forecast {
    /// Of a run of this many steps.
    pub fn new(assembly: &Assembly, schedule: &Schedule, steps: u64) -> Forecast {
        let output = &assembly.output;
        let (vtp, bin, csv) = sizes(assembly);
        let rows = schedule.history.count(steps);
        let snapshots = schedule.snapshots.map_or(0, |clock| clock.count(steps));
        let mut of_snapshots = Amount::default();
        if output.vtp {
            // The last state has one, too.
            let last =
                schedule.snapshots.is_none_or(|clock| whole((clock.count(steps) - 1) as f64 * clock.interval) != steps);
            of_snapshots.add(snapshots + u64::from(last), vtp);
        }
        if output.bin {
            of_snapshots.add(snapshots, bin);
        }
        let mut all = of_snapshots;
        all.add(1, rows * HISTORY_ROW);
        // Summary, record and scene are as good as nothing beside the rest.
        all.add(3, 4000);
        if output.vtp {
            all.add(1, 80 * (snapshots + 1));
        }
        if output.bin {
            all.add(1, bin);
        }
        if output.csv {
            all.add(
                if assembly.clumps.is_empty() { 1 } else { 2 },
                csv / if assembly.clumps.is_empty() { 1 } else { 2 },
            );
        }
        Forecast { rows, snapshots, of_snapshots, all }
    }
}

/// Bytes of a row of the history with numbers of usual length.
const HISTORY_ROW: u64 = 220;

/// Bytes of a snapshot, of a binary file, and of the tables of grains, of numbers of full length.
fn sizes(assembly: &Assembly) -> (u64, u64, u64) {
    let digits = DVec3::new(1.0, -2.0, 3.0) / 7.0;
    let grain =
        Grain { position: digits, velocity: digits, spin: digits, radius: 1.0 / 7.0, material: 0, fixed: false };
    let clump = Clump {
        shape: 0,
        first: 0,
        position: digits,
        orientation: DQuat::from_rotation_y(0.3) * DQuat::from_rotation_x(0.7),
        velocity: digits,
        spin: digits,
        radius: 1.0 / 7.0,
        material: 0,
        fixed: false,
    };
    let (materials, shapes) = (&assembly.materials[..], &assembly.shapes[..]);
    let clumped = !assembly.clumps.is_empty();
    // Bytes are what they are without grains, and as many more for each.
    let bytes = |write: &dyn Fn(&mut Counter, &[Grain], &[Clump], &[u32]) -> io::Result<()>| {
        let of = |grains: usize, clumps: usize| {
            let mut counter = Counter(0);
            let owners = vec![0; if clumped { grains } else { 0 }];
            // Counting does not fail.
            let _ = write(&mut counter, &vec![grain; grains], &vec![clump; clumps], &owners);
            counter.0 as f64
        };
        let one = usize::from(clumped);
        let base = of(1, one);
        let more = |each: f64, count: usize| each / SAMPLE as f64 * (count.max(1) - 1) as f64;
        let grains = more(of(1 + SAMPLE, one) - base, assembly.grains.len());
        let clumps = if clumped { more(of(1, one + SAMPLE) - base, assembly.clumps.len()) } else { 0.0 };
        (base + grains + clumps) as u64
    };
    let vtp = bytes(&|out, grains, _, owners| vtp::write(out, 1.0 / 7.0, grains, owners));
    let bin = bytes(&|out, grains, clumps, owners| {
        let names = Names { dimension: assembly.dimension, materials, shapes, owners };
        grain_file::write(out, &Moment { step: 0, time: 0.0, grains, clumps }, &names)
    });
    let csv = bytes(&|out, grains, clumps, _| {
        csv::grains(&mut *out, grains, materials)?;
        if clumped { csv::clumps(out, clumps, shapes, materials) } else { Ok(()) }
    });
    (vtp, bin, csv)
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
        let stop = |time, steps| Stop { time, steps, equilibrium: None };
        assert_eq!(last_step(&stop(Some(0.3), None), 0.1), Some(3));
        assert_eq!(last_step(&stop(Some(0.25), Some(10)), 0.1), Some(3));
        assert_eq!(last_step(&stop(Some(1e-9), None), 0.1), Some(1));
        assert_eq!(last_step(&stop(None, None), 0.1), None);
    }
}
