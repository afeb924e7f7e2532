//! Scenes: files (TOML text, `--set` overrides and grain tables) or builders in, a checked [`Assembly`] out.

mod apportion;
mod assembly;
mod bodies;
pub mod builder;
mod cell;
mod check;
mod continued;
mod formats;
pub mod grain_file;
mod grown;
mod growth;
mod inputs;
mod insertion;
mod invariants;
mod law;
mod levels;
mod materials;
mod motion;
mod moved;
mod neighbours;
mod origin;
mod outlet;
mod overrides;
mod populate;
mod radius;
mod rows;
mod schema;
mod servo;
mod setters;
mod shape;
mod sheet;
mod stages;
mod table;
mod targets;
mod validate;
mod wall_targets;
mod walls;

pub use assembly::{
    Assembly, Clump, Domain, Grain, Insertion, JammingProtocol, Material, Method, Numbers, Outlet, Output, Place, Rate,
    Region, Relaxation, Solver, Stop, Surface, TimeStep, Wall,
};
pub use builder::SceneBuilder;
pub use cell::{COMPONENTS, Cell};
pub use continued::{Continued, KeptWalls, Shift};
pub use growth::{Growth, GrowthLaw};
pub use inputs::Input;
pub use law::{Dashpot, Hertz, MaterialBuilder, Pair, PairBuilder, Rolling};
pub use levels::SizeLevel;
pub use motion::{Motion, Oscillation, Turning};
pub(crate) use neighbours::Neighbours;
pub use schema::{Face, Format, Placement, Twist};
pub use servo::{Servo, Target};
pub use shape::{Kind, Member, Shape};
pub use wall_targets::{Area, Span};

use std::{path::Path, time::SystemTime};

use crate::{Result, input};
use origin::{GoingOn, Origin, read_text};

/// A scene, from a file or from a [`SceneBuilder`], that is well-formed: known keys, right types, finite numbers. The
/// values are checked by [`Scene::assemble`].
#[derive(Clone, Debug)]
pub struct Scene {
    file: schema::File,
    origin: Origin,
    /// With all overrides; None for a scene in code.
    text: Option<String>,
    /// When it was made; files that it names are read later.
    made: SystemTime,
    /// If it goes on with the grains of another one.
    going_on: Option<GoingOn>,
    /// In the order in which they run; none of a scene that runs in one go.
    stages: Vec<Stage>,
    /// Of a later stage: how many of its single grains and populations all stages have. The others are added by it.
    common: Option<(usize, usize)>,
}

/// A part of a run of a scene.
#[derive(Clone, Debug)]
pub struct Stage {
    pub name: String,
    /// Whether the stages after it wait for what it asks for, such as rest.
    pub required: bool,
    /// The scene with the values of the stage.
    pub scene: Scene,
}

impl Scene {
    /// Reads a scene file and applies overrides such as `solver.dt=1e-6`.
    /// Relative paths inside the scene are looked up next to the file.
    pub fn load(path: &Path, set: &[String]) -> Result<Scene> {
        let text = read_text(path, "a scene file")?;
        Scene::parse(&text, &path.display().to_string(), input::folder(path), set)
    }

    /// Like [`Scene::load`] for text that is already read: `name` stands for the file in messages,
    /// relative paths are looked up in `directory`.
    pub fn parse(text: &str, name: &str, directory: &Path, set: &[String]) -> Result<Scene> {
        let made = SystemTime::now();
        let mut origin = Origin { name: name.to_owned(), directory: directory.to_owned(), set: Vec::new() };
        let (edited, written) = overrides::apply(text, set, &origin)?;
        origin.set = written;
        let file = schema::read(&edited).map_err(|fault| overrides::blame(text, fault, &origin))?;
        overrides::refuse_infinite(&edited, &origin)?;
        let mut scene =
            Scene { file, origin, text: Some(edited), made, going_on: None, stages: Vec::new(), common: None };
        scene.stages = scene.read_stages()?;
        Ok(scene)
    }

    /// Checks every value, fills in the defaults and places the grains; of a scene with stages those of the first one.
    pub fn assemble(&self) -> Result<Assembly> {
        if let Some(first) = self.stages.first() {
            return first.scene.assemble();
        }
        validate::assemble(&self.file, &self.origin).map_err(|error| self.origin.about(error))
    }

    /// In the order in which they run; none of a scene that runs in one go.
    pub fn stages(&self) -> &[Stage] {
        &self.stages
    }

    /// What its file is called in messages.
    pub fn file(&self) -> &str {
        &self.origin.name
    }

    /// The title of the scene, or the stem of its file name.
    pub fn name(&self) -> &str {
        let stem = || Path::new(&self.origin.name).file_stem()?.to_str();
        match &self.file.title {
            Some(title) => title,
            None => stem().unwrap_or(&self.origin.name),
        }
    }
}
