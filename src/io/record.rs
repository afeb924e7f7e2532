//! `run.json`: what was run on which machine, how it ended, and which files it wrote.

use super::{
    files::{at, crc32, is_file, write},
    names::{CHECKPOINT, FRAMES, INPUTS, PREVIOUS, RUN, STAGES, is_of_frames, is_of_series, is_reserved, within_stage},
};
use crate::{container::is_container, engine::Gpu, error::Result, scene::Scene, simulation::Simulation};
use serde::{Deserialize, Serialize};
use std::{
    any::Any,
    collections::BTreeMap,
    fs,
    io::{self, Write},
    path::{Component, Path, PathBuf},
    process::Command,
    time::{SystemTime, UNIX_EPOCH},
};

/// Files up to this size are copied, and their checksums compared, bytes.
pub const SMALL: u64 = 16 << 20;

/// The content of `run.json`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// Version of the program. No other file has this key.
    pub packstone: String,
    /// Arguments of the command line.
    pub command: Vec<String>,
    /// The scene file, as seen from the folder of the result.
    pub scene: Option<String>,
    /// The file with the scene as it was run, and what it reads.
    pub scene_as_run: Option<String>,
    /// The file with the scene as it was given, with the names of files as they were there, and without the grains of
    /// another run that it went on with; None if it was run like that.
    pub scene_as_given: Option<String>,
    pub seed: Option<u64>,
    #[serde(default)]
    pub inputs: Vec<Kept>,
    pub machine: Option<Machine>,
    /// When it started and ended, RFC 3339; None while it runs, or if it was killed.
    pub start: Option<String>,
    pub end: Option<String>,
    /// Why it ended; None as above.
    pub ended: Option<String>,
    /// Whether that was its last step, or equilibrium.
    #[serde(default)]
    pub complete: bool,
    /// When it was continued, and with which arguments.
    #[serde(default)]
    pub resumed: Vec<Resumed>,
    /// Of a run in stages: these, in their order.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub stages: Vec<StageOf>,
    /// What it wrote besides this file, with `/` between folder and file.
    #[serde(default)]
    pub files: BTreeMap<String, Written>,
}

/// A stage of a run, whose result is in a folder of its own.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StageOf {
    pub name: String,
    /// Whether the stage before it has been run again since, so that it does not follow from it.
    pub outdated: bool,
}

/// A file that was read.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Kept {
    /// Where the scene names it, in the notation of `--set`.
    pub key: String,
    /// Where it is: the copy in the folder of the result, or the file itself.
    pub path: String,
    pub bytes: u64,
    pub crc32: String,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Machine {
    pub cpu: String,
    /// Threads that can run at once.
    pub cores: usize,
    pub system: String,
    pub engine: String,
    pub adapter: String,
    pub driver: Option<String>,
    pub precision: String,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Resumed {
    pub start: String,
    pub command: Vec<String>,
    /// The step from which on.
    pub step: u64,
}

/// A file as it was written.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Written {
    pub bytes: u64,
    /// Of small files that are neither snapshots nor frames.
    pub crc32: Option<String>,
}

impl Record {
    /// Of a run that starts now.
    pub fn new(scene: &Scene, simulation: &Simulation, command: Vec<String>) -> Record {
        let engine = simulation.engine();
        let gpu = (engine as &dyn Any).downcast_ref::<Gpu>();
        Record {
            packstone: env!("CARGO_PKG_VERSION").to_owned(),
            command,
            seed: Some(scene.seed()),
            machine: Some(Machine {
                cpu: cpu_name(),
                cores: std::thread::available_parallelism().map_or(1, |n| n.get()),
                system: format!("{} {}", std::env::consts::OS, std::env::consts::ARCH),
                engine: engine.name().to_owned(),
                adapter: engine.adapter(),
                driver: gpu.map(|gpu| gpu.device().summary.driver.clone()),
                precision: simulation.model().precision.label().to_owned(),
            }),
            start: Some(now()),
            ..Record::default()
        }
    }

    /// That of a folder; None if there is none, or the file is not of packstone.
    pub fn read(folder: &Path) -> Option<Record> {
        let path = folder.join(RUN);
        let text = is_file(&path).ok()?.then(|| fs::read_to_string(path).ok())?;
        let mut record: Record = serde_json::from_str(&text?).ok()?;
        if record.end.is_none() && record.files.is_empty() {
            // It goes on, or was killed: its files are those that it may have written.
            record.list(folder).ok()?;
            record.files.retain(|name, _| {
                is_reserved(name)
                    || within_stage(name) != name
                    || name.starts_with("inputs/")
                    || name.strip_prefix("frames/").is_some_and(is_of_frames)
                    || record.scene_as_run.as_ref() == Some(name)
                    || record.scene_as_given.as_ref() == Some(name)
            });
        }
        Some(record)
    }

    pub fn write(&self, folder: &Path) -> Result<()> {
        write(&folder.join(RUN), |file| {
            serde_json::to_writer_pretty(&mut *file, self)?;
            writeln!(file)?;
            file.flush()?;
            file.get_ref().sync_all()
        })
    }

    /// Those of its files that are in a folder as they were written; what was changed since is somebody else's.
    pub fn files_in<'a>(&'a self, folder: &'a Path) -> impl Iterator<Item = &'a String> {
        self.files.iter().filter(|(name, written)| written.is_at(folder, name).unwrap_or(false)).map(|(name, _)| name)
    }

    /// List the files of a folder that a run has written.
    pub fn list(&mut self, folder: &Path) -> Result<()> {
        self.files.clear();
        for name in names(folder)?.into_iter().filter(|name| name != RUN) {
            let path = folder.join(&name);
            let check = !is_of_series(&name);
            let written = Written::of(&path, check).map_err(at(&path))?;
            self.files.insert(name, written);
        }
        Ok(())
    }
}

impl Written {
    fn of(path: &Path, check: bool) -> io::Result<Written> {
        let bytes = fs::symlink_metadata(path)?.len();
        Ok(Written { bytes, crc32: (check && bytes <= SMALL).then(|| crc32(path)).transpose()? })
    }

    /// Whether this is what a folder has under that name.
    fn is_at(&self, folder: &Path, name: &str) -> io::Result<bool> {
        let relative = Path::new(name);
        // The list is a file, which anybody may have written.
        let plain = relative.components().all(|part| matches!(part, Component::Normal(_)));
        let inside = folders_of(relative).all(|part| is_folder(&folder.join(part)));
        let path = folder.join(relative);
        let here = plain && inside && is_file(&path)?;
        // A checkpoint that was damaged is one nevertheless, and its place is needed for the next.
        let damaged = || [CHECKPOINT, PREVIOUS].contains(&within_stage(name)) && is_container(&path);
        Ok(here && (Written::of(&path, self.crc32.is_some())? == *self || damaged()))
    }
}

/// Whether there is a folder, a link not being one.
pub fn is_folder(path: &Path) -> bool {
    fs::symlink_metadata(path).is_ok_and(|found| found.is_dir())
}

/// The folders that a relative path leads through, the innermost first.
pub fn folders_of(relative: &Path) -> impl Iterator<Item = &Path> {
    relative.ancestors().skip(1).filter(|part| !part.as_os_str().is_empty())
}

/// The files of a result's folder, of its inputs, frames and stages.
pub fn names(folder: &Path) -> Result<Vec<String>> {
    let mut names = Vec::new();
    let folders = [("", folder.to_owned()), ("inputs/", folder.join(INPUTS)), ("frames/", folder.join(FRAMES))];
    for (prefix, inside) in folders {
        if !is_folder(&inside) {
            continue;
        }
        for entry in fs::read_dir(&inside).map_err(at(&inside))? {
            let entry = entry.map_err(at(&inside))?;
            let is_file = entry.file_type().map_err(at(&inside))?.is_file();
            if let Some(name) = entry.file_name().to_str().filter(|name| is_file && !name.ends_with(".part")) {
                names.push(format!("{prefix}{name}"));
            }
        }
    }
    let stages = folder.join(STAGES);
    if is_folder(&stages) {
        for entry in fs::read_dir(&stages).map_err(at(&stages))? {
            let entry = entry.map_err(at(&stages))?;
            if let Some(stage) = entry.file_name().to_str().filter(|_| is_folder(&entry.path())) {
                names.extend(self::names(&entry.path())?.into_iter().map(|name| format!("{STAGES}/{stage}/{name}")));
            }
        }
    }
    Ok(names)
}

/// A path as seen from a folder, both as the system has them; the path itself if they have no root in common.
pub fn relative(folder: &Path, path: &Path) -> PathBuf {
    let shared = folder.components().zip(path.components()).take_while(|(a, b)| a == b).count();
    if shared == 0 {
        return path.to_owned();
    }
    let up = folder.components().skip(shared).map(|_| Component::ParentDir);
    up.chain(path.components().skip(shared)).collect()
}

/// Name of the processor, as Linux, macOS and Windows tell it.
pub fn cpu_name() -> String {
    let of_linux = || {
        let text = fs::read_to_string("/proc/cpuinfo").ok()?;
        let line = text.lines().find(|line| line.starts_with("model name"))?;
        Some(line.split_once(':')?.1.trim().to_owned())
    };
    let of_macos = || {
        let output = Command::new("sysctl").args(["-n", "machdep.cpu.brand_string"]).output().ok()?;
        output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim().to_owned())
    };
    let of_windows = || std::env::var("PROCESSOR_IDENTIFIER").ok();
    of_linux().or_else(of_macos).or_else(of_windows).unwrap_or_else(|| "unknown".to_owned())
}

/// The time, RFC 3339 in UTC.
pub fn now() -> String {
    rfc3339(SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs()))
}

/// Of seconds since 1970. Eras of 400 years begin on 1 March, so that leap days come last.
fn rfc3339(seconds: u64) -> String {
    let (days, rest) = (seconds / 86_400 + 719_468, seconds % 86_400);
    let (era, day) = (days / 146_097, days % 146_097);
    let year = (day - day / 1_460 + day / 36_524 - day / 146_096) / 365;
    let day = day - (365 * year + year / 4 - year / 100);
    let month = (5 * day + 2) / 153;
    let date = day - (153 * month + 2) / 5 + 1;
    let (month, turn) = if month < 10 { (month + 3, 0) } else { (month - 9, 1) };
    let year = 400 * era + year + turn;
    format!("{year:04}-{month:02}-{date:02}T{:02}:{:02}:{:02}Z", rest / 3600, rest / 60 % 60, rest % 60)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_are_those_of_the_calendar() {
        for (seconds, date) in [
            (0, "1970-01-01T00:00:00Z"),
            (951_782_399, "2000-02-28T23:59:59Z"),
            (951_782_400, "2000-02-29T00:00:00Z"),
            (951_868_800, "2000-03-01T00:00:00Z"),
            (1_704_067_199, "2023-12-31T23:59:59Z"),
            (4_107_542_400, "2100-03-01T00:00:00Z"),
        ] {
            assert_eq!(rfc3339(seconds), date);
        }
    }

    #[test]
    fn paths_lead_from_folder_to_file() {
        let way = |folder: &str, path: &str| relative(Path::new(folder), Path::new(path)).display().to_string();
        assert_eq!(way("/a/out/heap", "/a/heap.toml"), "../../heap.toml");
        assert_eq!(way("/a", "/a/b/heap.toml"), "b/heap.toml");
    }

    #[test]
    fn what_was_changed_or_lies_elsewhere_is_not_listed() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        fs::create_dir_all(path("here/inputs")).unwrap();
        for name in
            ["outside", "here/same", "here/changed", "here/snapshot_000000.vtp", "here/inputs/bed.csv", "here/gone"]
        {
            fs::write(path(name), "text").unwrap();
        }
        let here = path("here");
        let mut record = Record { packstone: "1".to_owned(), ..Record::default() };
        record.list(&here).unwrap();
        assert_eq!(record.files.len(), 5);
        record.files.insert("../outside".to_owned(), record.files["same"].clone());
        fs::write(path("here/changed"), "test").unwrap();
        fs::remove_file(path("here/gone")).unwrap();
        record.write(&here).unwrap();
        let record = Record::read(&here).unwrap();
        assert_eq!(record.files_in(&here).collect::<Vec<_>>(), ["inputs/bed.csv", "same", "snapshot_000000.vtp"]);
        fs::write(path("here/run.json"), "{}").unwrap();
        assert_eq!(Record::read(&here), None);
    }
}
