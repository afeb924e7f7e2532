//! How a run begins: at time 0 of a scene, at a checkpoint of itself, or with the last state of another run.

use super::super::common::{DeviceArgs, engines, load, note, stem, warn};
use super::drive::{Run, SoFar, listen};
use packstone::{
    Error,
    io::{Folder, Record, Results, Resumed, folder, names, record, schedule::Schedule, write_state},
    scene::{Assembly, Continued, Scene, Shift, Surface, grain_file::Moment},
    simulation::{Checkpoint, ContactHistory, EngineChoice, Options, Other, Simulation},
};
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// Simulate a scene and write its results to a folder
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  packstone run examples/scenes/heap_2d.toml\n  \
                        packstone run examples/scenes/heap_2d.toml --engine cpu --steps 1000 --out out/short\n  \
                        packstone run examples/scenes/heap_2d.toml --set solver.dt_fraction=0.1\n  \
                        packstone run --resume out/heap_2d\n  \
                        packstone run sheared.toml --from out/heap_2d\n\n\
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
    set: Vec<String>,
    #[command(flatten)]
    device: DeviceArgs,
    /// Go on with the run whose result is in DIR, from its last checkpoint, as if it had never been interrupted; --time
    /// and --steps move its end
    #[arg(long, value_name = "DIR", conflicts_with_all = ["scene", "set", "out", "engine", "precision"])]
    pub resume: Option<PathBuf>,
    /// Begin with the grains of the result in DIR, as they are there in its last checkpoint, and with what their contacts
    /// remember. Grains and walls that both scenes have go on from where they are; all others are as the scene says
    #[arg(long, value_name = "DIR", conflicts_with = "resume")]
    from: Option<PathBuf>,
    /// Folder for the results [default: out/ and the name of the scene file]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// What to compute on; auto takes the best GPU, or the CPU if there is none but a software driver
    #[arg(long, default_value = "auto", value_parser = engines(["auto", "gpu", "cpu"]))]
    engine: EngineChoice,
    /// The same as --set stop.steps=N
    #[arg(long, value_name = "N")]
    steps: Option<u64>,
    /// Print the content of summary.json, and where the result is (folder), instead of words
    #[arg(long)]
    pub json: bool,
    /// Exit with code 3 if the result is doubtful
    #[arg(long)]
    pub strict: bool,
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

/// The file with the grains that a scene goes on with.
const START: &str = "start.bin";

/// A run that is about to go on.
pub struct Begun {
    pub scene: Scene,
    pub folder: PathBuf,
    pub run: Run,
}

/// # Errors
/// For scenes, folders and checkpoints that cannot be run; nothing has changed on the disk then.
pub fn begin(args: &RunArgs) -> anyhow::Result<Begun> {
    let (file, from) = match (&args.resume, &args.scene, &args.from) {
        (Some(folder), ..) => return resume(args, folder),
        (None, Some(file), from) => (file, from),
        (None, None, _) => unreachable!("clap asks for one of them"),
    };
    let folder = args.out.clone().unwrap_or_else(|| Path::new("out").join(stem(file)));
    let set = [&args.set[..], &args.stop()].concat();
    let options = Options { engine: args.engine, ..args.device.options() };
    let check = || {
        // A folder that is asked for may have the result of any scene.
        Folder::check(&folder, args.out.is_none().then_some(file))
    };
    // It lives until the folder of the result has a copy.
    let mut start = None;
    let (scene, simulation) = match from {
        None => {
            let (scene, assembly) = load(file, &set)?;
            check()?;
            (scene, Simulation::new(assembly, options)?)
        }
        Some(from) => {
            let scene = Scene::load(file, &set)?;
            check()?;
            let (scene, simulation, temporary) = go_on(&scene, from, options)?;
            start = Some(temporary);
            (scene, simulation)
        }
    };
    listen()?;
    // Only now, so that a scene that cannot run leaves no trace.
    let record = Record::new(&scene, &simulation, command());
    let results = Results::create(&folder, Some(file), &scene, simulation.assembly(), record)?;
    drop(start);
    let schedule = Schedule::new(simulation.assembly(), simulation.dt());
    let run = Run::new(simulation, results, schedule);
    Ok(Begun { scene, folder, run })
}

/// Go on with a run that was interrupted, or take one further.
fn resume(args: &RunArgs, folder: &Path) -> anyhow::Result<Begun> {
    let folders = folder::resumable(folder)?;
    let Last { from, scene, assembly, simulation, so_far, .. } =
        last(&folders, &CHECKPOINTS, &args.stop(), args.device.options(), Simulation::resume)?;
    let SoFar { mut schedule, wall_seconds, deepest } = so_far;
    if args.steps.is_some() || args.time.is_some() {
        schedule.end = Schedule::new(&assembly, simulation.dt()).end;
    }
    let (step, dt) = (simulation.step(), simulation.dt());
    if schedule.end.is_some_and(|end| end <= step) {
        return Err(Error::Folder(format!(
            "{}: the run is at step {step} (t = {:e} s) already; let --time or --steps be beyond that",
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
    let mut run = Run::new(simulation, results, schedule);
    (run.earlier, run.saved, run.deepest) = (wall_seconds, Some(step), deepest);
    if args.steps.is_some() || args.time.is_some() {
        // So that the new end holds from now on, whatever happens.
        run.checkpoint()?;
    }
    Ok(Begun { scene, folder: folder.to_owned(), run })
}

/// The last state of a run.
pub struct Last {
    /// The folder that has it.
    pub from: PathBuf,
    pub scene: Scene,
    /// Its file as it was given.
    given: Option<String>,
    assembly: Assembly,
    pub simulation: Simulation,
    so_far: SoFar,
}

/// How a simulation is made of a checkpoint: [`Simulation::resume`] or [`Simulation::inspect`].
type Open = fn(Assembly, Options, &mut Checkpoint) -> packstone::Result<Simulation>;

/// What checkpoints are called in the folder of a run, the last one first.
pub const CHECKPOINTS: [&str; 2] = [names::CHECKPOINT, names::PREVIOUS];

/// That in the first of these folders that has a checkpoint, one of these names, which is whole.
pub fn last(folders: &[PathBuf], names: &[&str], set: &[String], options: Options, open: Open) -> anyhow::Result<Last> {
    for from in folders {
        let checkpoints = names.iter().map(|name| from.join(name));
        let there: Vec<_> = checkpoints.filter(|path| path.exists()).collect();
        if there.is_empty() {
            warn(format!("{}: the run was killed before its first checkpoint", from.display()));
            continue;
        }
        let no_record = || Error::Folder(format!("{}: has no {}", from.display(), names::RUN));
        let Record { scene_as_run, scene_as_given: given, .. } = Record::read(from).ok_or_else(no_record)?;
        let (scene, assembly) = load(&from.join(scene_as_run.ok_or_else(no_record)?), set)?;
        for (k, path) in there.iter().enumerate() {
            match at_checkpoint(path, &assembly, options, open) {
                Ok((simulation, so_far)) => {
                    return Ok(Last { from: from.clone(), scene, given, assembly, simulation, so_far });
                }
                Err(error @ (Error::Scene(_) | Error::Io { .. })) if k + 1 < there.len() => {
                    warn(format!("{error}; this is the checkpoint before it"));
                }
                Err(error) => return Err(error.into()),
            }
        }
    }
    let names: Vec<_> = folders.iter().map(|folder| folder.display().to_string()).collect();
    Err(Error::Folder(format!("{}: has no checkpoint to go on from; run its scene anew", names.join(", "))).into())
}

fn at_checkpoint(
    path: &Path,
    assembly: &Assembly,
    options: Options,
    open: Open,
) -> packstone::Result<(Simulation, SoFar)> {
    let mut checkpoint = Checkpoint::open(path)?;
    let so_far = serde_json::from_value(checkpoint.about().run.clone());
    let so_far = so_far.map_err(|e| Error::Scene(format!("{}: {e}", path.display())))?;
    let simulation = open(assembly.clone(), options, &mut checkpoint)?;
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

/// Another scene with the last state of a run: that scene with the grains in it, the simulation, and the folder with the
/// file that has the grains.
fn go_on(scene: &Scene, folder: &Path, options: Options) -> anyhow::Result<(Scene, Simulation, TempDir)> {
    let mut folders = folder::resumable(folder)?;
    // The result, if there is one, and not one that is on its way.
    folders.reverse();
    let Last { from, scene: old_scene, given, assembly: old, mut simulation, .. } =
        last(&folders, &CHECKPOINTS, &[], options, Simulation::resume)?;
    let given = given.map_or_else(|| Ok(old_scene.clone()), |name| Scene::load(&from.join(name), &[]))?;
    let (step, time) = (simulation.step(), simulation.time());
    let (grains, clumps) = (simulation.grains()?, simulation.clumps()?);
    let shifts = old.walls.iter().zip(simulation.walls()?).map(|(before, now)| Shift {
        wall: before.name.clone(),
        by: match (before.surface, now.surface) {
            (Surface::Plane { point, normal }, Surface::Plane { point: now, .. }) => (now - point).dot(normal) * normal,
            (Surface::Cylinder { center, .. }, Surface::Cylinder { center: now, .. }) => now - center,
            _ => unreachable!("a wall stays what it is"),
        },
    });
    let shifts: Vec<Shift> = shifts.collect();
    let contacts = simulation.contact_history()?;
    let moment = Moment { step, time, grains: &grains, clumps: &clumps };
    let temporary = tempfile::tempdir()?;
    let start = temporary.path().join(START);
    write_state(&start, &old, &moment)?;
    note(format!(
        "{} at step {step}, t = {time:e} s: {} grains and {} contacts with a history",
        from.display(),
        grains.len(),
        contacts.len()
    ));
    let Continued { scene, singles, notices } = scene.continued(&given, &old_scene, &start, &shifts)?;
    notices.iter().for_each(note);
    // What is wrong with the grains is wrong with them where they come from.
    let assembly = scene.assemble().map_err(|error| match error {
        Error::Scene(message) => {
            Error::Scene(message.replace(&start.display().to_string(), &format!("the grains of {}", from.display())))
        }
        other => other,
    })?;
    assembly.notices.iter().for_each(note);
    let first = assembly.clumps.get(singles).map_or(singles, |clump| clump.first as usize);
    let same = |(new, old): (&packstone::scene::Grain, &packstone::scene::Grain)| {
        (new.radius - old.radius).abs() <= 1e-9 * old.radius
    };
    let carried = assembly.grains.get(first..first + grains.len());
    if !carried.is_some_and(|carried| carried.iter().zip(&grains).all(same)) {
        return Err(Error::Scene(format!(
            "{}: its clumps have members that the shapes of {} do not have",
            from.display(),
            scene.name()
        ))
        .into());
    }
    let alike = std::mem::discriminant(&old.solver.method) == std::mem::discriminant(&assembly.solver.method);
    let place = |contact: &ContactHistory| {
        let other = match contact.other {
            Other::Grain(id) => Other::Grain(first as u32 + id),
            Other::Wall(wall) => {
                let name = &old.walls[wall as usize].name;
                Other::Wall(assembly.walls.iter().position(|wall| wall.name == *name)? as u32)
            }
        };
        Some(ContactHistory { grain: first as u32 + contact.grain, other, ..*contact })
    };
    let placed: Vec<ContactHistory> = contacts.iter().filter(|_| alike).filter_map(place).collect();
    drop(simulation);
    let (simulation, kept) = Simulation::with_history(assembly, options, &placed)?;
    let why = match () {
        () if !alike => ", as the method is another",
        () if kept == 0 => ", as the law of contact has none, or nothing touches any more",
        () => "",
    };
    note(format!("{kept} of {} contacts keep their history{why}", contacts.len()));
    Ok((scene, simulation, temporary))
}

/// Arguments of the command line.
fn command() -> Vec<String> {
    std::env::args_os().skip(1).map(|argument| argument.to_string_lossy().into_owned()).collect()
}
