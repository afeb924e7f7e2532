//! What the files of a run are called.

pub const HISTORY: &str = "history.csv";
pub const FINAL: &str = "final.csv";
pub const FINAL_BIN: &str = "final.bin";
pub const MEMBERS: &str = "members.csv";
pub const SUMMARY: &str = "summary.json";
pub const SERIES: &str = "packstone.pvd";
/// What was run, and the list of the files: [`Record`](super::Record).
pub const RUN: &str = "run.json";
/// The whole state, and the one before it.
pub const CHECKPOINT: &str = "checkpoint.bin";
pub const PREVIOUS: &str = "checkpoint.previous.bin";
/// The scene as it was run, and the folder with copies of what it read.
pub const SCENE: &str = "scene.toml";
pub const INPUTS: &str = "inputs";
/// The scene as it was given, where that is not the same.
pub const GIVEN: &str = "scene.given.toml";

/// The folder with the results of stages, each in a folder of its name.
pub const STAGES: &str = "stages";

/// The name of a file as its own stage has it.
pub fn within_stage(name: &str) -> &str {
    let of_stage = name.strip_prefix(STAGES).and_then(|rest| rest.strip_prefix('/')?.split_once('/'));
    of_stage.map_or(name, |(_, name)| name)
}

pub fn snapshot(number: usize, extension: &str) -> String {
    format!("snapshot_{number:06}.{extension}")
}

/// The number of a snapshot of this name.
pub fn snapshot_number(name: &str) -> Option<usize> {
    let of_snapshot = name.strip_suffix(".vtp").or_else(|| name.strip_suffix(".bin"))?;
    let digits = of_snapshot.strip_prefix("snapshot_")?;
    digits.bytes().all(|digit| digit.is_ascii_digit()).then(|| digits.parse().ok())?
}

/// Whether a run may write a file of this name. The scene and the inputs are called otherwise where a name is taken.
pub fn is_reserved(name: &str) -> bool {
    [HISTORY, FINAL, MEMBERS, FINAL_BIN, SUMMARY, SERIES, RUN, CHECKPOINT, PREVIOUS].contains(&name)
        || snapshot_number(name).is_some()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_a_run_are_reserved() {
        let ours =
            ["summary.json", "snapshot_000012.vtp", "snapshot_1234567.bin", "final.bin", "run.json", "checkpoint.bin"];
        assert!(ours.into_iter().all(is_reserved));
        let others =
            ["picture.png", "snapshot_mine.vtp", "snapshot_+1.vtp", "snapshot_.vtp", "notes.csv", "summary.json.bak"];
        assert!(!others.into_iter().any(is_reserved));
        assert_eq!(snapshot_number(&snapshot(7, "vtp")), Some(7));
        let within = [("stages/a/final.csv", "final.csv"), ("stages/a", "stages/a"), ("inputs/a/b", "inputs/a/b")];
        assert!(within.iter().all(|(name, own)| within_stage(name) == *own));
    }
}
