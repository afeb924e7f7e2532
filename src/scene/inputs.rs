//! What a scene reads besides itself, and its text as it is run.

use std::{path::PathBuf, time::SystemTime};

use toml_edit::Value;

use super::schema::{Radius, Sieve};
use super::{Scene, overrides};
use crate::Result;

/// A file that a scene names.
#[derive(Clone, Debug, PartialEq)]
pub struct Input {
    /// Where it is named, in the notation of `--set`.
    pub key: String,
    pub path: PathBuf,
}

impl Scene {
    /// The files that the scene reads, in any of its stages: tables, meshes, binary files, sieve curves, motions.
    pub fn inputs(&self) -> Vec<Input> {
        let mut inputs = self.own_inputs();
        for stage in &self.stages {
            let mut more = stage.scene.own_inputs();
            more.retain(|input| !inputs.contains(input));
            // Entries of lists are counted as the stage has them.
            more.iter_mut().for_each(|input| input.key = stage.key(&self.file, &input.key));
            inputs.extend(more);
        }
        inputs
    }

    fn own_inputs(&self) -> Vec<Input> {
        let mut inputs = Vec::new();
        let mut add = |key: String, file: Option<&String>| {
            if let Some(file) = file {
                inputs.push(Input { key, path: self.origin.directory.join(file) });
            }
        };
        for (k, shape) in self.file.shape.iter().enumerate() {
            add(format!("shape.{k}.file"), shape.file.as_ref());
            add(format!("shape.{k}.mesh"), shape.mesh.as_ref());
        }
        for (k, wall) in self.file.wall.iter().enumerate() {
            add(format!("wall.{k}.table"), wall.table.as_ref());
        }
        for (k, population) in self.file.population.iter().enumerate() {
            add(format!("population.{k}.file"), population.file.as_ref());
            if let Some(Radius::Distribution(law)) = &population.radius
                && let Some(Sieve::File(file)) = &law.sieve
            {
                add(format!("population.{k}.radius.sieve"), Some(file));
            }
        }
        inputs
    }

    /// When it was made; its files are as they were read if they are older.
    pub fn made(&self) -> SystemTime {
        self.made
    }

    /// The seed of what is random in it.
    pub fn seed(&self) -> u64 {
        self.file.seed
    }

    /// The scene as TOML, with all overrides in it, its name as its title, and with other words at some keys.
    ///
    /// # Errors
    /// [`crate::Error::Scene`] for a key that is not there.
    pub fn text(&self, words: &[(String, String)]) -> Result<String> {
        let text = match &self.text {
            Some(text) => text.clone(),
            None => toml::to_string(&self.file).expect("the builder has made a table of it"),
        };
        let title = ("title".to_owned(), self.name().to_owned());
        let words = [title].into_iter().filter(|_| self.file.title.is_none()).chain(words.iter().cloned());
        let set: Vec<String> = words.map(|(key, word)| format!("{key}={}", Value::from(word))).collect();
        overrides::apply(&text, &set, &self.origin).map(|(text, _)| text)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    #[test]
    fn a_scene_tells_its_files_and_points_elsewhere() {
        let text = "dimension = 3\nshape = [{ name = \"stone\", mesh = \"a.stl\" }]\n\
                    [material.glass]\ndensity = 1\n[[population]]\nmaterial = \"glass\"\ncount = 3\n\
                    [population.radius]\nsieve = \"curve.csv\" # of the quarry\n[[population]]\nfile = \"/bed.csv\"\n";
        let set = ["seed=7".to_owned(), "population.0.count=4".to_owned()];
        let scene = Scene::parse(text, "some/where.toml", Path::new("some"), &set).unwrap();
        let input = |key: &str, path: &str| Input { key: key.to_owned(), path: path.into() };
        let wanted = [
            input("shape.0.mesh", "some/a.stl"),
            input("population.0.radius.sieve", "some/curve.csv"),
            input("population.1.file", "/bed.csv"),
        ];
        assert_eq!(scene.inputs(), wanted);
        let words: Vec<_> = wanted.iter().map(|input| (input.key.clone(), "in \"it\"".to_owned())).collect();
        let again = Scene::parse(&scene.text(&words).unwrap(), "again", Path::new("x"), &[]).unwrap();
        assert!(again.inputs().iter().all(|input| input.path == Path::new("x/in \"it\"")), "{:?}", again.inputs());
        assert_eq!((again.seed(), again.name(), again.file.population[0].count), (7, "where", Some(4)));
    }

    #[test]
    fn scenes_in_code_have_a_text() {
        use crate::prelude::*;
        let glass = MaterialBuilder::new(2500.0).normal_stiffness(2e3).friction(0.5);
        let builder =
            Scene::builder(3).material("glass", glass).grain(GrainBuilder::new("glass", [0.1, 0.0, 1.2], 1e-3));
        let scene = builder.stop_time(0.1).build().unwrap();
        let again = Scene::parse(&scene.text(&[]).unwrap(), "again", Path::new(""), &[]).unwrap();
        assert_eq!(again.assemble().unwrap(), scene.assemble().unwrap());
    }
}
