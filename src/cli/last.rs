//! The last state of a run: the latest checkpoint in its folders that is whole.

use super::common::warn;
use packstone::{
    Error,
    io::{Record, names},
    scene::{Assembly, Scene},
    simulation::Checkpoint,
};
use std::path::{Path, PathBuf};

/// What checkpoints are called in the folder of a run, the last one first.
pub const CHECKPOINTS: [&str; 2] = [names::CHECKPOINT, names::PREVIOUS];

pub struct Last<T> {
    /// The folder that has it.
    pub from: PathBuf,
    /// The scene as it was run.
    pub scene: Scene,
    /// Its file as it was given, where that is another.
    pub given: Option<String>,
    pub assembly: Assembly,
    /// What was made of the checkpoint.
    pub state: T,
}

/// That in the first of these folders that has a checkpoint, by one of these names, of which `make` makes something, with
/// `set` applied to the scene. One that is damaged is told, and the one before it taken.
pub fn last<T>(
    folders: &[PathBuf],
    names: &[&str],
    set: &[String],
    mut make: impl FnMut(&Path, Checkpoint, &Assembly) -> packstone::Result<T>,
) -> anyhow::Result<Last<T>> {
    for from in folders {
        let checkpoints = names.iter().map(|name| from.join(name));
        let there: Vec<_> = checkpoints.filter(|path| path.exists()).collect();
        let no_record = || Error::Folder(format!("{}: has no {}", from.display(), names::RUN));
        let Record { scene_as_run, scene_as_given: given, .. } = Record::read(from).ok_or_else(no_record)?;
        let scene = Scene::load(&from.join(scene_as_run.ok_or_else(no_record)?), set)?;
        if there.is_empty() {
            warn(match scene.has_checkpoints() {
                true => format!("{}: the run was killed before its first checkpoint", from.display()),
                false => format!(
                    "{}: its scene has output.checkpoint = 0, so that the run has no checkpoint",
                    from.display()
                ),
            });
            continue;
        }
        let assembly = scene.assemble()?;
        for (k, path) in there.iter().enumerate() {
            match Checkpoint::open(path).and_then(|checkpoint| make(path, checkpoint, &assembly)) {
                Ok(state) => return Ok(Last { from: from.clone(), scene, given, assembly, state }),
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
