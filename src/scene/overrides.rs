//! `--set key=value`: edits of the TOML document before it is read.

use toml_edit::{ArrayOfTables, DocumentMut, InlineTable, Item, Key, Table, TableLike, Value};

use super::check::FINITE;
use super::origin::{Origin, Override, split};
use super::schema::{self, Fault};
use crate::{Error, Result};

/// What a scene has any number of.
const LISTS: [&str; 7] = ["pair", "wall", "shape", "grain", "population", "growth", "stage"];
/// More tables in each other than a scene has.
const DEEPEST: usize = 20;

/// A value, or what is wrong with it.
pub type Parsed<T> = std::result::Result<T, String>;

/// The text with all overrides written into it, and where they are.
pub fn apply(text: &str, set: &[String], origin: &Origin) -> Result<(String, Vec<Override>)> {
    if set.is_empty() {
        return Ok((text.to_owned(), Vec::new()));
    }
    let mut document: DocumentMut = text.parse().map_err(|error: toml_edit::TomlError| {
        let start = error.span().map(|span| span.start);
        in_file(Fault::new(text, start, error.message()), origin)
    })?;
    let mut written = Vec::new();
    for set in set {
        let path = assign(&mut document, set)
            .map_err(|message| Error::Scene(format!("{} (--set {set}): {message}", origin.name)))?;
        written.push(Override { text: set.clone(), path });
    }
    Ok((document.to_string(), written))
}

/// Finds out whether `fault`, met after all overrides, is due to one of them or to the file itself.
pub fn blame(text: &str, fault: Fault, origin: &Origin) -> Error {
    let set = &origin.set;
    let texts: Vec<String> = set.iter().map(|set| set.text.clone()).collect();
    let reads =
        |count: usize| apply(text, &texts[..count], origin).is_ok_and(|(edited, _)| schema::read(&edited).is_ok());
    if let Some(culprit) = (0..set.len()).rev().find(|&count| reads(count)) {
        let (name, set) = (&origin.name, &texts[culprit]);
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

/// Where the value was written.
fn assign(document: &mut DocumentMut, set: &str) -> Parsed<Vec<String>> {
    let (path, value) = split(set).ok_or("must have the form key=value, such as solver.dt=1e-6")?;
    let path: Vec<&str> = path.iter().map(Key::get).collect();
    if path.len() > DEEPEST {
        return Err(format!("names a key {} tables deep; a scene has none deeper than {DEEPEST}", path.len()));
    }
    write(document, &path, read_value(value)?)
}

/// Write a value at a path, whose entries of lists are numbers or names: where it was written.
fn write(document: &mut DocumentMut, path: &[&str], value: Value) -> Parsed<Vec<String>> {
    if let [list, number, ..] = path[..]
        && LISTS.contains(&list)
        && !document.contains_key(list)
    {
        return Err(format!("the scene has no [[{list}]], so there is no `{list}.{number}`"));
    }
    let mut written = Vec::new();
    assign_in(document.as_table_mut(), path, value, &mut written)?;
    Ok(written)
}

/// Write a part of a scene into it: tables into tables, entries of lists behind those that are there, and any other value
/// in the place of the one before. `path` leads to the part.
pub fn merge(document: &mut DocumentMut, path: &mut Vec<String>, part: &Item) -> Parsed<()> {
    if let Some(table) = part.as_table_like() {
        // A table without keys asks for defaults.
        if let [first] = &path[..]
            && table.is_empty()
            && !document.contains_key(first)
        {
            document.insert(first, Item::Table(Table::new()));
        }
        for (key, inside) in table.iter() {
            path.push(key.to_owned());
            merge(document, path, inside)?;
            path.pop();
        }
        return Ok(());
    }
    if let [list] = &path[..]
        && LISTS.contains(&list.as_str())
        && let Ok(entries) = part.clone().into_array_of_tables()
    {
        let there = document.entry(list).or_insert(Item::ArrayOfTables(ArrayOfTables::new()));
        return match there {
            Item::ArrayOfTables(tables) => {
                entries.into_iter().for_each(|table| tables.push(table));
                Ok(())
            }
            Item::Value(Value::Array(values)) => {
                entries.into_iter().for_each(|table| values.push(table.into_inline_table()));
                Ok(())
            }
            _ => Err(format!("{list} is no list of tables")),
        };
    }
    let value = part.clone().into_value().map_err(|_| format!("{} has no value", path.join(".")))?;
    let path: Vec<&str> = path.iter().map(String::as_str).collect();
    write(document, &path, value).map(drop)
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

fn assign_in(table: &mut dyn TableLike, path: &[&str], value: Value, written: &mut Vec<String>) -> Parsed<()> {
    let Some((&key, rest)) = path.split_first() else {
        return Err("names a table; name a key in it".to_owned());
    };
    written.push(key.to_owned());
    if rest.is_empty() {
        table.insert(key, Item::Value(value));
        return Ok(());
    }
    let missing = Item::Value(Value::InlineTable(InlineTable::new()));
    assign_at(table.entry(key).or_insert(missing), key, rest, value, written)
}

/// Goes on with the non-empty rest of the path inside `item`, which is called `name`.
fn assign_at(item: &mut Item, name: &str, path: &[&str], value: Value, written: &mut Vec<String>) -> Parsed<()> {
    match item {
        Item::ArrayOfTables(tables) => {
            let names: Vec<_> = tables.iter().map(|table| table.get("name").and_then(Item::as_str)).collect();
            let index = index(name, path[0], &names)?;
            written.push(index.to_string());
            let table = tables.get_mut(index).expect("the index is checked");
            assign_in(table, &path[1..], value, written)
        }
        Item::Value(Value::Array(values)) => {
            let of = |value: &Value| value.as_inline_table()?.get("name")?.as_str().map(str::to_owned);
            let names: Vec<_> = values.iter().map(of).collect();
            let index = index(name, path[0], &names.iter().map(Option::as_deref).collect::<Vec<_>>())?;
            written.push(index.to_string());
            if path.len() == 1 {
                values.replace(index, value);
                return Ok(());
            }
            match values.get_mut(index).and_then(Value::as_inline_table_mut) {
                Some(table) => assign_in(table, &path[1..], value, written),
                None => Err(format!("{name}.{index} is a value and has no keys")),
            }
        }
        _ => match item.as_table_like_mut() {
            Some(table) => assign_in(table, path, value, written),
            None => Err(format!("{name} is a value and has no key `{}`", path[0])),
        },
    }
}

/// The place of an entry in a list, by its number or its name.
fn index(list: &str, key: &str, names: &[Option<&str>]) -> Parsed<usize> {
    let number = key.parse().ok().filter(|index| *index < names.len());
    number.or_else(|| names.iter().position(|name| *name == Some(key))).ok_or_else(|| {
        let known: Vec<&str> = names.iter().flatten().copied().collect();
        let known = if known.is_empty() { String::new() } else { format!(", or by name: {}", known.join(", ")) };
        format!("{list} has no entry `{key}`; it has {}, counted from 0{known}", names.len())
    })
}
