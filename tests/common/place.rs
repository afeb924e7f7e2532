//! A folder in which the program runs, for tests that start it.
#![allow(dead_code)] // every test binary uses a part of it

use serde_json::Value;
use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Output},
};
use tempfile::{TempDir, tempdir};

pub struct Place {
    folder: TempDir,
    /// For temporary files.
    temporary: TempDir,
}

impl Place {
    /// With `scene.toml` in it.
    pub fn new(scene: &str) -> Place {
        let [folder, temporary] = [(); 2].map(|()| tempdir().expect("a folder"));
        fs::write(folder.path().join("scene.toml"), scene).expect("a scene file");
        Place { folder, temporary }
    }

    pub fn folder(&self) -> &Path {
        self.folder.path()
    }

    pub fn temporary(&self) -> &Path {
        self.temporary.path()
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder().join(name)
    }

    pub fn write(&self, name: &str, text: &str) {
        fs::write(self.path(name), text).unwrap_or_else(|e| panic!("{name}: {e}"));
    }

    pub fn text(&self, name: &str) -> String {
        fs::read_to_string(self.path(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
    }

    pub fn json(&self, name: &str) -> Value {
        serde_json::from_str(&self.text(name)).expect("JSON")
    }

    /// Of the result in a folder.
    pub fn summary(&self, folder: &str) -> Value {
        self.json(&format!("{folder}/summary.json"))
    }

    pub fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_packstone"));
        command.current_dir(self.folder()).env("TMPDIR", self.temporary()).args(arguments);
        command
    }

    pub fn output(&self, arguments: &[&str]) -> Output {
        self.command(arguments).output().expect("the program starts")
    }

    /// Expects this exit code.
    pub fn packstone(&self, arguments: &[&str], code: i32) -> Output {
        let output = self.output(arguments);
        assert_eq!(output.status.code(), Some(code), "{arguments:?}: {output:?}");
        output
    }

    /// The same; what was said on the standard error.
    pub fn errors(&self, arguments: &[&str], code: i32) -> String {
        errors(&self.packstone(arguments, code))
    }

    /// Runs `scene.toml` on the CPU, and expects this exit code.
    pub fn run(&self, more: &[&str], code: i32) -> Output {
        self.packstone(&[&["run", "scene.toml", "--engine=cpu"], more].concat(), code)
    }
}

/// The engines to run on: a machine without an adapter fails the test, unless `PACKSTONE_ALLOW_NO_GPU=1` says that this
/// is known and wanted.
pub fn engines() -> &'static [&'static str] {
    let without_gpu = std::env::var("PACKSTONE_ALLOW_NO_GPU").is_ok_and(|v| v == "1");
    if without_gpu { &["cpu"] } else { &["cpu", "gpu"] }
}

/// What was said on the standard error.
pub fn errors(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}
