//! The WGSL text, embedded by the build script; file names are relative to `shaders/`.

include!(concat!(env!("OUT_DIR"), "/shaders.rs"));

/// Name and text of an embedded file. Panics on a name that is not there.
pub fn file(name: &str) -> (&'static str, &'static str) {
    *FILES.iter().find(|(file, _)| *file == name).unwrap_or_else(|| panic!("no shader file is called `{name}`"))
}
