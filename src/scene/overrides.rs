//! `--set key=value`: edits of the TOML document before it is read.

use toml_edit::{DocumentMut, InlineTable, Item, Key, TableLike, Value};

use super::check::FINITE;
use super::origin::{Origin, split};
use super::schema::{self, Fault};
use crate::{Error, Result};

/// What a scene has any number of.
const LISTS: [&str; 5] = ["pair", "wall", "shape", "grain", "population"];
/// More tables in each other than a scene has.
const DEEPEST: usize = 20;

/// A value, or what is wrong with it.
type Parsed<T> = std::result::Result<T, String>;

/// The text with all overrides written into it.
pub fn apply(text: &str, set: &[String], origin: &Origin) -> Result<String> {
    if set.is_empty() {
        return Ok(text.to_owned());
    }
    let mut document: DocumentMut = text.parse().map_err(|error: toml_edit::TomlError| {
        let start = error.span().map(|span| span.start);
        in_file(Fault::new(text, start, error.message()), origin)
    })?;
    for set in set {
        assign(&mut document, set)
            .map_err(|message| Error::Scene(format!("{} (--set {set}): {message}", origin.name)))?;
    }
    Ok(document.to_string())
}

/// Finds out whether `fault`, met after all overrides, is due to one of them or to the file itself.
pub fn blame(text: &str, fault: Fault, origin: &Origin) -> Error {
    let set = &origin.set;
    let reads = |count: usize| apply(text, &set[..count], origin).is_ok_and(|edited| schema::read(&edited).is_ok());
    if let Some(culprit) = (0..set.len()).rev().find(|&count| reads(count)) {
        let (name, set) = (&origin.name, &set[culprit]);
        return Error::Scene(format!("{name} (--set {set}): {}", fault.message));
    }
    // The lines of the edited text are not those of the file.
    in_file(schema::read(text).err().unwrap_or(fault), origin)
}

fn in_file(fault: Fault, origin: &Origin) -> Error {
    let Fault { line, column, message } = fault;
    Error::Scene(format!("{}:{line}:{column}: {message}", origin.name))
}

/// Refuses numbers that TOML can write but no quantity can have.
pub fn refuse_infinite(text: &str, origin: &Origin) -> Result<()> {
    match toml::from_str(text) {
        Ok(table) => refuse_infinite_in(table, origin),
        Err(_) => Ok(()),
    }
}

/// The same for a scene that was no text.
pub fn refuse_infinite_in(table: toml::Table, origin: &Origin) -> Result<()> {
    match infinite("", &toml::Value::Table(table)) {
        Some((key, value)) => Err(origin.bad(&key, value, FINITE)),
        None => Ok(()),
    }
}

/// Key and value of the first number below `key` that is not finite.
fn infinite(key: &str, value: &toml::Value) -> Option<(String, f64)> {
    let inside = |name: &dyn std::fmt::Display, value| match key {
        "" => infinite(&name.to_string(), value),
        _ => infinite(&format!("{key}.{name}"), value),
    };
    match value {
        toml::Value::Float(number) if !number.is_finite() => Some((key.to_owned(), *number)),
        toml::Value::Array(values) => values.iter().enumerate().find_map(|(i, v)| inside(&i, v)),
        toml::Value::Table(table) => table.iter().find_map(|(name, v)| inside(name, v)),
        _ => None,
    }
}

fn assign(document: &mut DocumentMut, set: &str) -> Parsed<()> {
    let (path, value) = split(set).ok_or("must have the form key=value, such as solver.dt=1e-6")?;
    let path: Vec<&str> = path.iter().map(Key::get).collect();
    if path.len() > DEEPEST {
        return Err(format!("names a key {} tables deep; a scene has none deeper than {DEEPEST}", path.len()));
    }
    if let [list, number, ..] = path[..]
        && LISTS.contains(&list)
        && !document.contains_key(list)
    {
        return Err(format!("the scene has no [[{list}]], so there is no `{list}.{number}`"));
    }
    assign_in(document.as_table_mut(), &path, read_value(value)?)
}

/// A TOML value, or a bare word as a string.
fn read_value(text: &str) -> Parsed<Value> {
    let bare = |text: &str| !text.is_empty() && !text.contains(['"', '\'', '[', ']', '{', '}']);
    match text.parse() {
        Ok(value) => Ok(value),
        Err(_) if bare(text) => Ok(Value::from(text)),
        Err(_) => Err(format!("`{text}` is no TOML value")),
    }
}

fn assign_in(table: &mut dyn TableLike, path: &[&str], value: Value) -> Parsed<()> {
    let Some((&key, rest)) = path.split_first() else {
        return Err("names a table; name a key in it".to_owned());
    };
    if rest.is_empty() {
        table.insert(key, Item::Value(value));
        return Ok(());
    }
    let missing = Item::Value(Value::InlineTable(InlineTable::new()));
    assign_at(table.entry(key).or_insert(missing), key, rest, value)
}

/// Goes on with the non-empty rest of the path inside `item`, which is called `name`.
fn assign_at(item: &mut Item, name: &str, path: &[&str], value: Value) -> Parsed<()> {
    match item {
        Item::ArrayOfTables(tables) => {
            let index = index(name, path[0], tables.len())?;
            let table = tables.get_mut(index).expect("the index is checked");
            assign_in(table, &path[1..], value)
        }
        Item::Value(Value::Array(values)) => {
            let index = index(name, path[0], values.len())?;
            if path.len() == 1 {
                values.replace(index, value);
                return Ok(());
            }
            match values.get_mut(index).and_then(Value::as_inline_table_mut) {
                Some(table) => assign_in(table, &path[1..], value),
                None => Err(format!("{name}.{index} is a value and has no keys")),
            }
        }
        _ => match item.as_table_like_mut() {
            Some(table) => assign_in(table, path, value),
            None => Err(format!("{name} is a value and has no key `{}`", path[0])),
        },
    }
}

fn index(name: &str, key: &str, len: usize) -> Parsed<usize> {
    match key.parse() {
        Ok(index) if index < len => Ok(index),
        _ => Err(format!("{name} has no entry `{key}`; it has {len}, counted from 0")),
    }
}
