//! The one error type of the library. Every message names the file, line or key, the value, and what is allowed.

use std::path::PathBuf;

/// Everything that can go wrong in packstone.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The scene (file, `--set` override or data file it names) is not usable. Exit code 2.
    #[error("{}", bounded(.0))]
    Scene(String),
    /// A frictional contact problem (its file, its numbers, or what is asked of it) is not usable. Exit code 2.
    #[error("{}", bounded(.0))]
    Problem(String),
    /// The machine has not what was asked for: no adapter, not enough memory, a missing feature. Exit code 2.
    #[error("{0}")]
    Lacking(String),
    /// The device has failed, or was lost. Exit code 2.
    #[error("{0}")]
    Device(String),
    /// The folder of a result cannot be used: another run writes there, or files that are not packstone's are in the way.
    /// Exit code 2.
    #[error("{0}")]
    Folder(String),
    /// A run had to stop; the last good state is kept.
    #[error("stopped at step {step} (t = {time:e} s): {reason}")]
    Run { step: u64, time: f64, reason: String },
    /// A WGSL file does not compose, parse or validate: a defect of packstone, not of the scene.
    #[error("shader {file}:{line}: {message}")]
    Shader { file: String, line: usize, message: String },
    /// A file could not be read or written.
    #[error("{path}: {source}", path = .path.display())]
    Io { path: PathBuf, source: std::io::Error },
}

/// A message on one line of bounded length, as names and values in it may have any: what is in the middle is left out.
fn bounded(message: &str) -> String {
    const BEGIN: usize = 600;
    const END: usize = 300;
    let message = message.lines().map(str::trim).collect::<Vec<_>>().join(" ");
    let mut places = message.char_indices().map(|(at, _)| at);
    match (places.nth(BEGIN), places.nth_back(END)) {
        (Some(begin), Some(end)) if begin < end => format!("{} ... {}", &message[..begin], &message[end..]),
        _ => message,
    }
}

/// Shorthand used across the crate.
pub type Result<T> = std::result::Result<T, Error>;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_messages_keep_their_beginning_and_their_end() {
        let message = format!("a.toml: title = {}: must be short", "é".repeat(100_000));
        let short = Error::Scene(message).to_string();
        assert!(
            short.len() < 2000 && short.starts_with("a.toml: title") && short.ends_with("é: must be short"),
            "{short}"
        );
        assert_eq!(Error::Scene("b.toml:\n  x".to_owned()).to_string(), "b.toml: x");
        let whole = "9".repeat(901);
        assert_eq!(Error::Scene(whole.clone()).to_string(), whole);
    }
}
