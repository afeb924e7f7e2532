//! Where a scene came from, and what messages say of it.

use std::fmt::Display;
use std::path::{Path, PathBuf};

use toml_edit::Key;

use crate::{Error, Result, input};

/// The text of a file that ought to be `what`.
pub fn read_text(path: &Path, what: &str) -> Result<String> {
    let name = path.display();
    if path.is_dir() {
        return Err(Error::Scene(format!("{name}: is a folder, not {what}")));
    }
    let mut bytes = input::read(path)?;
    let other = match bytes[..] {
        [0xff, 0xfe, ..] | [0xfe, 0xff, ..] => Some("is UTF-16 text; save it as UTF-8"),
        [0x1f, 0x8b, ..] => Some("is compressed; unpack it first"),
        _ => None,
    };
    if let Some(other) = other {
        return Err(Error::Scene(format!("{name}: {other}")));
    }
    // The mark that some programs begin a text with.
    if bytes.starts_with(b"\xef\xbb\xbf") {
        bytes.drain(..3);
    }
    String::from_utf8(bytes).map_err(|error| {
        let good = &error.as_bytes()[..error.utf8_error().valid_up_to()];
        let line = good.iter().filter(|byte| **byte == b'\n').count() + 1;
        Error::Scene(format!("{name}:{line}: is not UTF-8 text"))
    })
}

/// What makes a scene one that goes on with the grains of another.
#[derive(Clone, Debug)]
pub struct GoingOn {
    /// The file with the grains.
    pub start: PathBuf,
    /// The text of the scene without them.
    pub given: String,
}

/// A value that was changed before the scene was read, and where: the path of its key, with numbers for entries of lists.
#[derive(Clone, Debug)]
pub struct Override {
    pub text: String,
    pub path: Vec<String>,
}

/// Where a scene came from; every message starts with it.
#[derive(Clone, Debug)]
pub struct Origin {
    pub name: String,
    pub directory: PathBuf,
    pub set: Vec<Override>,
}

impl Origin {
    /// An error at `key`, a path in the notation of `--set`. If an override wrote there, the message says so.
    pub fn error(&self, key: &str, message: impl Display) -> Error {
        let culprit = self.set.iter().rev().find(|set| touches(&set.path, key));
        match culprit {
            Some(Override { text, .. }) => Error::Scene(format!("{} (--set {text}): {key}{message}", self.name)),
            None => Error::Scene(format!("{}: {key}{message}", self.name)),
        }
    }

    /// The same error, if it is one of another file, or of the machine, with the name of the scene.
    pub fn about(&self, error: Error) -> Error {
        let text = error.to_string();
        match error {
            _ if text.starts_with(&self.name) => error,
            Error::Lacking(_) => Error::Lacking(format!("{}: {text}", self.name)),
            Error::Scene(_) | Error::Io { .. } => Error::Scene(format!("{}: {text}", self.name)),
            other => other,
        }
    }

    /// An error about the value at `key`; `rule` says what is allowed.
    pub fn bad(&self, key: &str, value: impl Display, rule: impl Display) -> Error {
        self.error(key, format!(" = {value}: {rule}"))
    }

    /// An error about `key` as a whole.
    pub fn wrong(&self, key: &str, message: impl Display) -> Error {
        self.error(key, format!(": {message}"))
    }
}

/// Whether what was written at a path is `key`, something inside it, or a table that holds it.
fn touches(path: &[String], key: &str) -> bool {
    let written = path.join(".");
    let within = |inner: &str, outer: &str| {
        inner.strip_prefix(outer).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
    };
    within(key, &written) || within(&written, key)
}

/// Path and value text of `key=value`.
pub fn split(set: &str) -> Option<(Vec<Key>, &str)> {
    let (path, value) = set.split_once('=')?;
    Some((Key::parse(path.trim()).ok()?, value.trim()))
}
