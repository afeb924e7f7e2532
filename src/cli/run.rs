//! `packstone run`

use super::common::{INTERRUPTED, STOPPED, SceneArgs, UNSURE, complain, engines, note, say, size, stem, warn};
use super::progress::Progress;
use packstone::{
    Error,
    io::{
        Folder, Record, Results,
        schedule::{Amount, Forecast, Schedule},
        summary::{Ending, Relaxation, Summary},
    },
    measure::Sample,
    scene::{Scene, grain_file::Moment},
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
                        The result takes the place of the one in the folder when it is complete; until then, and if the \
                        run ends early, it is in the folder partial there.\n\n\
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
    let file = &args.scene.scene;
    let folder = args.out.clone().unwrap_or_else(|| Path::new("out").join(stem(file)));
    // A folder that is asked for may have the result of any scene.
    Folder::check(&folder, args.out.is_none().then_some(file))?;
    let options = Options { engine: args.engine, ..args.scene.options() };
    let simulation = Simulation::new(assembly, options)?;
    say(simulation.notice());
    listen()?;
    // Only now, so that a scene that cannot run leaves no trace.
    let command = std::env::args_os().skip(1).map(|argument| argument.to_string_lossy().into_owned()).collect();
    let record = Record::new(&scene, &simulation, command);
    let results = Results::create(&folder, Some(file), &scene, simulation.assembly(), record)?;
    results.notices().iter().for_each(note);
    let schedule = Schedule::new(simulation.assembly(), simulation.dt());
    if let Some(flood) = schedule.end.and_then(|end| flood(&Forecast::new(simulation.assembly(), &schedule, end))) {
        note(flood);
    }
    let mut run = Run::new(simulation, results, schedule);
    let end = run.drive()?;
    let written = run.write(&scene, &end);
    let Written { summary, place, spoilt } = match written {
        Err(error @ Error::Io { .. }) => {
            complain(format!("{error}; the last state could not be written anywhere"));
            return Ok(ExitCode::from(STOPPED));
        }
        written => written?,
    };
    if let Some(Relaxation { force_balance_max: Some(worst), force_balance_grain: Some(grain), .. }) =
        summary.relaxation
    {
        say(format!("forces on a grain balance to {worst:.1e} of its weight or more (grain {grain})"));
    }
    summary.doubts.iter().for_each(warn);
    say(format!("results in {}", place.display()));
    if place != folder && spoilt.is_none() {
        note(format!("{} keeps the older result, as this run did not come to its end", folder.display()));
    }
    if let Some(error) = &spoilt {
        complain(format!("{error}; the last state is in {}", place.display()));
    }
    Ok(match end {
        End::Stopped(error) => {
            // If that was the error, it has been said.
            if spoilt.is_none() || !matches!(error, Error::Io { .. }) {
                complain(error);
            }
            ExitCode::from(STOPPED)
        }
        _ if spoilt.is_some() => ExitCode::from(STOPPED),
        End::Reached | End::AtRest if args.strict && !summary.doubts.is_empty() => ExitCode::from(UNSURE),
        End::Reached | End::AtRest => ExitCode::SUCCESS,
        End::Interrupted => ExitCode::from(INTERRUPTED),
    })
}

/// More snapshots than that are announced, files and bytes.
const MANY: Amount = Amount { files: 1000, bytes: 1_000_000_000 };

/// What is said of many snapshots before they are written.
fn flood(forecast: &Forecast) -> Option<String> {
    let Amount { files, bytes } = forecast.of_snapshots;
    (files > MANY.files || bytes > MANY.bytes).then(|| {
        format!(
            "snapshots will be {files} files, {}; longer output.snapshots or fewer output.formats make them less",
            size(bytes)
        )
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
    /// By an error.
    Stopped(Error),
}

/// What there is of a run in the end.
struct Written {
    summary: Summary,
    /// Where.
    place: PathBuf,
    /// Why the results are not where they should be.
    spoilt: Option<Error>,
}

struct Run {
    simulation: Simulation,
    results: Results,
    schedule: Schedule,
    start: Instant,
    /// When the last row was written, and what it says.
    row: (Instant, Option<Sample>),
    /// Over the radius: with a larger overlap the time step is above its bound.
    stable_overlap: f64,
}

impl Run {
    fn new(simulation: Simulation, results: Results, schedule: Schedule) -> Run {
        let assembly = simulation.assembly();
        let start = Instant::now();
        Run {
            results,
            schedule,
            start,
            row: (start, None),
            stable_overlap: if assembly.solver.allow_unstable { f64::INFINITY } else { simulation.stable_overlap() },
            simulation,
        }
    }

    fn drive(&mut self) -> packstone::Result<End> {
        let mut progress = Progress::start(&self.simulation, self.schedule.end);
        let end = loop {
            match self
                .pause()
                .and_then(|end| if end.is_none() { self.advance(&mut progress) } else { Ok(()) }.map(|()| end))
            {
                Ok(Some(end)) => break end,
                Ok(None) => {}
                // What the simulation still holds is the last good state, also where the device gave up or the disk is full.
                Err(error @ (Error::Run { .. } | Error::Lacking(_) | Error::Device(_) | Error::Io { .. })) => {
                    break End::Stopped(error);
                }
                Err(error) => return Err(error),
            }
        };
        progress.finish(&self.simulation);
        Ok(end)
    }

    /// Whatever is due at this step, and whether it is the last one.
    fn pause(&mut self) -> packstone::Result<Option<End>> {
        let step = self.simulation.step();
        let last = Some(step) == self.schedule.end;
        if self.schedule.snapshots.as_mut().is_some_and(|clock| clock.strikes(step)) {
            self.snapshot()?;
        }
        let (mut at_rest, mut unstable, mut impossible) = (false, None, None);
        if self.schedule.history.strikes(step) || last {
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
        let next = self.schedule.next();
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
        self.results.history(&sample, self.rate(&sample))?;
        self.row = (Instant::now(), Some(sample));
        Ok(sample)
    }

    /// Particle-steps/s since the row before.
    fn rate(&self, sample: &Sample) -> f64 {
        let (then, last) = &self.row;
        let steps = sample.step - last.as_ref().map_or(0, |last| last.step);
        let work = steps as f64 * self.simulation.assembly().grains.len() as f64;
        if work > 0.0 { work / then.elapsed().as_secs_f64() } else { 0.0 }
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

    /// The last state and the summary. Where they cannot be written they go somewhere else.
    fn write(mut self, scene: &Scene, end: &End) -> packstone::Result<Written> {
        let wall_seconds = self.start.elapsed().as_secs_f64();
        let (step, time) = (self.simulation.step(), self.simulation.time());
        let of_now = self.row.1.filter(|sample| sample.step == step);
        let sample = of_now.map_or_else(|| self.simulation.sample(), Ok)?;
        let mut row = of_now.is_none().then(|| self.rate(&sample));
        let (converged, stopped) = match end {
            End::Reached | End::AtRest => (self.is_at_rest(&sample), None),
            End::Interrupted => (false, Some(format!("interrupted at step {step}"))),
            End::Stopped(error) => (false, Some(error.to_string())),
        };
        let (grains, clumps) = (self.simulation.grains()?, self.simulation.clumps()?);
        let ended = match end {
            End::Reached => "last step".to_owned(),
            End::AtRest => "at rest".to_owned(),
            End::Interrupted | End::Stopped(_) => stopped.clone().unwrap_or_default(),
        };
        let ending = Ending { wall_seconds, converged, stopped };
        let summary = Summary::new(scene.name(), &mut self.simulation, &sample, &grains, &clumps, ending)?;
        let moment = Moment { step, time, grains: &grains, clumps: &clumps };
        let mut spoilt = None;
        let mut results = self.results;
        loop {
            let written =
                row.take().map_or(Ok(()), |rate| results.history(&sample, rate).inspect_err(|_| row = Some(rate)));
            let Err(error) = written.and_then(|()| results.finish(&summary, &moment)) else { break };
            spoilt = spoilt.or(Some(error));
            results.elsewhere()?;
        }
        let complete = spoilt.is_none() && matches!(end, End::Reached | End::AtRest);
        let place = results.place().to_owned();
        Ok(match results.close(&ended, complete) {
            Ok(place) => Written { summary, place, spoilt },
            // All of it is there, but for the last word or the right place.
            Err(error) => Written { summary, place, spoilt: spoilt.or(Some(error)) },
        })
    }
}
