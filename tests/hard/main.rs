//! Hard cases for DEM. Each is a function that measures figures on one engine (`cases/`), with what theory expects and
//! how far rounding or the scheme's order lets it be off; here each becomes a test on all engines, and
//! `examples/hard_cases.rs` prints the same figures as the table of `docs/hard-cases.md`.

#[path = "../common/mod.rs"]
mod common;

mod cases;

/// A scene that nobody runs proves nothing.
#[test]
fn every_hard_scene_is_a_case() {
    for entry in std::fs::read_dir(cases::folder()).unwrap() {
        let path = entry.unwrap().path();
        let stem = path.file_stem().unwrap().to_str().unwrap().to_owned();
        let used = cases::ALL.iter().any(|case| case.scenes.contains(&stem.as_str()));
        assert!(used, "{stem} belongs to no case");
    }
}
