//! Another scene with the last state of a run: `--from`.

use super::common::note;
use super::last::{CHECKPOINTS, Last, last};
use packstone::{
    Error,
    io::{folder, write_state},
    scene::{Assembly, Continued, Grain, Scene, Shift, grain_file::Moment},
    simulation::{ContactHistory, Options, Other, Simulation},
};
use std::path::Path;
use tempfile::TempDir;

/// The file with the grains that a scene goes on with.
const START: &str = "start.bin";

/// A scene that goes on with the grains of a run.
pub struct From {
    /// With the grains in it.
    pub scene: Scene,
    pub assembly: Assembly,
    /// What contacts remember that there are in both.
    contacts: Vec<ContactHistory>,
    /// Whether that is of this state, and not of a step before.
    of_now: bool,
    /// How many there were in the run.
    of: usize,
    /// Whether the method is the same.
    alike: bool,
    /// The folder with the file that has the grains; it lives as long as this.
    _temporary: TempDir,
}

impl From {
    /// The scene with the last state of the run in a folder. What comes along and what does not is said.
    pub fn read(scene: &Scene, folder: &Path) -> anyhow::Result<From> {
        // The result, if there is one, and not one that is on its way; of a run in stages that of the last one.
        let folders = folder::resumable(folder)?.into_iter().rev();
        let folders: Vec<_> = folders.map(|folder| folder::last_stage(&folder).unwrap_or(folder)).collect();
        let Last { from, scene: old_scene, given, assembly: started, state: mut simulation } =
            last(&folders, &CHECKPOINTS, &[], |_, mut checkpoint, old| Simulation::view(old.clone(), &mut checkpoint))?;
        let given = given.map_or_else(|| Ok(old_scene.clone()), |name| Scene::load(&from.join(name), &[]))?;
        let (step, time) = (simulation.step(), simulation.time());
        let (grains, clumps) = (simulation.grains()?, simulation.clumps()?);
        let walls = simulation.walls()?;
        let shifts: Vec<Shift> =
            started.walls.iter().zip(&walls).map(|(before, now)| Shift::between(before, now)).collect();
        let contacts = simulation.contact_history()?;
        let (domain, of_now) = (simulation.domain()?, simulation.remembers_now());
        // With the grains that there are now.
        let old = simulation.assembly().clone();
        drop(simulation);
        let (owners, numbers) = (&old.owners()[..], &old.numbers);
        let moment = Moment { step, time, grains: &grains, clumps: &clumps, owners, numbers };
        let temporary = tempfile::tempdir()?;
        let start = temporary.path().join(START);
        write_state(&start, &old, &moment)?;
        note(format!(
            "{} at step {step}, t = {time:e} s: {} grains and {} contacts with a history",
            from.display(),
            grains.len(),
            contacts.len()
        ));
        let mut continued = scene.continued(&given, &old_scene, &start, &shifts)?;
        if domain != old.domain {
            continued.follow_cell(&given, &domain);
        }
        let Continued { scene, singles, walls, notices } = continued;
        notices.iter().for_each(note);
        // What is wrong with the grains is wrong with them where they come from.
        let assembly = scene.assemble().map_err(|error| match error {
            Error::Scene(message) => {
                let of_run = format!("the grains of {}", from.display());
                Error::Scene(message.replace(&start.display().to_string(), &of_run))
            }
            other => other,
        })?;
        assembly.notices.iter().for_each(note);
        let first = assembly.clumps.get(singles).map_or(singles, |clump| clump.first as usize);
        let same = |(new, old): (&Grain, &Grain)| (new.radius - old.radius).abs() <= 1e-9 * old.radius;
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
                    let name = walls.now(&old.walls[wall as usize].name)?;
                    Other::Wall(assembly.walls.iter().position(|wall| wall.name == name)? as u32)
                }
            };
            Some(ContactHistory { grain: first as u32 + contact.grain, other, ..*contact })
        };
        let placed = contacts.iter().filter(|_| alike).filter_map(place).collect();
        Ok(From { scene, assembly, contacts: placed, of_now, of: contacts.len(), alike, _temporary: temporary })
    }

    /// The simulation that goes on. How much of what contacts remember it could take is said.
    pub fn simulation(&self, options: Options) -> packstone::Result<Simulation> {
        let (simulation, kept) = Simulation::with_history(self.assembly.clone(), options, &self.contacts, self.of_now)?;
        let why = match () {
            () if !self.alike => ", as the method is another",
            () if kept == 0 => ", as the law of contact has none, or nothing touches any more",
            () => "; its scene.toml alone will begin without it, and --from with it",
        };
        note(format!("{kept} of {} contacts keep their history{why}", self.of));
        Ok(simulation)
    }
}
