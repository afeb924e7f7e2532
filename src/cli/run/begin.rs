//! How a run begins: at time 0 of a scene, at a checkpoint of itself, or with the last state of another run.

use super::super::{
    common::{DeviceArgs, engines, note, warn},
    from::From,
    last::{CHECKPOINTS, Last, last},
};
use super::{
    drive::{Goal, Run, SoFar},
    frames::{FrameArgs, Frames},
    interrupt::{interrupted, listen},
};
use packstone::{
    Error,
    io::{Record, Results, Resumed, folder, record, schedule::Schedule},
    scene::{Assembly, Scene},
    simulation::{Checkpoint, EngineChoice, Options, Simulation},
};
use std::path::{Path, PathBuf};

/// Simulate a scene and write its results to a folder
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  packstone run examples/scenes/heap_2d.toml\n  \
                        packstone run examples/scenes/heap_2d.toml --engine cpu --steps 1000 --out out/short\n  \
                        packstone run examples/scenes/heap_2d.toml --set solver.dt_fraction=0.1\n  \
                        packstone run examples/scenes/heap_2d.toml --frames 100 --color speed\n  \
                        packstone run --resume out/heap_2d\n  \
                        packstone run sheared.toml --from out/heap_2d\n  \
                        packstone run triaxial.toml --from-stage load\n\n\
                        The result takes the place of the one in the folder when it is complete; until then, and if the \
                        run ends early, it is in the folder partial there.\n\n\
                        Ctrl-C ends a run early, with results; a second one ends it at once, without. A run that was \
                        interrupted, killed or cut off by a power failure is continued by --resume from its last \
                        checkpoint: there is one every output.checkpoint seconds (600) and at every end.")]
pub struct RunArgs {
    /// Scene file
    #[arg(required_unless_present = "resume")]
    pub scene: Option<PathBuf>,
    /// Change a value of the scene, such as solver.dt=1e-6; may be repeated
    #[arg(long, value_name = "KEY=VALUE")]
    pub set: Vec<String>,
    #[command(flatten)]
    device: DeviceArgs,
    /// Go on with the run whose result is in DIR, from its last checkpoint, as if it had never been interrupted; --time
    /// and --steps move its end
    #[arg(long, value_name = "DIR", conflicts_with_all = ["scene", "set", "out", "engine", "precision"])]
    pub resume: Option<PathBuf>,
    /// Begin with the grains of the result in DIR, as they are there in its last checkpoint, and with what their contacts
    /// remember. Grains and walls that both scenes have go on from where they are; all others are as the scene says
    #[arg(long, value_name = "DIR", conflicts_with = "resume")]
    pub from: Option<PathBuf>,
    /// Of a scene with stages: run this one alone, from the state of the one before in the result that is there, and keep
    /// the others
    #[arg(long, value_name = "STAGE", conflicts_with_all = ["resume", "from"])]
    pub only: Option<String>,
    /// Of a scene with stages: run this one and all behind it, and keep those before it
    #[arg(long, value_name = "STAGE", conflicts_with_all = ["resume", "from", "only"])]
    pub from_stage: Option<String>,
    /// Folder for the results [default: out/ and the name of the scene file]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// What to compute on; auto takes the best GPU, or the CPU if there is none but a software driver
    #[arg(long, default_value = "auto", value_parser = engines(["auto", "gpu", "cpu"]))]
    pub engine: EngineChoice,
    /// The same as --set stop.steps=N, in every stage
    #[arg(long, value_name = "N")]
    steps: Option<u64>,
    /// Print the content of summary.json, and where the result is (folder), instead of words
    #[arg(long)]
    pub json: bool,
    /// Exit with code 3 if the result is doubtful
    #[arg(long)]
    pub strict: bool,
    /// The same as --set stop.time=T, s, in every stage
    #[arg(long, value_name = "T")]
    time: Option<f64>,
    #[command(flatten)]
    pub frames: FrameArgs,
}

impl RunArgs {
    /// Those of the scene.
    pub fn options(&self) -> Options {
        Options { engine: self.engine, interrupted, ..self.device.options() }
    }

    pub fn stop(&self) -> Vec<String> {
        let steps = self.steps.map(|steps| format!("stop.steps={steps}"));
        let time = self.time.map(|time| format!("stop.time={time:?}"));
        steps.into_iter().chain(time).collect()
    }
}

/// A run that is about to go on.
pub struct Begun {
    pub scene: Scene,
    pub folder: PathBuf,
    pub run: Run,
}

impl Begun {
    /// At time 0. Only now anything changes on the disk, so that a scene that cannot run leaves no trace.
    pub fn new(folder: &Path, file: Option<&Path>, ready: Ready, frames: &FrameArgs) -> anyhow::Result<Begun> {
        let Ready { scene, simulation, older } = ready;
        listen()?;
        let record = Record::new(&scene, &simulation, command());
        let results = Results::create(folder, file, &scene, simulation.assembly(), record)?;
        let schedule = Schedule::new(simulation.assembly(), simulation.dt());
        let frames = frames.begin(results.place(), &schedule)?;
        let mut run = Run::new(simulation, results, schedule, frames);
        if older.is_some() {
            run.inherited = run.simulation.sample()?.max_overlap_over_radius;
        }
        Ok(Begun { scene, folder: folder.to_owned(), run })
    }
}

/// A scene at time 0.
pub struct Ready {
    pub scene: Scene,
    pub simulation: Simulation,
    /// The state of another run that it goes on with, whose grains are in a file until the folder of the result has a copy.
    pub older: Option<From>,
}

impl Ready {
    /// With the last state of another run.
    pub fn from(scene: &Scene, folder: &Path, options: Options) -> anyhow::Result<Ready> {
        let from = From::read(scene, folder)?;
        Ok(Ready { scene: from.scene().clone(), simulation: from.simulation(options)?, older: Some(from) })
    }
}

/// The scene of a run in one go, at its time 0.
///
/// # Errors
/// For scenes and checkpoints that cannot be run, and where `check`, of the folder, fails.
pub fn start(args: &RunArgs, scene: Scene, check: impl Fn() -> packstone::Result<()>) -> anyhow::Result<Ready> {
    if let Some(from) = &args.from {
        check()?;
        return Ready::from(&scene, from, args.options());
    }
    let assembly = scene.assemble()?;
    assembly.notices.iter().for_each(note);
    check()?;
    Ok(Ready { scene, simulation: Simulation::new(assembly, args.options())?, older: None })
}

/// Go on with a run that was interrupted, or take one further.
pub fn resume(args: &RunArgs, folder: &Path) -> anyhow::Result<Begun> {
    let folders = folder::resumable(folder)?;
    let options = Options { interrupted, ..args.device.options() };
    let go_on = |path: &Path, checkpoint, assembly: &Assembly| at_checkpoint(path, checkpoint, assembly, options);
    let Last { from, scene, assembly, state: (simulation, so_far), .. } =
        last(&folders, &CHECKPOINTS, &args.stop(), go_on)?;
    let SoFar { mut schedule, wall_seconds, deepest, inherited, jamming, mut reached } = so_far;
    let moved = args.steps.is_some() || args.time.is_some();
    let (step, dt) = (simulation.step(), simulation.dt());
    if moved {
        (schedule.end, reached) = (Schedule::new(&assembly, dt).end, None);
    }
    let is_over = match reached {
        Some(_) => Record::read(&from).is_some_and(|record| record.complete),
        None => schedule.end.is_some_and(|end| end <= step),
    };
    if is_over {
        let rest = if reached == Some(Goal::AtRest) { ", at rest" } else { "" };
        return Err(Error::Folder(format!(
            "{}: the run is at step {step} (t = {:e} s) already{rest}; let --time or --steps be beyond that",
            folder.display(),
            simulation.time()
        ))
        .into());
    }
    listen()?;
    let resumed = Resumed { start: record::now(), command: command(), step };
    let snapshots = schedule.snapshots.iter().flat_map(|clock| clock.past()).map(|step| (step, step as f64 * dt));
    let (rows, snapshots) = (schedule.history.past().collect(), snapshots.collect());
    let results = Results::resume(folder, &from, simulation.assembly(), resumed, rows, snapshots)?;
    note(match reached {
        Some(_) => format!("had come to its end at step {step}, and writes its results"),
        None => format!("goes on from step {step}"),
    });
    let frames = Frames::resume(results.place(), step)?;
    let mut run = Run::new(simulation, results, schedule, frames);
    (run.earlier, run.saved, run.deepest) = (wall_seconds, Some(step), deepest);
    (run.inherited, run.jamming, run.reached) = (inherited, jamming, reached);
    if moved {
        // So that the new end holds from now on, whatever happens.
        run.checkpoint()?;
    }
    Ok(Begun { scene, folder: folder.to_owned(), run })
}

fn at_checkpoint(
    path: &Path,
    mut checkpoint: Checkpoint,
    assembly: &Assembly,
    options: Options,
) -> packstone::Result<(Simulation, SoFar)> {
    let so_far = serde_json::from_value(checkpoint.about().run.clone());
    let so_far = so_far.map_err(|e| Error::Scene(format!("{}: {e}", path.display())))?;
    let simulation = Simulation::resume(assembly.clone(), options, &mut checkpoint)?;
    let about = checkpoint.about();
    let (adapter, version) = (simulation.engine().adapter(), env!("CARGO_PKG_VERSION"));
    // The threads of the cpu engine leave no trace in its results.
    let on_device = simulation.engine().name() == "gpu";
    if on_device && about.adapter != adapter || about.version != version {
        warn(format!(
            "{}: is of packstone {} on {}; with packstone {version} on {adapter} the last digits may be others",
            path.display(),
            about.version,
            about.adapter
        ));
    }
    Ok((simulation, so_far))
}

/// Arguments of the command line.
pub fn command() -> Vec<String> {
    std::env::args_os().skip(1).map(|argument| argument.to_string_lossy().into_owned()).collect()
}
