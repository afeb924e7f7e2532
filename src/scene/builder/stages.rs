//! Parts of a run with values of their own.

use serde::Serialize;
use toml::{Table, Value};
use toml_edit::Key;

use super::{GrainBuilder, OutletBuilder, PopulationBuilder, WallBuilder};

/// A stage of a scene: its values where they are not those of the scene. Keys, values and messages are those of
/// `[[stage]]` in a file.
#[derive(Clone, Debug)]
pub struct StageBuilder {
    pub(super) table: Table,
    /// What cannot be said in a file.
    pub(super) fault: Option<String>,
}

impl StageBuilder {
    /// The scene as it is. The name is also that of the folder of its results.
    pub fn new(name: &str) -> StageBuilder {
        StageBuilder { table: Table::from_iter([("name".to_owned(), name.into())]), fault: None }
    }

    /// Whether the stages after it wait for what it asks for, such as rest. Default: true.
    #[must_use]
    pub fn required(self, required: bool) -> Self {
        self.set("required", required)
    }

    /// A value of the scene in this stage, by its key in a file, in the notation of `--set`: numbers, words, arrays, or a
    /// structure that serialises as a table, as in `.set("wall.lid.velocity", [0.0, 0.0, -0.01])`.
    #[must_use]
    pub fn set(mut self, key: &str, value: impl Serialize) -> Self {
        let set = Value::try_from(value).map_err(|error| error.to_string()).and_then(|value| self.put(key, value));
        self.note(key, set)
    }

    /// A grain that is added when the stage begins.
    #[must_use]
    pub fn grain(self, grain: GrainBuilder) -> Self {
        self.add("grain", &grain.0)
    }

    /// Grains that are added when the stage begins.
    #[must_use]
    pub fn population(self, population: PopulationBuilder) -> Self {
        self.add("population", &population.0)
    }

    /// A wall that is there in this stage.
    #[must_use]
    pub fn wall(self, wall: WallBuilder) -> Self {
        self.add("wall", &wall.0)
    }

    /// Where grains leave in this stage.
    #[must_use]
    pub fn outlet(self, outlet: OutletBuilder) -> Self {
        self.add("outlet", &outlet.0)
    }

    fn put(&mut self, key: &str, value: Value) -> Result<(), String> {
        let mut path = Key::parse(key).map_err(|_| "is no key".to_owned())?;
        let last = path.pop().ok_or("is no key")?;
        let mut table = &mut self.table;
        for part in path {
            let inside = table.entry(part.get()).or_insert_with(|| Table::new().into());
            table = inside.as_table_mut().ok_or_else(|| format!("{} has been given as a whole", part.get()))?;
        }
        match table.insert(last.get().to_owned(), value) {
            None => Ok(()),
            Some(_) => Err("has been given already".to_owned()),
        }
    }

    fn add(mut self, list: &str, entry: &impl Serialize) -> Self {
        let entries = self.table.entry(list).or_insert_with(|| Value::Array(Vec::new()));
        let added = match (entries, Value::try_from(entry)) {
            (Value::Array(entries), Ok(entry)) => {
                entries.push(entry);
                Ok(())
            }
            (_, Err(error)) => Err(error.to_string()),
            _ => Err("entries of the scene are changed, so that none can be added".to_owned()),
        };
        self.note(list, added)
    }

    /// The first fault is the one to report.
    fn note(mut self, key: &str, outcome: Result<(), String>) -> Self {
        if let Err(fault) = outcome {
            self.fault.get_or_insert(format!("{key}: {fault}"));
        }
        self
    }
}
