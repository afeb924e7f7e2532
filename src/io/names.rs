//! What the files of a run are called.

pub const HISTORY: &str = "history.csv";
pub const FINAL: &str = "final.csv";
pub const FINAL_BIN: &str = "final.bin";
pub const MEMBERS: &str = "members.csv";
/// Of the states of a search for the jamming fraction.
pub const JAMMING: &str = "jamming.csv";
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

/// The beginning of a name, and the endings that come with it: what the last state and snapshots may be written as.
const OF_GRAINS: (&str, &[&str]) = ("snapshot", &["vtp", "bin", "npz", "xyz", "dump"]);
const OF_CONTACTS: (&str, &[&str]) = ("contacts", &["csv", "vtp"]);

/// Of the grains of a snapshot.
pub fn snapshot(number: usize, extension: &str) -> String {
    format!("{}_{number:06}.{extension}", OF_GRAINS.0)
}

/// Of its contacts.
pub fn contacts_of_snapshot(number: usize, extension: &str) -> String {
    format!("{}_{number:06}.{extension}", OF_CONTACTS.0)
}

/// Of all that the last state has.
pub fn last(extension: &str) -> String {
    format!("final.{extension}")
}

/// Of the contacts of the last state.
pub fn contacts(extension: &str) -> String {
    format!("{}.{extension}", OF_CONTACTS.0)
}

/// The folder with pictures of a run in the course of time.
pub const FRAMES: &str = "frames";
/// What these have in common, in that folder.
pub const FRAMES_RECORD: &str = "frames.json";

/// A picture of them, counted from 1, or the state that it is of.
pub fn frame(number: usize, extension: &str) -> String {
    format!("frame_{number:04}.{extension}")
}

/// The number of a frame of this name.
pub fn frame_number(name: &str) -> Option<usize> {
    let (digits, ending) = name.strip_prefix("frame_")?.split_once('.')?;
    let is_ours = ["png", "bin"].contains(&ending) && digits.bytes().all(|digit| digit.is_ascii_digit());
    is_ours.then(|| digits.parse().ok())?
}

/// Whether a run may write a file of this name among its frames.
pub fn is_of_frames(name: &str) -> bool {
    name == FRAMES_RECORD || frame_number(name).is_some()
}

/// Whether this is one of many files: of a snapshot, or a frame.
pub fn is_of_series(name: &str) -> bool {
    let name = within_stage(name);
    snapshot_number(name).is_some() || name.strip_prefix(FRAMES).is_some_and(|rest| rest.starts_with('/'))
}

/// The number of a snapshot of this name.
pub fn snapshot_number(name: &str) -> Option<usize> {
    let (beginning, rest) = name.split_once('_')?;
    let (digits, ending) = rest.split_once('.')?;
    [OF_GRAINS, OF_CONTACTS].iter().find(|(known, endings)| *known == beginning && endings.contains(&ending))?;
    digits.bytes().all(|digit| digit.is_ascii_digit()).then(|| digits.parse().ok())?
}

/// Whether a run may write a file of this name. The scene and the inputs are called otherwise where a name is taken.
pub fn is_reserved(name: &str) -> bool {
    [HISTORY, FINAL, MEMBERS, FINAL_BIN, JAMMING, SUMMARY, SERIES, RUN, CHECKPOINT, PREVIOUS].contains(&name)
        || OF_GRAINS.1[2..].iter().any(|ending| last(ending) == name)
        || OF_CONTACTS.1.iter().any(|ending| contacts(ending) == name)
        || snapshot_number(name).is_some()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_a_run_are_reserved() {
        let ours = [
            "contacts.csv",
            "contacts_000003.vtp",
            "final.npz",
            "jamming.csv",
            "final.dump",
            "snapshot_000001.xyz",
            "summary.json",
            "snapshot_000012.vtp",
            "snapshot_1234567.bin",
            "final.bin",
            "run.json",
            "checkpoint.bin",
        ];
        assert!(ours.into_iter().all(is_reserved));
        let others = [
            "contacts_000003.xyz",
            "snapshot_000001.csv",
            "final.vtp",
            "picture.png",
            "snapshot_mine.vtp",
            "snapshot_+1.vtp",
            "snapshot_.vtp",
            "notes.csv",
            "summary.json.bak",
        ];
        assert!(!others.into_iter().any(is_reserved));
        assert!(is_of_frames(&frame(12345, "png")) && is_of_frames(&frame(1, "bin")) && is_of_frames(FRAMES_RECORD));
        assert!(["frame_a.png", "frame_0001.jpg", "film.mp4"].iter().all(|name| !is_of_frames(name)));
        assert!(is_of_series("stages/a/frames/frame_0001.png") && !is_of_series("frames.json"));
        assert_eq!(snapshot_number(&snapshot(7, "vtp")), Some(7));
        let within = [("stages/a/final.csv", "final.csv"), ("stages/a", "stages/a"), ("inputs/a/b", "inputs/a/b")];
        assert!(within.iter().all(|(name, own)| within_stage(name) == *own));
    }
}
