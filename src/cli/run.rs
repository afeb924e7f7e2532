//! `packstone run`

use super::common::{DeviceArgs, INTERRUPTED, STOPPED, UNSURE, complain, engines, load, note, say, stem, warn};
use super::progress::Progress;
use packstone::{
    Error,
    io::{
        Folder, Record, Results, Resumed, folder, names, record,
        schedule::Schedule,
        summary::{Ending, Relaxation, Summary},
    },
    measure::Sample,
    scene::{Assembly, Scene, grain_file::Moment},
    simulation::{Checkpoint, EngineChoice, Options, Simulation},
};
use serde::{Deserialize, Serialize};
use std::{
    io::ErrorKind,
    path::{Path, PathBuf},
    process::ExitCode,
    sync::atomic::{AtomicBool, Ordering},
    time::{Duration, Instant},
};

/// Simulate a scene and write its results to a folder
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  packstone run examples/scenes/heap_2d.toml\n  \
                        packstone run examples/scenes/heap_2d.toml --engine cpu --steps 1000 --out out/short\n  \
                        packstone run examples/scenes/heap_2d.toml --set solver.dt_fraction=0.1\n\n\
                        Ctrl-C ends a run early, with results; a second one ends it at once, without.")]
pub struct RunArgs {
    /// Scene file
    #[arg(required_unless_present = "resume")]
    scene: Option<PathBuf>,
    /// Change a value of the scene, such as solver.dt=1e-6; may be repeated
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    #[command(flatten)]
    device: DeviceArgs,
    /// Go on with the run whose result is in DIR, from its last checkpoint, as if it had never been interrupted; --time
    /// and --steps move its end
    #[arg(long, value_name = "DIR", conflicts_with_all = ["scene", "set", "out", "engine", "precision"])]
    resume: Option<PathBuf>,
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
    let Begun { scene, folder, mut run } = match (&args.resume, &args.scene) {
        (Some(folder), _) => resume(args, folder)?,
        (None, Some(file)) => begin(args, file)?,
        (None, None) => unreachable!("clap asks for one of them"),
    };
    say(run.simulation.notice());
    run.results.notices().iter().for_each(note);
    let end = run.drive()?;
    if let End::Stopped(error @ Error::Device(_)) = end {
        // Nothing can be asked of it any more.
        complain(format!("{error}; {}", run.way_on(&folder)));
        return Ok(ExitCode::from(STOPPED));
    }
    let Written { summary, end, place, spoilt } = run.write(&scene, end)?;
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

/// A run that is about to go on.
struct Begun {
    scene: Scene,
    folder: PathBuf,
    run: Run,
}

fn begin(args: &RunArgs, file: &Path) -> anyhow::Result<Begun> {
    let (scene, assembly) = load(file, &[&args.set[..], &args.stop()].concat())?;
    let folder = args.out.clone().unwrap_or_else(|| Path::new("out").join(stem(file)));
    // A folder that is asked for may have the result of any scene.
    Folder::check(&folder, args.out.is_none().then_some(file))?;
    let options = Options { engine: args.engine, ..args.device.options() };
    let simulation = Simulation::new(assembly, options)?;
    listen()?;
    // Only now, so that a scene that cannot run leaves no trace.
    let record = Record::new(&scene, &simulation, command());
    let results = Results::create(&folder, Some(file), &scene, simulation.assembly(), record)?;
    let run = Run::new(simulation, results);
    Ok(Begun { scene, folder, run })
}

fn resume(args: &RunArgs, folder: &Path) -> anyhow::Result<Begun> {
    let nothing = || Error::Folder(format!("{}: has no result that could be continued", folder.display()));
    let from = folder::resumable(folder).into_iter().next().ok_or_else(nothing)?;
    let record = Record::read(&from).ok_or_else(nothing)?;
    let (scene, assembly) = load(&from.join(record.scene_as_run.ok_or_else(nothing)?), &args.stop())?;
    let (simulation, so_far) = latest_checkpoint(&from, &assembly, args.device.options())?;
    let SoFar { mut schedule, wall_seconds } = so_far;
    if args.steps.is_some() || args.time.is_some() {
        schedule.end = Schedule::new(&assembly, simulation.dt()).end;
    }
    let (step, dt) = (simulation.step(), simulation.dt());
    if schedule.end.is_some_and(|end| end <= step) {
        return Err(Error::Folder(format!(
            "{}: the run has come to its last step, {step} (t = {:e} s); --time and --steps take it further",
            folder.display(),
            simulation.time()
        ))
        .into());
    }
    listen()?;
    let resumed = Resumed { start: record::now(), command: command(), step };
    let snapshots = schedule.snapshots.iter().flat_map(|clock| clock.past()).map(|step| (step, step as f64 * dt));
    let (rows, snapshots) = (schedule.history.ticks, snapshots.collect());
    let results = Results::resume(folder, &from, simulation.assembly(), resumed, rows, snapshots)?;
    note(format!("goes on from step {step}"));
    let run = Run { schedule, earlier: wall_seconds, saved: Some(step), ..Run::new(simulation, results) };
    Ok(Begun { scene, folder: folder.to_owned(), run })
}

/// The simulation at the last checkpoint in a folder that is whole.
fn latest_checkpoint(folder: &Path, assembly: &Assembly, options: Options) -> packstone::Result<(Simulation, SoFar)> {
    let of = |path: &Path| {
        let mut checkpoint = Checkpoint::open(path)?;
        let so_far = serde_json::from_value(checkpoint.about().run.clone());
        let so_far = so_far.map_err(|e| Error::Scene(format!("{}: {e}", path.display())))?;
        Simulation::resume(assembly.clone(), options, &mut checkpoint).map(|simulation| (simulation, so_far))
    };
    let (latest, previous) = (folder.join(names::CHECKPOINT), folder.join(names::PREVIOUS));
    match of(&latest) {
        Err(error @ (Error::Scene(_) | Error::Io { .. })) if previous.exists() => {
            warn(format!("{error}; this is the checkpoint before it"));
            of(&previous)
        }
        Err(Error::Io { source, .. }) if source.kind() == ErrorKind::NotFound => {
            Err(Error::Folder(format!("{}: has no checkpoint to go on from", folder.display())))
        }
        result => result,
    }
}

/// What a checkpoint has of the run.
#[derive(Serialize, Deserialize)]
struct SoFar {
    schedule: Schedule,
    wall_seconds: f64,
}

/// Arguments of the command line.
fn command() -> Vec<String> {
    std::env::args().skip(1).collect()
}

static CTRL_C: AtomicBool = AtomicBool::new(false);

/// Signals that come sooner after the first are taken for the same: some programs send one to the process and one to its
/// group.
const SAME_SIGNAL: Duration = Duration::from_secs(1);

/// Take note of Ctrl-C; a second one ends the program at once.
pub fn listen() -> anyhow::Result<()> {
    let mut first: Option<Instant> = None;
    ctrlc::set_handler(move || {
        CTRL_C.store(true, Ordering::Relaxed);
        if first.get_or_insert_with(Instant::now).elapsed() > SAME_SIGNAL {
            std::process::exit(INTERRUPTED.into());
        }
    })?;
    Ok(())
}

/// Whether there was a Ctrl-C.
pub fn interrupted() -> bool {
    CTRL_C.load(Ordering::Relaxed)
}

/// A chunk of steps should take no longer, so that Ctrl-C is noticed and checkpoints come in time.
const CHUNK: Duration = Duration::from_millis(250);

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
    end: End,
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
    /// Wall time before that, of a run that goes on, s.
    earlier: f64,
    /// When the last checkpoint was written, or none was yet, and its step.
    checkpointed: Instant,
    saved: Option<u64>,
    /// Steps of a chunk that take about as long as [`CHUNK`].
    most_steps: u64,
    /// When the last row was written, and what it says.
    row: (Instant, Option<Sample>),
    /// Over the radius: with a larger overlap the time step is above its bound.
    stable_overlap: f64,
}

impl Run {
    fn new(simulation: Simulation, results: Results) -> Run {
        let assembly = simulation.assembly();
        let start = Instant::now();
        Run {
            results,
            schedule: Schedule::new(assembly, simulation.dt()),
            start,
            earlier: 0.0,
            checkpointed: start,
            saved: None,
            most_steps: 1,
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
        let (mut at_rest, mut fault) = (false, None);
        if self.schedule.history.strikes(step) {
            let sample = self.record()?;
            at_rest = self.is_at_rest(&sample);
            fault = self.fault(&sample);
        }
        Ok(match () {
            () if fault.is_some() => fault.map(End::Stopped),
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
            let every = self.simulation.assembly().output.checkpoint;
            if every > 0.0 && self.checkpointed.elapsed().as_secs_f64() >= every {
                self.checkpoint()?;
            }
            let begin = Instant::now();
            let steps = self.simulation.advance_chunk(self.most_steps.min(next - self.simulation.step()))?;
            self.most_steps = ((steps as f64 * CHUNK.as_secs_f64() / begin.elapsed().as_secs_f64()) as u64).max(1);
            progress.update(&self.simulation);
            if interrupted() {
                break;
            }
        }
        Ok(())
    }

    /// Write one. What is due at this step has been done.
    fn checkpoint(&mut self) -> packstone::Result<()> {
        let Run { simulation, results, schedule, .. } = self;
        let so_far = SoFar { schedule: *schedule, wall_seconds: self.earlier + self.start.elapsed().as_secs_f64() };
        results.checkpoint(|path| simulation.save(path, &so_far))?;
        (self.checkpointed, self.saved) = (Instant::now(), Some(simulation.step()));
        Ok(())
    }

    /// How to go on with a run that could not write its results.
    fn way_on(&self, folder: &Path) -> String {
        match self.saved {
            Some(step) => format!(
                "the last checkpoint is of step {step}: packstone run --resume {} goes on from it",
                folder.display()
            ),
            None => "there is no checkpoint yet".to_owned(),
        }
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

    /// Why a run cannot go on.
    fn fault(&self, sample: &Sample) -> Option<Error> {
        self.impossible(sample).or_else(|| self.unstable(sample))
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
    fn write(mut self, scene: &Scene, end: End) -> packstone::Result<Written> {
        let wall_seconds = self.earlier + self.start.elapsed().as_secs_f64();
        let mut spoilt = None;
        // Before anything is asked of the simulation that could make new lists.
        while self.simulation.assembly().output.checkpoint > 0.0
            && let Err(error) = self.checkpoint()
        {
            if !matches!(error, Error::Io { .. }) {
                return Err(error);
            }
            spoilt = spoilt.or(Some(error));
            self.results.elsewhere()?;
        }
        let (step, time) = (self.simulation.step(), self.simulation.time());
        let of_now = self.row.1.filter(|sample| sample.step == step);
        let sample = of_now.map_or_else(|| self.simulation.sample(), Ok)?;
        let mut row = of_now.is_none().then(|| self.rate(&sample));
        let end = match end {
            End::Reached | End::Interrupted => self.fault(&sample).map_or(end, End::Stopped),
            end => end,
        };
        let (converged, stopped) = match &end {
            End::Reached | End::AtRest => (self.is_at_rest(&sample), None),
            End::Interrupted => (false, Some(format!("interrupted at step {step}"))),
            End::Stopped(error) => (false, Some(error.to_string())),
        };
        let (grains, clumps) = (self.simulation.grains()?, self.simulation.clumps()?);
        let ended = match &end {
            End::Reached => "last step".to_owned(),
            End::AtRest => "at rest".to_owned(),
            End::Interrupted | End::Stopped(_) => stopped.clone().unwrap_or_default(),
        };
        let ending = Ending { wall_seconds, converged, stopped };
        let summary = Summary::new(scene.name(), &mut self.simulation, &sample, &grains, &clumps, ending)?;
        let moment = Moment { step, time, grains: &grains, clumps: &clumps };
        let mut results = self.results;
        loop {
            let written =
                row.take().map_or(Ok(()), |rate| results.history(&sample, rate).inspect_err(|_| row = Some(rate)));
            let Err(error) = written.and_then(|()| results.finish(&summary, &moment)) else { break };
            spoilt = spoilt.or(Some(error));
            results.elsewhere()?;
        }
        let complete = spoilt.is_none() && matches!(end, End::Reached | End::AtRest);
        let place = results.close(&ended, complete)?;
        Ok(Written { summary, end, place, spoilt })
    }
}
