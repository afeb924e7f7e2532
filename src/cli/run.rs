//! `packstone run`

mod begin;
mod carry_out;
mod drive;
mod frames;
mod interrupt;
mod staged;

use super::common::{about, stem};
use begin::{Begun, resume, start};
use carry_out::carry_out;
use packstone::{
    Error,
    io::{Folder, folder},
    scene::Scene,
};
use staged::Staged;
use std::{
    path::{Path, PathBuf},
    process::ExitCode,
};

pub use begin::RunArgs;
pub use interrupt::{interrupted, listen};

/// A run that is about to go on.
enum Run {
    InOneGo(Box<Begun>),
    InStages(Box<Staged>),
}

pub fn run(args: &RunArgs) -> anyhow::Result<ExitCode> {
    let named = args.scene.as_ref().or(args.resume.as_ref());
    let of_scene = |error| named.map_or_else(|| unreachable!("clap asks for one of them"), |name| about(name, error));
    let _around = args.resume.as_ref().or(args.out.as_ref()).map(|folder| folder::lock_around(folder)).transpose()?;
    match begin(args).map_err(of_scene)? {
        Run::InOneGo(begun) => carry_out(*begun, args, None).map(|outcome| ExitCode::from(outcome.code)),
        Run::InStages(staged) => staged.run(args),
    }
}

/// # Errors
/// For scenes, folders and checkpoints that cannot be run; nothing has changed on the disk then.
fn begin(args: &RunArgs) -> anyhow::Result<Run> {
    args.frames.check()?;
    let file = match (&args.resume, &args.scene) {
        (Some(folder), _) => {
            let staged = Staged::resume(args, folder)?;
            return match staged {
                Some(staged) => Ok(Run::InStages(Box::new(staged))),
                None => Ok(Run::InOneGo(Box::new(resume(args, folder)?))),
            };
        }
        (None, Some(file)) => file,
        (None, None) => unreachable!("clap asks for one of them"),
    };
    // What a pipe is called says nothing, as in `run <(command)`.
    if args.out.is_none() && file.metadata().is_ok_and(|found| !found.is_file() && !found.is_dir()) {
        return Err(
            Error::Folder(format!("{}: is no file; name the folder of its result with --out", file.display())).into()
        );
    }
    let folder: PathBuf = args.out.clone().unwrap_or_else(|| Path::new("out").join(stem(file)));
    // A folder that is asked for may have the result of any scene.
    let check = || Folder::check(&folder, args.out.is_none().then_some(file));
    let mut set = [&args.set[..], &args.stop()].concat();
    let scene = Scene::load(file, &set)?;
    if let [_, ..] = scene.stages() {
        for stage in scene.stages() {
            set.extend(args.stop().iter().map(|stop| format!("stage.{}.{stop}", stage.name)));
        }
        // What comes out of a pipe can be read once.
        let scene = if args.stop().is_empty() { scene } else { Scene::load(file, &set)? };
        return Ok(Run::InStages(Box::new(Staged::new(args, file, &folder, scene, check)?)));
    }
    if let Some(stage) = args.only.as_ref().or(args.from_stage.as_ref()) {
        return Err(Error::Scene(format!("{}: has no [[stage]], and so none called {stage}", file.display())).into());
    }
    let ready = start(args, scene, check)?;
    Ok(Run::InOneGo(Box::new(Begun::new(&folder, Some(file), ready, &args.frames)?)))
}
