//! A scene that goes on with the last state of a simulation of another one: the next of its stages, or `run --from`.

use super::{Checkpoint, ContactHistory, Options, Other, Simulation};
use crate::{
    error::{Error, Result},
    scene::{
        Assembly, Continued, Grain, Scene, Shift,
        grain_file::{self, Moment, Names},
    },
};
use std::{fs::File, io::BufWriter, path::Path};
use tempfile::TempDir;

/// What files are called that are there while it is made.
const START: &str = "start.bin";
const STATE: &str = "state.bin";

/// A scene with the grains, walls and periodic cell of a simulation as they are, and with what its contacts remember.
pub struct Successor {
    /// With the grains in it. They are in a file that is there as long as this.
    pub scene: Scene,
    pub assembly: Assembly,
    /// What comes along and what does not.
    pub notices: Vec<String>,
    /// What contacts remember that there are in both.
    contacts: Vec<ContactHistory>,
    /// Whether that is of this state, and not of a step before.
    of_now: bool,
    /// How many there were.
    of: usize,
    /// Whether the method is the same.
    alike: bool,
    _folder: TempDir,
}

impl Successor {
    /// `scene` with the last state of a simulation, which is on the host ([`Simulation::view`]). That is of the scene `old`,
    /// which began as `started`, and was `given` without the grains of one before. It is `called` so in messages.
    ///
    /// # Errors
    /// [`Error::Scene`] if the two do not go together, as [`Scene::continued`] says, or the scene cannot have these grains;
    /// [`Error::Io`] if there is no place for them among temporary files.
    pub fn new(
        scene: &Scene,
        mut simulation: Simulation,
        old: &Scene,
        given: &Scene,
        started: &Assembly,
        called: &str,
    ) -> Result<Successor> {
        let (step, time) = (simulation.step(), simulation.time());
        let (grains, clumps) = (simulation.grains()?, simulation.clumps()?);
        let walls = simulation.walls()?;
        let shifts: Vec<Shift> =
            started.walls.iter().zip(&walls).map(|(before, now)| Shift::between(before, now)).collect();
        let contacts = simulation.contact_history()?;
        let (domain, of_now) = (simulation.domain()?, simulation.remembers_now());
        // With the grains that there are now.
        let before = simulation.assembly().clone();
        drop(simulation);
        let (owners, numbers) = (&before.owners()[..], &before.numbers);
        let moment = Moment { step, time, grains: &grains, clumps: &clumps, owners, numbers };
        let folder = temporary()?;
        let start = folder.path().join(START);
        write(&start, &before, &moment).map_err(|source| Error::Io { path: start.clone(), source })?;
        let mut continued = scene.continued(given, old, &start, &shifts)?;
        if domain != before.domain {
            continued.follow_cell(given, &domain);
        }
        let Continued { scene, singles, walls, mut notices } = continued;
        let state = format!("{} grains and {} contacts with a history", grains.len(), contacts.len());
        notices.insert(0, format!("{called} at step {step}, t = {time:e} s: {state}"));
        // What is wrong with the grains is wrong with them where they come from.
        let assembly = scene.assemble().map_err(|error| match error {
            Error::Scene(message) => {
                let path = start.display().to_string();
                Error::Scene(message.replace(&path, &format!("the grains of {called}")))
            }
            other => other,
        })?;
        notices.extend(assembly.notices.iter().cloned());
        let first = assembly.clumps.get(singles).map_or(singles, |clump| clump.first as usize);
        let same = |(new, old): (&Grain, &Grain)| (new.radius - old.radius).abs() <= 1e-9 * old.radius;
        let carried = assembly.grains.get(first..first + grains.len());
        if !carried.is_some_and(|carried| carried.iter().zip(&grains).all(same)) {
            return Err(Error::Scene(format!(
                "{called}: its clumps have members that the shapes of {} do not have",
                scene.name()
            )));
        }
        let alike = std::mem::discriminant(&before.solver.method) == std::mem::discriminant(&assembly.solver.method);
        let place = |contact: &ContactHistory| {
            let other = match contact.other {
                Other::Grain(id) => Other::Grain(first as u32 + id),
                Other::Wall(wall) => {
                    let name = walls.now(&before.walls[wall as usize].name)?;
                    Other::Wall(assembly.walls.iter().position(|wall| wall.name == name)? as u32)
                }
            };
            Some(ContactHistory { grain: first as u32 + contact.grain, other, ..*contact })
        };
        let placed = contacts.iter().filter(|_| alike).filter_map(place).collect();
        Ok(Successor { scene, assembly, notices, contacts: placed, of_now, of: contacts.len(), alike, _folder: folder })
    }

    /// The simulation that goes on, and how many contacts keep what they remember.
    ///
    /// # Errors
    /// As [`Simulation::new`].
    pub fn simulation(&self, options: Options) -> Result<(Simulation, usize)> {
        Simulation::with_history(self.assembly.clone(), options, &self.contacts, self.of_now)
    }

    /// That in words.
    pub fn words(&self, kept: usize) -> String {
        let why = match () {
            () if !self.alike => ", as the method is another",
            () if kept == 0 => ", as the law of contact has none, or nothing touches any more",
            () => "",
        };
        format!("{kept} of {} contacts keep their history{why}", self.of)
    }
}

/// A run in stages, see [`Scene::stages`]: the stage at hand, and how the next one begins with what has become of it. It is
/// what `packstone run` makes of the scene, to the bit.
///
/// ```
/// use packstone::prelude::*;
///
/// let scene = Scene::builder(3)
///     .material("glass", MaterialBuilder::new(2500.0).normal_stiffness(1e3).friction(0.1))
///     .wall(WallBuilder::plane("glass", [0.0; 3], [0.0, 0.0, 1.0]))
///     .grain(GrainBuilder::new("glass", [0.0, 0.0, 1.01e-3], 1e-3))
///     .stop_steps(500)
///     .stage(StageBuilder::new("drop"))
///     .stage(StageBuilder::new("slide").set("gravity", [2.0, 0.0, -9.81]).set("material.glass.friction", 0.5))
///     .build()?;
/// let mut run = StageRun::new(&scene, Options { engine: EngineChoice::Cpu, ..Options::default() })?;
/// loop {
///     let steps = run.simulation.assembly().stop.steps.unwrap_or_default();
///     run.simulation.advance(steps)?;
///     let place = run.simulation.grains()?[0].position;
///     println!("{}: {place}", run.name());
///     if !run.go_on()? {
///         break;
///     }
/// }
/// assert!(run.simulation.grains()?[0].velocity.x > 0.0);
/// # Ok::<(), packstone::Error>(())
/// ```
pub struct StageRun {
    /// Of the stage at hand.
    pub simulation: Simulation,
    /// How it has begun: what has come along from the stage before, and what has not.
    pub notices: Vec<String>,
    options: Options,
    stages: Vec<(String, Scene)>,
    /// Which of them.
    number: usize,
    /// The scene of the stage at hand with the grains of the one before; that of the first is as it was given.
    from: Option<Successor>,
}

impl StageRun {
    /// At time 0 of the first stage. A scene without stages is one.
    ///
    /// # Errors
    /// For what is wrong in any of the stages, and as [`Simulation::new`].
    pub fn new(scene: &Scene, options: Options) -> Result<StageRun> {
        let mut stages: Vec<(String, Scene)> =
            scene.stages().iter().map(|stage| (stage.name.clone(), stage.scene.clone())).collect();
        let first = scene.assemble()?;
        scene.outlines(&first).try_for_each(|outline| outline.map(drop))?;
        if stages.is_empty() {
            stages.push((scene.name().to_owned(), scene.clone()));
        }
        let notices = first.notices.clone();
        Ok(StageRun { simulation: Simulation::new(first, options)?, notices, options, stages, number: 0, from: None })
    }

    /// Of the stage at hand.
    pub fn name(&self) -> &str {
        &self.stages[self.number].0
    }

    /// Begin the next stage with the state of this one; false, and nothing happens, if it was the last.
    ///
    /// # Errors
    /// As [`Successor::new`] and [`Simulation::new`]; then this stage is still at hand.
    pub fn go_on(&mut self) -> Result<bool> {
        let Some((_, next)) = self.stages.get(self.number + 1) else { return Ok(false) };
        let old = self.from.as_ref().map_or(&self.stages[self.number].1, |from| &from.scene);
        let (given, started) = (&self.stages[self.number].1, old.assemble()?);
        // The state as the host has it, whatever it was computed on: as it is read from the folder of a run.
        let folder = temporary()?;
        let state = folder.path().join(STATE);
        self.simulation.save(&state, &())?;
        let on_host = Simulation::view(started.clone(), &mut Checkpoint::open(&state)?)?;
        let from = Successor::new(next, on_host, old, given, &started, &format!("stage {}", self.name()))?;
        let (simulation, kept) = from.simulation(self.options)?;
        self.notices = from.notices.iter().cloned().chain([from.words(kept)]).collect();
        (self.simulation, self.from) = (simulation, Some(from));
        self.number += 1;
        Ok(true)
    }
}

/// A folder that goes with what is returned.
fn temporary() -> Result<TempDir> {
    tempfile::tempdir().map_err(|source| Error::Io { path: std::env::temp_dir(), source })
}

fn write(path: &Path, assembly: &Assembly, moment: &Moment) -> std::io::Result<()> {
    let Assembly { dimension, materials, shapes, .. } = assembly;
    let mut file = BufWriter::new(File::create(path)?);
    grain_file::write(&mut file, moment, &Names { dimension: *dimension, materials, shapes })?;
    file.into_inner()?;
    Ok(())
}
