//! Tells the program which commit it is made from, for the reports of `packstone bench`.

use std::process::Command;

fn main() {
    // The same files whose change compiles the library anew, so that a commit alone compiles nothing.
    for path in ["build.rs", "Cargo.toml", "src", "shaders"] {
        println!("cargo:rerun-if-changed={path}");
    }
    let commit = git(&["rev-parse", "--short=12", "HEAD"]).unwrap_or_else(|| "unknown".to_owned());
    let changed = git(&["status", "--porcelain", "--", "src", "shaders"]).is_some_and(|files| !files.is_empty());
    println!("cargo:rustc-env=PACKSTONE_COMMIT={commit}{}", if changed { "+" } else { "" });
}

/// What git says about this folder; None outside a checkout of packstone, or without git.
fn git(arguments: &[&str]) -> Option<String> {
    std::path::Path::new(".git").exists().then_some(())?;
    let output = Command::new("git").args(arguments).output().ok()?;
    output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim().to_owned())
}
