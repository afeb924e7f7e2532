//! Scenes: files (TOML text, `--set` overrides and grain tables) or builders in, a checked [`Assembly`] out.

mod assembly;
mod bodies;
pub mod builder;
mod check;
mod invariants;
mod law;
mod materials;
mod neighbours;
mod overrides;
mod populate;
mod radius;
mod rows;
mod schema;
mod setters;
mod shape;
mod table;
mod validate;
mod walls;

pub use assembly::*;
pub use builder::SceneBuilder;
pub use law::*;
pub use schema::{Face, Format, Placement};
pub use shape::{Kind, Member, Shape};

use std::fmt::Display;
use std::path::{Path, PathBuf};

use crate::{Error, Result};

/// A scene, from a file or from a [`SceneBuilder`], that is well-formed: known keys, right types, finite numbers. The values are checked by [`Scene::assemble`].
#[derive(Clone, Debug)]
pub struct Scene {
    file: schema::File,
    origin: Origin,
}

impl Scene {
    /// A scene in code, of disks (2) or spheres (3): the same keys, defaults, checks and messages as in a file.
    ///
    /// ```
    /// use packstone::prelude::*;
    ///
    /// let assembly = Scene::builder(3)
    ///     .material("glass", MaterialBuilder::new(2500.0).normal_stiffness(2e3).friction(0.5))
    ///     .wall(WallBuilder::plane("glass", [0.0, 0.0, 0.0], [0.0, 0.0, 1.0]))
    ///     .grain(GrainBuilder::new("glass", [0.0, 0.0, 1.2e-3], 1e-3))
    ///     .stop_time(0.1)
    ///     .assemble()?;
    /// assert_eq!(assembly.grains.len(), 1);
    /// # Ok::<(), packstone::Error>(())
    /// ```
    pub fn builder(dimension: usize) -> SceneBuilder {
        SceneBuilder::new(dimension)
    }

    /// Reads a scene file and applies overrides such as `solver.dt=1e-6`.
    /// Relative paths inside the scene are looked up next to the file.
    pub fn load(path: &Path, set: &[String]) -> Result<Scene> {
        let text = read_text(path, "a scene file")?;
        let directory = path.parent().unwrap_or(Path::new(""));
        Scene::parse(&text, &path.display().to_string(), directory, set)
    }

    /// Like [`Scene::load`] for text that is already read: `name` stands for the file in messages,
    /// relative paths are looked up in `directory`.
    pub fn parse(text: &str, name: &str, directory: &Path, set: &[String]) -> Result<Scene> {
        let origin = Origin { name: name.to_owned(), directory: directory.to_owned(), set: set.to_vec() };
        let edited = overrides::apply(text, set, &origin)?;
        let file = schema::read(&edited).map_err(|fault| overrides::blame(text, fault, &origin))?;
        overrides::refuse_infinite(&edited, &origin)?;
        Ok(Scene { file, origin })
    }

    /// Checks every value, fills in the defaults and places the grains.
    pub fn assemble(&self) -> Result<Assembly> {
        validate::assemble(&self.file, &self.origin)
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

/// The text of a file that ought to be `what`.
fn read_text(path: &Path, what: &str) -> Result<String> {
    let name = path.display();
    if path.is_dir() {
        return Err(Error::Scene(format!("{name}: is a folder, not {what}")));
    }
    let bytes = std::fs::read(path).map_err(|source| Error::Io { path: path.to_owned(), source })?;
    String::from_utf8(bytes).map_err(|error| {
        let good = &error.as_bytes()[..error.utf8_error().valid_up_to()];
        let line = good.iter().filter(|byte| **byte == b'\n').count() + 1;
        Error::Scene(format!("{name}:{line}: is not UTF-8 text"))
    })
}

/// Where a scene came from; every message starts with it.
#[derive(Clone, Debug)]
struct Origin {
    name: String,
    directory: PathBuf,
    set: Vec<String>,
}

impl Origin {
    /// An error at `key`, a path in the notation of `--set`. If an override wrote there, the message says so.
    fn error(&self, key: &str, message: impl Display) -> Error {
        let culprit = self.set.iter().rev().find(|set| overrides::touches(set, key));
        Error::Scene(match culprit {
            Some(set) => format!("{} (--set {set}): {key}{message}", self.name),
            None => format!("{}: {key}{message}", self.name),
        })
    }

    /// An error about the value at `key`; `rule` says what is allowed.
    fn bad(&self, key: &str, value: impl Display, rule: impl Display) -> Error {
        self.error(key, format!(" = {value}: {rule}"))
    }

    /// An error about `key` as a whole.
    fn wrong(&self, key: &str, message: impl Display) -> Error {
        self.error(key, format!(": {message}"))
    }
}
