//! Tells the program which commit it is made from, for the reports of `packstone bench`, and embeds the shaders.

use std::{
    env, fs,
    path::{Path, PathBuf},
    process::Command,
};

fn main() {
    // The same files whose change compiles the library anew, so that a commit alone compiles nothing.
    for path in ["build.rs", "Cargo.toml", "src", "shaders"] {
        println!("cargo:rerun-if-changed={path}");
    }
    let commit = git(&["rev-parse", "--short=12", "HEAD"]).unwrap_or_else(|| "unknown".to_owned());
    let changed = git(&["status", "--porcelain", "--", "src", "shaders"]).is_some_and(|files| !files.is_empty());
    println!("cargo:rustc-env=PACKSTONE_COMMIT={commit}{}", if changed { "+" } else { "" });
    embed_shaders();
}

/// A table of all files in `shaders/`, name and text, for `src/shaders.rs`.
fn embed_shaders() {
    let root = PathBuf::from(env::var("CARGO_MANIFEST_DIR").expect("cargo sets it")).join("shaders");
    let (mut open, mut files) = (vec![root.clone()], Vec::new());
    while let Some(folder) = open.pop() {
        for entry in fs::read_dir(&folder).expect("shaders/ is there") {
            let path = entry.expect("shaders/ can be read").path();
            if path.is_dir() { open.push(path) } else { files.push(path) }
        }
    }
    files.sort();
    let name = |path: &Path| path.strip_prefix(&root).expect("below shaders/").display().to_string().replace('\\', "/");
    let rows: String = files.iter().map(|f| format!("({:?}, include_str!({f:?})),\n", name(f))).collect();
    let text =
        format!("/// Every file of `shaders/`, with its text.\npub static FILES: &[(&str, &str)] = &[\n{rows}];\n");
    let out = PathBuf::from(env::var("OUT_DIR").expect("cargo sets it")).join("shaders.rs");
    fs::write(out, text).expect("the build folder can be written");
}

/// What git says about this folder; None outside a checkout of packstone, or without git.
fn git(arguments: &[&str]) -> Option<String> {
    Path::new(".git").exists().then_some(())?;
    let output = Command::new("git").args(arguments).output().ok()?;
    output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim().to_owned())
}
