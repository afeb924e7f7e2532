//! Stages: a scene that runs in parts, one after the other, of which each is the scene with values of its own.

use toml_edit::{DocumentMut, Table, value};

use super::origin::{Origin, Override};
use super::overrides::{Parsed, merge};
use super::{Assembly, Scene, Stage, schema, validate};
use crate::{Error, Result};

impl Stage {
    /// A key of its scene, in the notation of `--set`, as the file of all stages has it, whose scene is `file`.
    pub(super) fn key(&self, file: &schema::File, key: &str) -> String {
        let mut parts: Vec<String> = key.split('.').map(str::to_owned).collect();
        let given = match &*parts[0] {
            "shape" => file.shape.len(),
            "population" => file.population.len(),
            "wall" => file.wall.len(),
            _ => 0,
        };
        // Entries behind those of the scene are the stage's own.
        if let Some(own) = parts[1].parse::<usize>().ok().and_then(|number| number.checked_sub(given)) {
            parts[1] = own.to_string();
        }
        format!("stage.{}.{}", self.name, parts.join("."))
    }
}

/// A name is also that of a folder, and of a key.
fn check_name(name: &str, taken: &[Stage]) -> Parsed<()> {
    let plain = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    if !name.starts_with(|c: char| c.is_ascii_alphabetic()) || !name.chars().all(plain) || name.len() > 100 {
        return Err("a name has up to 100 letters, digits, _ and -, the first of them a letter".to_owned());
    }
    // Some file systems take capitals for the same.
    match taken.iter().any(|stage| stage.name.eq_ignore_ascii_case(name)) {
        true => Err("two stages have this name".to_owned()),
        false => Ok(()),
    }
}

impl Scene {
    /// The stages of its file.
    pub(super) fn read_stages(&self) -> Result<Vec<Stage>> {
        let mut stages = Vec::new();
        if self.file.stage.is_empty() {
            return Ok(stages);
        }
        let text = self.text.as_deref().expect("a scene that was read has a text");
        let mut document: DocumentMut = text.parse().expect("it has been read");
        let tables = document.remove("stage").and_then(|item| item.into_array_of_tables().ok());
        for (number, table) in tables.into_iter().flatten().enumerate() {
            let wrong = |message: String| Error::Scene(format!("{}: stage.{number}: {message}", self.origin.name));
            let name = table.get("name").ok_or_else(|| wrong("missing key `name`".to_owned()))?;
            let name = name.as_str().ok_or_else(|| wrong("name must be a word in quotes".to_owned()))?;
            check_name(name, &stages).map_err(|message| wrong(format!("name = \"{name}\": {message}")))?;
            stages.push(self.stage(number, name, &table, document.clone())?);
        }
        Ok(stages)
    }

    fn stage(&self, number: usize, name: &str, table: &Table, mut document: DocumentMut) -> Result<Stage> {
        let mut origin = Origin { name: format!("{}: stage.{name}", self.origin.name), ..self.origin.clone() };
        let wrong = |message: String| Error::Scene(format!("{}: {message}", origin.name));
        let mut required = true;
        for (key, item) in table {
            match key {
                "name" => {}
                "required" => {
                    required = item.as_bool().ok_or_else(|| wrong("required must be true or false".to_owned()))?;
                }
                "dimension" | "stage" => return Err(wrong(format!("{key} is no key of a stage"))),
                _ => merge(&mut document, &mut vec![key.to_owned()], item).map_err(wrong)?,
            }
        }
        if !table.contains_key("title") {
            document.insert("title", value(format!("{}: {name}", self.name())));
        }
        let text = document.to_string();
        let file = schema::read(&text).map_err(|fault| wrong(fault.message))?;
        origin.set = self.origin.set.iter().filter_map(|set| of_stage(set, number)).collect();
        let (made, directory) = (self.made, self.origin.directory.clone());
        let scene = Scene {
            file,
            origin: Origin { directory, ..origin },
            text: Some(text),
            made,
            going_on: None,
            stages: Vec::new(),
            common: (number > 0).then_some((self.file.grain.len(), self.file.population.len())),
        };
        Ok(Stage { name: name.to_owned(), required, scene })
    }

    /// Whether a run of it leaves a checkpoint at its end.
    pub fn has_checkpoints(&self) -> bool {
        self.file.output.checkpoint != 0.0
    }

    /// What the stages come down to before anything has run, given what the first one does: every value is checked, but not
    /// where grains are, as they will have moved. Each has the grains of the one before, and what it adds to them.
    ///
    /// # Errors
    /// As [`Scene::assemble`], and for grains that are not as they were given to the stage before.
    pub fn outlines(&self, first: &Assembly) -> impl Iterator<Item = Result<Assembly>> {
        let mut last = first.clone();
        self.stages.iter().enumerate().map(move |(number, stage)| {
            if let Some(before) = number.checked_sub(1) {
                last = stage.scene.outline(&self.stages[before].scene, &last)?;
            }
            Ok(last.clone())
        })
    }

    /// What it comes down to as a later stage, before anything has run: every value is checked, but not where grains
    /// are, as they will have moved. They are those of `like`, which is that of the stage before it, and what it adds.
    fn outline(&self, before: &Scene, like: &Assembly) -> Result<Assembly> {
        let added = self.file_added(before)?;
        validate::outline(&added, &self.origin, like).map_err(|error| self.origin.about(error))
    }
}

/// An override as stage `number` sees it; None if it is of another stage.
fn of_stage(set: &Override, number: usize) -> Option<Override> {
    match &set.path[..] {
        [first, other, path @ ..] if first == "stage" => {
            (*other == number.to_string()).then(|| Override { text: set.text.clone(), path: path.to_vec() })
        }
        _ => Some(set.clone()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    const SCENE: &str = r#"
dimension = 3
[material.glass]
density = 2500
normal_stiffness = 1e3
friction = 0.5
[[wall]]
kind = "plane"
name = "lid"
material = "glass"
point = [0, 0, 2]
normal = [0, 0, -1]
[[population]]
material = "glass"
count = 5
radius = 0.1
region = { lower = [0, 0, 0], upper = [1, 1, 1] }
[stop]
time = 1
[[stage]]
name = "fill"
material.glass.friction = 0.1
[[stage]]
name = "press"
required = false
[stage.wall.lid]
velocity = [0, 0, -1]
[stage.stop]
equilibrium = 1e-4
[[stage.population]]
material = "glass"
file = "more.csv"
[[stage]]
name = "rest"
solver = { damping = 3 }
"#;

    fn scene(set: &[&str]) -> Result<Scene> {
        let set: Vec<String> = set.iter().map(|set| (*set).to_owned()).collect();
        Scene::parse(SCENE, "a/scene.toml", Path::new("a"), &set)
    }

    #[test]
    fn a_stage_is_the_scene_with_values_of_its_own() {
        let scene = scene(&["stage.press.stop.time=3", "stage.0.gravity=[0, 0, -1]", "wall.lid.point.2=4"]).unwrap();
        let [fill, press, rest] = scene.stages() else { panic!("{:?}", scene.stages()) };
        assert_eq!((&*fill.name, fill.required, &*press.name, press.required), ("fill", true, "press", false));
        let file = |stage: &Stage| stage.scene.file.clone();
        assert_eq!((file(fill).material["glass"].friction, file(rest).material["glass"].friction), (0.1, 0.5));
        assert_eq!((file(fill).gravity, file(press).gravity), (Some(vec![0.0, 0.0, -1.0]), None));
        assert_eq!((file(press).stop.time, file(press).stop.equilibrium), (Some(3.0), Some(1e-4)));
        assert_eq!((file(rest).stop.time, file(rest).stop.equilibrium), (Some(1.0), None));
        assert_eq!(file(press).wall[0].velocity, Some(vec![0.0, 0.0, -1.0]));
        assert_eq!(file(press).wall[0].point, Some(vec![0.0, 0.0, 4.0]));
        assert_eq!((file(press).population.len(), file(rest).population.len()), (2, 1));
        assert_eq!(file(rest).solver.damping, schema::Damping::Constant(3.0));
        assert_eq!((scene.name(), press.scene.name()), ("scene", "scene: press"));
        // The files of all of them, by keys of the one file.
        let keys: Vec<String> = scene.inputs().into_iter().map(|input| input.key).collect();
        assert_eq!(keys, ["stage.press.population.0.file"]);
        let text = scene.text(&[(keys[0].clone(), "other.csv".to_owned())]).unwrap();
        let again = Scene::parse(&text, "again", Path::new("b"), &[]).unwrap();
        assert_eq!(again.stages()[1].scene.inputs()[0].path, Path::new("b/other.csv"));
        // A stage by itself is a scene.
        let alone = Scene::parse(&press.scene.text(&[]).unwrap(), "alone", Path::new("a"), &[]).unwrap();
        assert_eq!(alone.file.wall[0].velocity, Some(vec![0.0, 0.0, -1.0]));
        assert!(alone.stages().is_empty());
    }

    #[test]
    fn messages_name_the_stage() {
        let says = |set: &[&str], words: &[&str]| {
            let message = match scene(set) {
                Err(error) => error.to_string(),
                Ok(scene) => {
                    let like = scene.assemble();
                    let outline = |pair: &[Stage]| pair[1].scene.outline(&pair[0].scene, like.as_ref().unwrap()).err();
                    let found = like.as_ref().err().map(Error::to_string);
                    found.or_else(|| scene.stages().windows(2).rev().find_map(outline).map(|e| e.to_string())).unwrap()
                }
            };
            assert!(words.iter().all(|word| message.contains(word)), "{set:?}: {message}");
            assert!(message.starts_with("a/scene.toml"), "{message}");
        };
        says(&["stage.press.material.glass.frction=1"], &["stage.press: ", "unknown key `frction`"]);
        says(&["stage.rest.matrial.glass.friction=1"], &["stage.rest: ", "unknown key `matrial`"]);
        says(&["stage.rest.wall.lit.velocity=[0,0,1]"], &["stage.rest: ", "wall has no entry `lit`", "lid"]);
        says(&["stage.rset.stop.time=1"], &["--set stage.rset.stop.time=1", "stage has no entry `rset`", "press"]);
        says(&["stage.rest.required=1"], &["stage.rest: required must be true or false"]);
        says(&["stage.rest.name=\"fill\""], &["stage.2: name = \"fill\": two stages"]);
        says(&["stage.rest.name=\"a/b\""], &["stage.2: name = \"a/b\": a name has"]);
        says(&["stage.rest.dimension=2"], &["stage.rest: dimension is no key of a stage"]);
        says(
            &["stage.rest.solver.damping=-1"],
            &["stage.rest (--set stage.rest.solver.damping=-1): solver.damping = -1: must be 0"],
        );
        says(&["stage.rest.population.0.radius=0.2"], &["stage.rest: population.0: radius is not as given"]);
        says(&["stage.fill.stop.time=-1"], &["stage.fill (--set stage.fill.stop.time=-1): stop.time = -1"]);
        says(&["stage.fill.wall.lid.kind=\"cylinder\""], &["stage.fill: wall.0.point: is no key of a cylinder"]);
    }
}
