//! `packstone run`

use super::common::{INTERRUPTED, STOPPED, SceneArgs, UNSURE, complain, engines, say, stem, warn};
use super::progress::Progress;
use packstone::{
    Error,
    io::{
        Results,
        summary::{Ending, Relaxation, Summary},
    },
    measure::Sample,
    scene::{Assembly, Stop, grain_file::Moment},
    simulation::{EngineChoice, Options, Simulation},
};
use std::{
    path::{Path, PathBuf},
    process::ExitCode,
    sync::atomic::{AtomicBool, Ordering},
    time::Instant,
};

/// Simulate a scene and write its results to a folder
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  packstone run examples/scenes/heap_2d.toml\n  \
                        packstone run examples/scenes/heap_2d.toml --engine cpu --steps 1000 --out out/short\n  \
                        packstone run examples/scenes/heap_2d.toml --set solver.dt_fraction=0.1\n\n\
                        Ctrl-C ends a run early, with results; a second one ends it at once, without.")]
pub struct RunArgs {
    #[command(flatten)]
    scene: SceneArgs,
    /// Folder for the results [default: out/ and the name of the scene file]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// What to compute on; auto takes the best GPU, or the CPU if there is none but a software driver
    #[arg(long, default_value = "auto", value_parser = engines(["auto", "gpu", "cpu"]))]
    engine: EngineChoice,
    /// The same as --set stop.steps=N
    #[arg(long, value_name = "N")]
    steps: Option<u64>,
    /// Exit with code 3 if the result is doubtful
    #[arg(long)]
    strict: bool,
    /// The same as --set stop.time=T, s
    #[arg(long, value_name = "T")]
    time: Option<f64>,
}

impl RunArgs {
    fn stop(&self) -> Vec<String> {
        let steps = self.steps.map(|steps| format!("stop.steps={steps}"));
        let time = self.time.map(|time| format!("stop.time={time:?}"));
        steps.into_iter().chain(time).collect()
    }
}

pub fn run(args: &RunArgs) -> anyhow::Result<ExitCode> {
    let (scene, assembly) = args.scene.load(&args.stop())?;
    let folder = args.out.clone().unwrap_or_else(|| Path::new("out").join(stem(&args.scene.scene)));
    let options = Options { engine: args.engine, ..args.scene.options() };
    let simulation = Simulation::new(assembly, options)?;
    say(simulation.notice());
    listen()?;
    // Only now, so that a scene that cannot run leaves no trace.
    let mut run = Run::new(simulation, &folder)?;
    let end = run.drive()?;
    let summary = run.write(scene.name(), &end)?;
    if let Some(Relaxation { force_balance_max: Some(worst), force_balance_grain: Some(grain), .. }) =
        summary.relaxation
    {
        say(format!("forces on a grain balance to {worst:.1e} of its weight or more (grain {grain})"));
    }
    summary.doubts.iter().for_each(warn);
    say(format!("results in {}", folder.display()));
    Ok(match end {
        End::Reached | End::AtRest if args.strict && !summary.doubts.is_empty() => ExitCode::from(UNSURE),
        End::Reached | End::AtRest => ExitCode::SUCCESS,
        End::Interrupted => ExitCode::from(INTERRUPTED),
        End::Stopped(error) => {
            complain(error);
            ExitCode::from(STOPPED)
        }
    })
}

static CTRL_C: AtomicBool = AtomicBool::new(false);

/// Take note of Ctrl-C; a second one ends the program at once.
pub fn listen() -> anyhow::Result<()> {
    ctrlc::set_handler(|| {
        if CTRL_C.swap(true, Ordering::Relaxed) {
            std::process::exit(INTERRUPTED.into());
        }
    })?;
    Ok(())
}

/// Whether there was a Ctrl-C.
pub fn interrupted() -> bool {
    CTRL_C.load(Ordering::Relaxed)
}

/// Why a run is over.
enum End {
    /// The last step.
    Reached,
    /// Equilibrium.
    AtRest,
    Interrupted,
    /// [`Error::Run`]
    Stopped(Error),
}

/// Something that happens every so many steps, which need not be a whole number.
struct Clock {
    interval: f64,
    ticks: u64,
}

impl Clock {
    fn new(interval: f64) -> Clock {
        Clock { interval: interval.max(1.0), ticks: 0 }
    }

    /// The step at which it happens next; 0 at first.
    fn next(&self) -> u64 {
        whole(self.ticks as f64 * self.interval)
    }

    /// Whether it happens at this step, which is then over.
    fn strikes(&mut self, step: u64) -> bool {
        let now = self.next() <= step;
        self.ticks += u64::from(now);
        now
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

/// Steps between two rows of the history.
fn history_interval(assembly: &Assembly, dt: f64, end: Option<u64>) -> f64 {
    match (assembly.output.history, end) {
        (Some(seconds), _) => seconds / dt,
        (None, Some(end)) => end as f64 / 100.0,
        (None, None) => 1000.0,
    }
}

struct Run {
    simulation: Simulation,
    results: Results,
    end: Option<u64>,
    history: Clock,
    snapshots: Option<Clock>,
    start: Instant,
    /// When the last row was written, and what it says.
    row: (Instant, Option<Sample>),
    /// Over the radius: with a larger overlap the time step is above its bound.
    stable_overlap: f64,
}

impl Run {
    fn new(simulation: Simulation, folder: &Path) -> packstone::Result<Run> {
        let assembly = simulation.assembly();
        let dt = simulation.dt();
        let end = last_step(&assembly.stop, dt);
        let start = Instant::now();
        Ok(Run {
            results: Results::create(folder, assembly)?,
            end,
            history: Clock::new(history_interval(assembly, dt, end)),
            snapshots: assembly.output.snapshots.map(|seconds| Clock::new(seconds / dt)),
            start,
            row: (start, None),
            stable_overlap: if assembly.solver.allow_unstable { f64::INFINITY } else { simulation.stable_overlap() },
            simulation,
        })
    }

    fn drive(&mut self) -> packstone::Result<End> {
        let mut progress = Progress::start(&self.simulation, self.end);
        let end = loop {
            if let Some(end) = self.pause()? {
                break end;
            }
            match self.advance(&mut progress) {
                // What the simulation still holds is the last good state, also where the device gave up.
                Err(error @ (Error::Run { .. } | Error::Lacking(_) | Error::Device(_))) => break End::Stopped(error),
                result => result?,
            }
        };
        progress.finish(&self.simulation);
        Ok(end)
    }

    /// Whatever is due at this step, and whether it is the last one.
    fn pause(&mut self) -> packstone::Result<Option<End>> {
        let step = self.simulation.step();
        let last = Some(step) == self.end;
        if self.snapshots.as_mut().is_some_and(|clock| clock.strikes(step)) {
            self.snapshot()?;
        }
        let (mut at_rest, mut unstable, mut impossible) = (false, None, None);
        if self.history.strikes(step) || last {
            let sample = self.record()?;
            at_rest = self.is_at_rest(&sample);
            unstable = self.unstable(&sample);
            impossible = self.impossible(&sample);
        }
        Ok(match () {
            () if impossible.is_some() => impossible.map(End::Stopped),
            () if unstable.is_some() => unstable.map(End::Stopped),
            () if at_rest => Some(End::AtRest),
            () if last => Some(End::Reached),
            () if interrupted() => Some(End::Interrupted),
            () => None,
        })
    }

    /// Up to the next step at which something is due, or until Ctrl-C.
    fn advance(&mut self, progress: &mut Progress) -> packstone::Result<()> {
        let next = [Some(self.history.next()), self.snapshots.as_ref().map(Clock::next), self.end];
        let next = next.into_iter().flatten().min().expect("there is always a next row");
        while self.simulation.step() < next {
            self.simulation.advance_chunk(next - self.simulation.step())?;
            progress.update(&self.simulation);
            if interrupted() {
                break;
            }
        }
        Ok(())
    }

    /// A row of the history.
    fn record(&mut self) -> packstone::Result<Sample> {
        let sample = self.simulation.sample()?;
        let (then, last) = &self.row;
        let steps = sample.step - last.as_ref().map_or(0, |last| last.step);
        let work = steps as f64 * self.simulation.assembly().grains.len() as f64;
        let rate = if work > 0.0 { work / then.elapsed().as_secs_f64() } else { 0.0 };
        self.results.history(&sample, rate)?;
        self.row = (Instant::now(), Some(sample));
        Ok(sample)
    }

    /// Elastic spheres get stiffer the deeper they overlap, beyond what the time step was chosen for.
    fn unstable(&self, sample: &Sample) -> Option<Error> {
        let overlap = sample.max_overlap_over_radius;
        (overlap > self.stable_overlap).then(|| Error::Run {
            step: sample.step,
            time: self.simulation.time(),
            reason: format!(
                "an overlap has grown to {overlap:.3} radii, where contacts are too stiff for solver.dt = {:e} s; at most {:.3} is stable: use \
                 a smaller solver.dt or stiffer grains, or set solver.allow_unstable = true",
                self.simulation.dt(),
                self.stable_overlap
            ),
        })
    }

    /// Sums that are no numbers are no results.
    fn impossible(&self, sample: &Sample) -> Option<Error> {
        let energies = sample.kinetic_energy + sample.potential_energy + sample.elastic_energy + sample.dissipation;
        (!energies.is_finite() || sample.unbalanced_force_ratio.is_nan()).then(|| Error::Run {
            step: sample.step,
            time: self.simulation.time(),
            reason: "energies or forces are no numbers any more; spins, stiffnesses or masses are too large to calculate with"
                .to_owned(),
        })
    }

    fn snapshot(&mut self) -> packstone::Result<()> {
        let grains = self.simulation.grains()?;
        let clumps = if self.simulation.assembly().output.bin { self.simulation.clumps()? } else { Vec::new() };
        let (step, time) = (self.simulation.step(), self.simulation.time());
        self.results.snapshot(&Moment { step, time, grains: &grains, clumps: &clumps })
    }

    fn is_at_rest(&self, sample: &Sample) -> bool {
        self.simulation.assembly().stop.equilibrium.is_some_and(|tolerance| sample.at_rest(tolerance))
    }

    /// The last state and the summary.
    fn write(mut self, scene: &str, end: &End) -> packstone::Result<Summary> {
        let wall_seconds = self.start.elapsed().as_secs_f64();
        let step = self.simulation.step();
        let sample = match self.row.1.take().filter(|sample| sample.step == step) {
            Some(sample) => sample,
            None => self.record()?,
        };
        let (converged, stopped) = match end {
            End::Reached | End::AtRest => (self.is_at_rest(&sample), None),
            End::Interrupted => (false, Some(format!("interrupted at step {step}"))),
            End::Stopped(error) => (false, Some(error.to_string())),
        };
        let (grains, clumps) = (self.simulation.grains()?, self.simulation.clumps()?);
        let ending = Ending { wall_seconds, converged, stopped };
        let summary = Summary::new(scene, &mut self.simulation, &sample, &grains, &clumps, ending)?;
        let time = self.simulation.time();
        self.results.finish(&summary, &Moment { step, time, grains: &grains, clumps: &clumps })?;
        Ok(summary)
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
