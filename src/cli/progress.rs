//! How far a run is: a bar on a terminal, lines everywhere else.

use super::common::{is_quiet, tell};
use indicatif::{ProgressBar, ProgressStyle};
use packstone::simulation::Simulation;
use std::{
    io::{IsTerminal, stderr},
    time::{Duration, Instant},
};

/// Without an end in sight, a line as often as that.
const PATIENCE: Duration = Duration::from_secs(10);

pub struct Progress {
    start: Instant,
    /// The step from which on.
    first: u64,
    /// Last step, if it is known.
    end: Option<u64>,
    bar: Option<ProgressBar>,
    /// Tenths of the run that have been reported.
    tenths: u64,
    last_line: Instant,
}

impl Progress {
    pub fn start(simulation: &Simulation, end: Option<u64>) -> Progress {
        let bar = (stderr().is_terminal() && !is_quiet()).then(|| bar(end));
        let start = Instant::now();
        let progress = Progress { start, first: simulation.step(), end, bar, tenths: 0, last_line: start };
        if progress.bar.is_none() {
            tell(progress.line(simulation));
        }
        progress
    }

    pub fn update(&mut self, simulation: &Simulation) {
        if let Some(bar) = &self.bar {
            bar.set_position(simulation.step());
            bar.set_message(self.rate(simulation));
            return;
        }
        let tenths = self.end.map_or(0, |end| 10 * simulation.step() / end);
        // The last tenth is the final line.
        let due = self.end.map_or(self.last_line.elapsed() > PATIENCE, |_| tenths > self.tenths && tenths < 10);
        if due {
            tell(self.line(simulation));
            (self.tenths, self.last_line) = (tenths, Instant::now());
        }
    }

    /// The last word.
    pub fn finish(self, simulation: &Simulation) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
        tell(format!("{}, {:.1} s of wall time", self.line(simulation), self.start.elapsed().as_secs_f64()));
    }

    fn line(&self, simulation: &Simulation) -> String {
        let step = simulation.step();
        let of = self.end.map_or(String::new(), |end| format!(" of {end} ({} %)", 100 * step / end));
        let left = match self.end {
            Some(end) if step > self.first && step < end => {
                let left = self.start.elapsed().as_secs_f64() * (end - step) as f64 / (step - self.first) as f64;
                format!(", {left:.0} s left")
            }
            _ => String::new(),
        };
        format!("step {step}{of}, {}{left}", self.rate(simulation))
    }

    /// Simulated time and speed; at the very start there is no speed yet.
    fn rate(&self, simulation: &Simulation) -> String {
        let time = format!("t = {:.4e} s", simulation.time());
        match simulation.step() - self.first {
            0 => time,
            steps => {
                let work = steps as f64 * simulation.assembly().grains.len() as f64;
                format!("{time}, {:.2e} particle-steps/s", work / self.start.elapsed().as_secs_f64())
            }
        }
    }
}

fn bar(end: Option<u64>) -> ProgressBar {
    let (bar, template) = match end {
        Some(end) => (ProgressBar::new(end), "{wide_bar} {percent} %, {msg}, {eta} left"),
        None => (ProgressBar::new_spinner(), "{spinner} step {pos}, {msg}"),
    };
    bar.with_style(ProgressStyle::with_template(template).expect("a valid template"))
}
