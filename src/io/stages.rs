//! The result of a run in stages: the results of the stages, each in a folder as that of any run, and what there is to say
//! of them together.

use super::{
    copy,
    files::{at, write},
    folder,
    folder::Folder,
    inputs,
    names::{STAGES, SUMMARY},
    no_record,
    record::{self, Record, Resumed, StageOf, is_folder},
};
use crate::{error::Result, scene::Scene};
use serde_json::{Map, Value, json};
use std::{
    fs,
    io::Write,
    path::{Path, PathBuf},
};

/// Stages of an earlier result that are not run again.
pub struct Kept<'a> {
    pub from: &'a Path,
    /// Those before the ones that are run, and those behind, which then follow from what is no more.
    pub before: &'a [String],
    pub behind: &'a [String],
}

/// It while it is written.
pub struct Stages {
    folder: Folder,
    record: Record,
}

/// What the summary of a run says of each stage, and has of it.
const OF_STAGE: [&str; 7] = ["ended", "stopped", "missed", "steps", "time", "converged", "doubts"];

impl Stages {
    /// Begin a result in a folder, beside the one that is there.
    ///
    /// # Errors
    /// As [`Results::create`](super::Results::create), and so in all functions below.
    pub fn create(folder: &Path, file: &Path, scene: &Scene, mut record: Record, kept: Option<Kept>) -> Result<Stages> {
        let mut folder = Folder::open(folder)?;
        let names: Vec<String> = scene.stages().iter().map(|stage| stage.name.clone()).collect();
        folder.check_stages(&names)?;
        record.scene = folder::scene_from(&folder.path, file);
        let outdated = |name: &String| {
            let Some(Kept { from, before, behind }) = &kept else { return false };
            let was =
                || Record::read(from).is_some_and(|of| of.stages.iter().any(|of| of.name == *name && of.outdated));
            behind.contains(name) || before.contains(name) && was()
        };
        record.stages = names.iter().map(|name| StageOf { name: name.clone(), outdated: outdated(name) }).collect();
        folder.begin(|folder, new| {
            inputs::keep(scene, &mut record, &folder.path, folder.older(), new)?;
            if let Some(Kept { from, before, behind }) = &kept {
                for name in before.iter().chain(*behind) {
                    let [from, to] = [*from, new].map(|folder| folder.join(STAGES).join(name));
                    if let Some(record) = Record::read(&from) {
                        fs::create_dir_all(&to).map_err(at(&to))?;
                        copy((record, &from), &to)?;
                    }
                }
            }
            record.write(new)
        })?;
        Ok(Stages { folder, record })
    }

    /// Go on with the result in `from`, one of [`folder::resumable`].
    pub fn resume(folder: &Path, from: &Path, resumed: Resumed) -> Result<Stages> {
        let mut folder = Folder::open(folder)?;
        let place = folder.partial();
        if from != place {
            // It stays as it is until the new one is complete.
            let from = Record::read(from).map(|record| (record, from)).ok_or_else(|| no_record(from))?;
            folder.begin(|_, new| copy(from, new))?;
        }
        let mut record = Record::read(&place).ok_or_else(|| no_record(&place))?;
        record.resumed.push(resumed);
        (record.end, record.ended, record.complete) = (None, None, false);
        record.write(&place)?;
        Ok(Stages { folder, record })
    }

    /// Where it is written.
    pub fn place(&self) -> PathBuf {
        self.folder.partial()
    }

    /// The folder of the run, from the root.
    pub fn root(&self) -> &Path {
        self.folder.root()
    }

    pub fn record(&self) -> &Record {
        &self.record
    }

    /// What a user should know of the folder.
    pub fn notices(&self) -> &[String] {
        &self.folder.notices
    }

    /// The file with the scene as it is run.
    pub fn scene(&self) -> PathBuf {
        self.place().join(self.record.scene_as_run.as_deref().unwrap_or_default())
    }

    /// The folder of a stage.
    pub fn of(&self, stage: &str) -> PathBuf {
        self.place().join(STAGES).join(stage)
    }

    /// Make the folder of a stage that begins; what was killed there before it had a checkpoint is gone.
    pub fn begin(&self, stage: &str) -> Result<()> {
        let folder = self.of(stage);
        if is_folder(&folder) {
            fs::remove_dir_all(&folder).map_err(at(&folder))?;
        }
        fs::create_dir_all(&folder).map_err(at(&folder))
    }

    /// All of the result of a stage is there: its lock has served.
    pub fn end(&self, stage: &str) {
        let _ = fs::remove_dir_all(self.of(stage).join(folder::OWN));
    }

    /// That of the last stage that has one, and how all of them ended.
    pub fn summary(&self) -> Value {
        let (mut last, mut stages, mut doubts) = (json!({}), Vec::new(), Vec::new());
        for StageOf { name, outdated } in &self.record.stages {
            let text = fs::read(self.of(name).join(SUMMARY)).unwrap_or_default();
            let summary: Value = serde_json::from_slice(&text).unwrap_or(Value::Null);
            let mut of = Map::from_iter([("name".to_owned(), name.clone().into())]);
            of.extend(OF_STAGE.iter().map(|key| ((*key).to_owned(), summary[key].clone())));
            of.insert("outdated".to_owned(), (*outdated).into());
            stages.push(Value::Object(of));
            doubts.extend(
                summary["doubts"]
                    .as_array()
                    .into_iter()
                    .flatten()
                    .filter_map(Value::as_str)
                    .map(|doubt| format!("stage {name}: {doubt}")),
            );
            if *outdated {
                doubts.push(format!(
                    "stage {name}: began with a state that was there before another stage was run again"
                ));
            }
            if summary.is_object() {
                last = summary;
                last["stage"] = name.clone().into();
            }
        }
        (last["doubts"], last["stages"]) = (doubts.into(), stages.into());
        last
    }

    /// The last word: how the run ended, and whether it came to its end. Returns the folder where the result is now.
    pub fn close(mut self, ended: &str, complete: bool, stays: bool) -> Result<PathBuf> {
        let (place, summary) = (self.place(), self.summary());
        write(&place.join(SUMMARY), |file| {
            serde_json::to_writer_pretty(&mut *file, &summary)?;
            writeln!(file)
        })?;
        let record = &mut self.record;
        (record.end, record.ended, record.complete) = (Some(record::now()), Some(ended.to_owned()), complete);
        record.list(&place)?;
        record.write(&place)?;
        // A stage that did not come to its end goes on where it is.
        let is_partial = |stage: &StageOf| is_folder(&self.of(&stage.name).join(folder::PARTIAL));
        let unfinished = self.record.stages.iter().any(is_partial);
        if stays || unfinished || !(complete || self.folder.older().is_none()) {
            return Ok(place);
        }
        self.folder.take_place()?;
        Ok(self.folder.path)
    }
}
