//! Another scene with the last state of a run: `--from`.

use super::common::note;
use super::last::{CHECKPOINTS, Last, last};
use packstone::{
    io::folder,
    scene::{Assembly, Scene},
    simulation::{Options, Simulation, Successor},
};
use std::path::Path;

/// A scene that goes on with the grains of a run.
pub struct From(Successor);

impl From {
    /// The scene with the last state of the run in a folder. What comes along and what does not is said.
    pub fn read(scene: &Scene, folder: &Path) -> anyhow::Result<From> {
        // The result, if there is one, and not one that is on its way; of a run in stages that of the last one.
        let folders = folder::resumable(folder)?.into_iter().rev();
        let folders: Vec<_> = folders.map(|folder| folder::last_stage(&folder).unwrap_or(folder)).collect();
        let Last { from, scene: old, given, assembly: started, state } =
            last(&folders, &CHECKPOINTS, &[], |_, mut checkpoint, old| Simulation::view(old.clone(), &mut checkpoint))?;
        let given = given.map(|name| Scene::load(&from.join(name), &[])).transpose()?;
        let successor =
            Successor::new(scene, state, &old, given.as_ref().unwrap_or(&old), &started, &from.display().to_string())?;
        successor.notices.iter().for_each(note);
        Ok(From(successor))
    }

    /// With the grains in it.
    pub fn scene(&self) -> &Scene {
        &self.0.scene
    }

    pub fn assembly(&self) -> &Assembly {
        &self.0.assembly
    }

    /// The simulation that goes on. How much of what contacts remember it could take is said.
    pub fn simulation(&self, options: Options) -> packstone::Result<Simulation> {
        let (simulation, kept) = self.0.simulation(options)?;
        let hint = if kept > 0 { "; its scene.toml alone will begin without it, and --from with it" } else { "" };
        note(self.0.words(kept) + hint);
        Ok(simulation)
    }
}
