//! A run in stages: one after the other, each from the state of the one before.

use super::super::common::{INTERRUPTED, STOPPED, UNSURE, complain, note, say, tell, warn};
use super::begin::{Begun, Ready, RunArgs, command, resume};
use super::carry_out::{Outcome, carry_out};
use super::{drive::flood, frames::FrameArgs, interrupt::listen};
use packstone::{
    Error,
    io::{KeptStages, Record, Resumed, Stages, folder, names, record, schedule::Schedule},
    model::Precision,
    scene::{Assembly, Scene, Stage},
    simulation::{EngineChoice, Options, Setup, Simulation},
};
use std::{
    ops::Range,
    path::{Path, PathBuf},
    process::ExitCode,
};

/// A run in stages that is about to go on.
pub struct Staged {
    folder: PathBuf,
    /// Those to run.
    range: Range<usize>,
    options: Options,
    beginning: Beginning,
}

enum Beginning {
    /// With the first of these stages, which stands at its time 0. Of an earlier result those before and behind are kept.
    New { file: PathBuf, scene: Box<Scene>, first: Box<Ready>, kept: Option<PathBuf> },
    /// With the result in this folder, one of [`folder::resumable`].
    Resumed(PathBuf),
}

/// How a run in stages has ended.
enum Ended {
    Complete,
    Interrupted,
    Stopped(String),
}

impl Staged {
    /// # Errors
    /// For what is wrong in any of the stages; nothing has changed on the disk then.
    pub fn new(
        args: &RunArgs,
        file: &Path,
        folder: &Path,
        scene: Scene,
        check: impl Fn() -> packstone::Result<()>,
    ) -> anyhow::Result<Staged> {
        let options = args.options();
        let range = range(args, &scene)?;
        let stages = scene.stages();
        check_checkpoints(stages)?;
        let other = args.from.as_ref().map(|from| Ready::from(&stages[0].scene, from, options)).transpose()?;
        let first = match &other {
            Some(Ready { simulation, .. }) => simulation.assembly().clone(),
            None => stages[0].scene.assemble()?,
        };
        if other.is_none() {
            first.notices.iter().for_each(note);
        }
        for (stage, outline) in stages.iter().zip(scene.outlines(&first)) {
            look_at(stage, &outline?, &options)?;
        }
        check()?;
        let mut kept = None;
        let ready = match (other, range.start) {
            (Some(ready), _) => ready,
            (None, 0) => {
                Ready { scene: stages[0].scene.clone(), simulation: Simulation::new(first, options)?, older: None }
            }
            (None, start) => {
                drop(first);
                let from = with_stage(folder, &stages[start - 1].name)?;
                stages[..start].iter().for_each(|stage| note_changes(&from, stage));
                let ready = Ready::from(&stages[start].scene, &stage_in(&from, &stages[start - 1].name), options)?;
                kept = Some(from);
                ready
            }
        };
        if range.end < stages.len() {
            kept = kept.or_else(|| folder::resumable(folder).ok()?.pop());
        }
        let beginning = Beginning::New { file: file.to_owned(), scene: Box::new(scene), first: Box::new(ready), kept };
        Ok(Staged { folder: folder.to_owned(), range, options, beginning })
    }

    /// The run in a folder; None if it is not one in stages.
    pub fn resume(args: &RunArgs, folder: &Path) -> anyhow::Result<Option<Staged>> {
        let from = folder::resumable(folder)?.remove(0);
        let record = Record::read(&from).filter(|record| !record.stages.is_empty());
        let Some(Record { machine, command, scene_as_run: Some(scene), .. }) = record else { return Ok(None) };
        let scene = Scene::load(&from.join(scene), &[])?;
        let stages = scene.stages();
        let is_done = |stage: &Stage| {
            folder::has_stage(&from, &stage.name) && !(stage.required && has_missed(&stage_in(&from, &stage.name)))
        };
        let start = stages.iter().position(|stage| !is_done(stage)).unwrap_or(stages.len() - 1);
        if folder::has_stage(&from, &stages[start].name) && args.stop().is_empty() {
            let ended = &stages[start].name;
            let message = format!("stage {ended} has come to its end already; let --time or --steps be beyond that");
            return Err(Error::Folder(format!("{}: {message}", folder.display())).into());
        }
        let of_another = command.iter().any(|word| word == "--from" || word.starts_with("--from="));
        if start == 0 && of_another && !is_saved(&stage_in(&from, &stages[0].name)) {
            let message = "was killed before its first checkpoint, and had begun with --from; begin it anew like that";
            return Err(Error::Folder(format!("{}: {message}", folder.display())).into());
        }
        let mut options = args.options();
        if let Some(machine) = machine {
            options.engine = if machine.engine == "cpu" { EngineChoice::Cpu } else { EngineChoice::Gpu };
            let known = Precision::ALL.iter().find(|precision| precision.label() == machine.precision);
            options.precision = *known.unwrap_or(&options.precision);
        }
        let range = start..stages.len();
        Ok(Some(Staged { folder: folder.to_owned(), range, options, beginning: Beginning::Resumed(from) }))
    }

    pub fn run(self, args: &RunArgs) -> anyhow::Result<ExitCode> {
        let Staged { folder, range, options, beginning } = self;
        listen()?;
        let (results, mut ready) = match beginning {
            Beginning::New { file, scene, first, kept } => {
                let record = Record::new(&scene, &first.simulation, command());
                let names: Vec<String> = scene.stages().iter().map(|stage| stage.name.clone()).collect();
                let (before, behind) = (&names[..range.start], &names[range.end..]);
                let kept = kept.as_ref().map(|from| KeptStages { from, before, behind });
                (Stages::create(&folder, &file, &scene, record, kept)?, Some(*first))
            }
            Beginning::Resumed(from) => {
                let resumed = Resumed { start: record::now(), command: command(), step: 0 };
                (Stages::resume(&folder, &from, resumed)?, None)
            }
        };
        results.notices().iter().for_each(note);
        // As it was kept, whatever becomes of the files that it was read from.
        let scene = Scene::load(&results.scene(), &[])?;
        let (mut ended, mut spoilt, mut doubtful) = (Ended::Complete, false, false);
        for number in range.clone() {
            let stage = &scene.stages()[number];
            let stopped = |why: &dyn std::fmt::Display| Ended::Stopped(format!("stage {}: {why}", stage.name));
            tell(format!("stage {} ({} of {})", stage.name, number + 1, scene.stages().len()));
            let begun = bring_about(args, &results, scene.stages(), number, ready.take(), options);
            let Outcome { code, summary, place, complete } = match begun {
                Ok(mut begun) => {
                    begun.run.results.rescue_beside(results.root());
                    carry_out(begun, args, Some(&stage.name))?
                }
                Err(error) => {
                    complain(format!("stage {}: {error}", stage.name));
                    ended = stopped(&error);
                    break;
                }
            };
            results.end(&stage.name);
            spoilt |= !place.starts_with(results.place());
            doubtful |= summary.as_ref().is_some_and(|summary| !summary.doubts.is_empty());
            if !complete {
                let why = summary.and_then(|summary| summary.stopped).unwrap_or("was stopped".to_owned());
                ended = if code == INTERRUPTED { Ended::Interrupted } else { stopped(&why) };
                break;
            }
            if let (Some(missed), Some(next)) =
                (summary.and_then(|summary| summary.missed), scene.stages()[..range.end].get(number + 1))
                && stage.required
            {
                complain(format!(
                    "stage {}: {missed}; so {} and what is behind are not run. With a longer --time --resume {} goes on, --from-stage {} \
                     takes it as it is, and required = false lets the stage pass",
                    stage.name,
                    next.name,
                    folder.display(),
                    next.name
                ));
                ended = stopped(&missed);
                break;
            }
        }
        finish(args, &folder, results, ended, spoilt, doubtful)
    }
}

/// The last word.
fn finish(
    args: &RunArgs,
    folder: &Path,
    results: Stages,
    ended: Ended,
    spoilt: bool,
    doubtful: bool,
) -> anyhow::Result<ExitCode> {
    let complete = matches!(ended, Ended::Complete);
    let words = match &ended {
        Ended::Complete => "last stage",
        Ended::Interrupted => "interrupted",
        Ended::Stopped(why) => why,
    };
    let mut summary = results.summary();
    for stage in summary["stages"].as_array().into_iter().flatten().filter(|stage| stage["outdated"] == true) {
        let name = stage["name"].as_str().unwrap_or_default();
        warn(format!("stage {name} began with a state that was there before a stage in front of it was run again"));
    }
    let place = match results.close(words, complete, spoilt) {
        Err(error @ Error::Io { .. }) => {
            complain(error);
            return Ok(ExitCode::from(STOPPED));
        }
        closed => closed?,
    };
    if args.json {
        summary["folder"] = place.to_string_lossy().into();
        say(serde_json::to_string_pretty(&summary)?);
    } else {
        say(format!("results in {}", place.display()));
    }
    if place != folder && !spoilt && Record::read(folder).is_some() {
        note(format!("{} keeps the older result, as this run did not come to its end", folder.display()));
    }
    Ok(match ended {
        Ended::Complete if args.strict && doubtful => ExitCode::from(UNSURE),
        Ended::Complete => ExitCode::SUCCESS,
        Ended::Interrupted => ExitCode::from(INTERRUPTED),
        Ended::Stopped(_) => ExitCode::from(STOPPED),
    })
}

/// Those that the command line asks for.
fn range(args: &RunArgs, scene: &Scene) -> anyhow::Result<Range<usize>> {
    let stages = scene.stages();
    let place = |option: &str, name: &str| {
        stages.iter().position(|stage| stage.name == name).ok_or_else(|| {
            let names: Vec<_> = stages.iter().map(|stage| stage.name.as_str()).collect();
            let known = names.join(", ");
            Error::Scene(format!("{}: {option} {name}: there is no such stage; there are {known}", scene.file()))
        })
    };
    Ok(match (&args.only, &args.from_stage) {
        (Some(name), _) => place("--only", name).map(|number| number..number + 1)?,
        (None, Some(name)) => place("--from-stage", name)?..stages.len(),
        (None, None) => 0..stages.len(),
    })
}

/// A stage begins with the last checkpoint of the one before.
fn check_checkpoints(stages: &[Stage]) -> packstone::Result<()> {
    for pair in stages.windows(2) {
        if !pair[0].scene.has_checkpoints() {
            return Err(Error::Scene(format!(
                "{}: output.checkpoint = 0: must be above 0, as stage {} begins with its last checkpoint",
                pair[0].scene.file(),
                pair[1].name
            )));
        }
    }
    Ok(())
}

/// What would stop a stage is said before the first one, and so are snapshots without number.
fn look_at(stage: &Stage, outline: &Assembly, options: &Options) -> packstone::Result<()> {
    let file = stage.scene.file();
    let setup = Setup::new(outline, options).map_err(|error| match error {
        Error::Scene(message) if !message.starts_with(file) => Error::Scene(format!("{file}: {message}")),
        other => other,
    })?;
    if let Some(flood) = flood(outline, &Schedule::new(outline, setup.state.params.dt)) {
        note(format!("stage {}: {flood}", stage.name));
    }
    Ok(())
}

fn stage_in(folder: &Path, stage: &str) -> PathBuf {
    folder.join(names::STAGES).join(stage)
}

/// The result in a folder, or else the partial one, in which a stage has come to its end.
fn with_stage(folder: &Path, stage: &str) -> packstone::Result<PathBuf> {
    let folders = folder::resumable(folder)?;
    folders.into_iter().rev().find(|folder| folder::has_stage(folder, stage)).ok_or_else(|| {
        let message = format!("has no stage {stage} that has come to its end, from which to go on; run that first");
        Error::Folder(format!("{}: {message}", folder.display()))
    })
}

/// Say so if a stage that is kept was run as another scene has it.
fn note_changes(folder: &Path, stage: &Stage) {
    let as_it_was = || {
        let record = Record::read(folder)?;
        let scene = Scene::load(&folder.join(record.scene_as_given.or(record.scene_as_run)?), &[]).ok()?;
        scene.stages().iter().find(|other| other.name == stage.name)?.scene.given().ok()
    };
    if as_it_was() != stage.scene.given().ok() {
        note(format!("stage {} is as it was run; the scene has it otherwise now", stage.name));
    }
}

/// Whether the result of a stage has not what its scene asked for.
fn has_missed(folder: &Path) -> bool {
    let text = std::fs::read(folder.join(names::SUMMARY)).unwrap_or_default();
    serde_json::from_slice::<serde_json::Value>(&text).is_ok_and(|summary| summary["missed"].is_string())
}

/// Whether a run has a checkpoint from which it can go on.
fn is_saved(folder: &Path) -> bool {
    let folders = folder::resumable(folder).unwrap_or_default();
    let saved = |name| folders.iter().any(|folder| folder.join(name).exists());
    saved(names::CHECKPOINT) || saved(names::PREVIOUS)
}

/// A stage that is about to go on: one that is ready, or from its last checkpoint, or from the state of the one before.
fn bring_about(
    args: &RunArgs,
    results: &Stages,
    stages: &[Stage],
    number: usize,
    ready: Option<Ready>,
    options: Options,
) -> anyhow::Result<Begun> {
    let stage = &stages[number];
    let here = results.of(&stage.name);
    if ready.is_none() && is_saved(&here) {
        return resume(args, &here);
    }
    let ready = match (ready, number) {
        // The first stage as it was kept; one that goes on with the grains of another run has them in a file of its own.
        (Some(ready), 0) if ready.older.is_none() => Ready { scene: stage.scene.clone(), ..ready },
        (Some(ready), _) => ready,
        (None, 0) => {
            let simulation = Simulation::new(stage.scene.assemble()?, options)?;
            Ready { scene: stage.scene.clone(), simulation, older: None }
        }
        (None, _) => Ready::from(&stage.scene, &results.of(&stages[number - 1].name), options)?,
    };
    // A run that goes on has pictures as it had before.
    let before = number.checked_sub(1).map(|before| results.of(&stages[before].name));
    let earlier: Vec<PathBuf> =
        [Some(here.clone()), Some(folder::partial(&here)), before].into_iter().flatten().collect();
    let as_before = args.resume.as_ref().map(|_| FrameArgs::as_in(&earlier));
    results.begin(&stage.name)?;
    Begun::new(&here, None, ready, as_before.as_ref().unwrap_or(&args.frames))
}
