//! The folder of a result: who writes to it, what in it is packstone's, and how a new result takes the place of an older
//! one.
//!
//! ```text
//! DIR/             the result, if it has a run.json, which lists its files; everything else is the user's
//! DIR/partial/     the result that is being written, or whose run did not end; partial.1, ... are those before it
//! DIR/.packstone/  lock; `new` while a partial result is begun; `older` while a result takes another's place
//! ```
//!
//! Files change places by renaming. First those of the older result go to `older`, its record last; then those of the
//! partial one go to DIR, its record last; then `older` is removed. So one of the two is whole in one folder at any time,
//! and where the records are says how far it went: whoever comes next finishes it.

use super::{
    files::{at, is_file},
    names::{FRAMES, RUN, STAGES, SUMMARY, is_of_frames, is_of_series, is_reserved},
    record::{Record, folders_of, is_folder, relative},
};
use crate::error::{Error, Result};
use serde_json::Value;
use std::{
    collections::BTreeSet,
    fs::{self, File, OpenOptions, TryLockError},
    io::{ErrorKind, Write},
    path::{Path, PathBuf},
    time::Duration,
};

pub(super) const PARTIAL: &str = "partial";
/// What is packstone's own while it writes.
pub(super) const OWN: &str = ".packstone";
const LOCK: &str = ".packstone/lock";
const NEW: &str = ".packstone/new";
const OLDER: &str = ".packstone/older";

/// A folder that is ours to write to while this lives.
pub struct Folder {
    pub path: PathBuf,
    /// The same from the root of the file system.
    root: PathBuf,
    _lock: File,
    /// The result that is there.
    older: Option<Record>,
    /// What a user should know.
    pub notices: Vec<String>,
}

impl Folder {
    /// Whether a run may write there; nothing is written. With a scene file, it is refused the result of another.
    ///
    /// # Errors
    /// [`Error::Folder`] with the reason; [`Error::Io`] here and in all functions below.
    pub fn check(path: &Path, scene: Option<&Path>) -> Result<()> {
        match fs::metadata(path) {
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(()),
            Err(error) => return Err(at(path)(error)),
            Ok(found) if !found.is_dir() => return Err(Error::Folder(format!("{}: is no folder", path.display()))),
            Ok(_) => {}
        }
        if let Ok(lock) = File::open(path.join(LOCK)) {
            take(&lock, path, File::try_lock_shared)?;
        }
        if is_folder(&path.join(OLDER)) {
            return Ok(());
        }
        let here = survey(path)?;
        let there = Record::read(&path.join(PARTIAL));
        let another = |record: &Record| {
            let scene = scene_from(path, scene?)?;
            record.scene.clone().filter(|recorded| *recorded != scene)
        };
        match here.iter().chain(&there).find_map(another) {
            Some(other) => {
                let other = path.join(other);
                let other = other.canonicalize().unwrap_or(other);
                let (path, other) = (path.display(), other.display());
                Err(Error::Folder(format!(
                    "{path}: has the result of another scene file, {other}; name a folder with --out (--out {path} to replace that result)"
                )))
            }
            None => Ok(()),
        }
    }

    /// Make it, lock it, and finish what was cut off there.
    ///
    /// # Errors
    /// As [`Folder::check`].
    pub fn open(path: &Path) -> Result<Folder> {
        fs::create_dir_all(path).map_err(at(path))?;
        let mut notices = Vec::new();
        let lock = lock(path, &mut notices)?;
        if is_folder(&path.join(OLDER)) {
            exchange(path, &mut || Ok(()))?;
        }
        let older = survey(path)?;
        let root = path.canonicalize().map_err(at(path))?;
        Ok(Folder { path: path.to_owned(), root, _lock: lock, older, notices })
    }

    /// The result that is there, whole or interrupted.
    pub fn older(&self) -> Option<&Record> {
        self.older.as_ref()
    }

    /// An error if files in the way of the results of these stages are not packstone's.
    pub fn check_stages(&self, stages: &[String]) -> Result<()> {
        let ours: BTreeSet<&String> = self.older.iter().flat_map(|older| older.files_in(&self.path)).collect();
        for stage in stages {
            let inside = format!("{STAGES}/{stage}/");
            check_names(&self.path, &inside, is_reserved, &ours)?;
            check_names(&self.path, &format!("{inside}{FRAMES}/"), is_of_frames, &ours)?;
        }
        Ok(())
    }

    /// From the root of the file system; it may be gone.
    pub fn root(&self) -> &Path {
        &self.root
    }

    /// Where the new result is written.
    pub fn partial(&self) -> PathBuf {
        partial(&self.path)
    }

    /// Begin a partial result with what `fill` writes to a folder. One that is there is kept under another name.
    pub fn begin(&mut self, fill: impl FnOnce(&Folder, &Path) -> Result<()>) -> Result<()> {
        let (new, partial) = (self.path.join(NEW), self.partial());
        if is_folder(&new) {
            // A run that was killed when it began left copies there.
            fs::remove_dir_all(&new).map_err(at(&new))?;
        }
        fs::create_dir(&new).map_err(at(&new))?;
        if let Err(error) = fill(self, &new) {
            let _ = fs::remove_dir_all(&new);
            return Err(error);
        }
        if is_folder(&partial) {
            let aside = unused(&self.path, PARTIAL);
            fs::rename(&partial, &aside).map_err(at(&partial))?;
            let (partial, aside) = (partial.display(), aside.display());
            self.notices.push(format!("{partial}, the partial result of an earlier run, is now {aside}; packstone run --resume {aside} goes on with it"));
        }
        fs::rename(&new, &partial).map_err(at(&partial))
    }

    /// Put the partial result, whose record is complete, in the place of the older one.
    pub fn take_place(&self) -> Result<()> {
        let partial = self.partial();
        let ours: BTreeSet<&String> = self.older.iter().flat_map(|older| older.files_in(&self.path)).collect();
        let Some(new) = Record::read(&partial) else {
            return Err(at(&partial.join(RUN))(ErrorKind::NotFound.into()));
        };
        let in_the_way = |name: &&String| !ours.contains(*name) && fs::symlink_metadata(self.path.join(name)).is_ok();
        if let Some(name) = new.files.keys().find(in_the_way) {
            return Err(foreign(&self.path.join(name)));
        }
        if let Some(older) = self.older.as_ref().filter(|_| !is_file(&self.path.join(RUN)).unwrap_or(false)) {
            // That of version 0.1 had none.
            older.write(&self.path)?;
        }
        // The older one goes when the new one would outlive a power cut. Of snapshots and frames there may be too many.
        let few = |name: &&String| !is_of_series(name);
        for path in new.files.keys().filter(few).map(|name| partial.join(name)) {
            match File::open(&path).and_then(|file| file.sync_all()) {
                // Some systems do so only for files that are open for writing.
                Err(error) if error.kind() != ErrorKind::PermissionDenied => return Err(at(&path)(error)),
                _ => {}
            }
        }
        let older = self.path.join(OLDER);
        fs::create_dir(&older).map_err(at(&older))?;
        exchange(&self.path, &mut || Ok(()))
    }
}

/// The folders with a result of which a run could be continued, the latest first.
///
/// # Errors
/// [`Error::Folder`] if there is none.
pub fn resumable(path: &Path) -> Result<Vec<PathBuf>> {
    finish_exchange(path)?;
    let folders = [path.join(PARTIAL), path.to_owned()].into_iter();
    let found: Vec<_> = folders.filter(|folder| Record::read(folder).is_some()).collect();
    let shown = path.display();
    match () {
        () if !found.is_empty() => Ok(found),
        () if !path.exists() => Err(Error::Folder(format!("{shown}: there is no such folder"))),
        () if !path.is_dir() => Err(Error::Folder(format!("{shown}: is a file; name the folder of a result"))),
        () => Err(Error::Folder(format!("{shown}: has no result of a run, as it has no {RUN}"))),
    }
}

/// The folder with the last result of a run in stages, given that of the run; None where there are no stages.
pub fn last_stage(path: &Path) -> Option<PathBuf> {
    let Record { stages, .. } = Record::read(path)?;
    let folders = stages.iter().rev().map(|stage| path.join(STAGES).join(&stage.name));
    folders.into_iter().find(|folder| Record::read(folder).is_some())
}

/// Where a result is while it is written, given its folder.
pub fn partial(path: &Path) -> PathBuf {
    path.join(PARTIAL)
}

/// Whether a stage of the run in a folder has come to its end.
pub fn has_stage(path: &Path, stage: &str) -> bool {
    Record::read(&path.join(STAGES).join(stage)).is_some_and(|record| record.complete)
}

/// Finish what a run has begun that was killed while its result took the place of another, unless it is still at it.
fn finish_exchange(path: &Path) -> Result<()> {
    if is_folder(&path.join(OLDER))
        && let Ok(_lock) = lock(path, &mut Vec::new())
    {
        exchange(path, &mut || Ok(()))?;
    }
    Ok(())
}

/// If a folder is a part of another run's result, partial or of a stage: the lock of that one, to hold while this one is
/// written to.
///
/// # Errors
/// [`Error::Folder`] if that run lives; [`Error::Io`] if its lock cannot be opened.
pub fn lock_around(path: &Path) -> Result<Vec<File>> {
    // It may not be there yet.
    let from_root = |there: &Path| Some(there.canonicalize().ok()?.join(path.strip_prefix(there).ok()?));
    let Some(root) = path.ancestors().find_map(from_root) else { return Ok(Vec::new()) };
    let around = |outer: &&Path| {
        let inside = root.strip_prefix(outer).ok().and_then(|inside| inside.iter().next());
        inside.is_some_and(|part| [PARTIAL, STAGES].iter().any(|name| part == *name)) && outer.join(LOCK).is_file()
    };
    root.ancestors().skip(1).filter(around).map(|outer| lock(outer, &mut Vec::new())).collect()
}

/// The folder that has the result of a run, given that of the run; with a notice if it is but a partial one.
///
/// # Errors
/// [`Error::Io`] if a result that had begun to take another's place cannot do so now.
pub fn find(path: &Path) -> Result<(PathBuf, Option<String>)> {
    finish_exchange(path)?;
    let partial = path.join(PARTIAL);
    let within = |folder: PathBuf| last_stage(&folder).unwrap_or(folder);
    let partial_only = !path.join(RUN).exists() && !path.join(SUMMARY).exists() && Record::read(&partial).is_some();
    Ok(match partial_only {
        true => {
            let notice = format!("{} has the partial result of a run that did not come to its end", partial.display());
            (within(partial), Some(notice))
        }
        false => (within(path.to_owned()), None),
    })
}

/// The scene file as seen from the folder; None for what is no file, such as a pipe.
pub fn scene_from(folder: &Path, scene: &Path) -> Option<String> {
    let (folder, scene) = (folder.canonicalize().ok()?, scene.canonicalize().ok()?);
    scene.is_file().then(|| relative(&folder, &scene).to_string_lossy().into_owned())
}

/// The first of NAME.1, NAME.2, ... that is not there.
pub(super) fn unused(folder: &Path, name: &str) -> PathBuf {
    let numbered = (1..).map(|k| folder.join(format!("{name}.{k}")));
    numbered.into_iter().find(|path| fs::symlink_metadata(path).is_err()).expect("there is no end of numbers")
}

fn foreign(path: &Path) -> Error {
    Error::Folder(format!(
        "{}: was not written by packstone, or was changed since, and the run needs the name; move it away, or name another folder with --out",
        path.display()
    ))
}

/// The result in a folder, if nothing there is in the way of a new one.
fn survey(path: &Path) -> Result<Option<Record>> {
    let record = Record::read(path).or_else(|| of_version_0_1(path));
    let ours: BTreeSet<&String> = record.iter().flat_map(|record| record.files_in(path)).collect();
    check_names(path, "", |name| is_reserved(name) && !(name == RUN && record.is_some()), &ours)?;
    check_names(path, &format!("{FRAMES}/"), is_of_frames, &ours)?;
    let partial = path.join(PARTIAL);
    if fs::symlink_metadata(&partial).is_ok() && !(is_folder(&partial) && Record::read(&partial).is_some()) {
        return Err(foreign(&partial));
    }
    Ok(record)
}

/// An error if a file in a part of a folder has a name that a run needs and is not one of ours.
fn check_names(path: &Path, part: &str, needed: impl Fn(&str) -> bool, ours: &BTreeSet<&String>) -> Result<()> {
    let inside = path.join(part);
    if !inside.is_dir() {
        return Ok(());
    }
    for entry in fs::read_dir(&inside).map_err(at(&inside))? {
        let name = entry.map_err(at(&inside))?.file_name();
        let Some(name) = name.to_str().filter(|name| needed(name)) else { continue };
        if !ours.contains(&format!("{part}{name}")) {
            return Err(foreign(&inside.join(name)));
        }
    }
    Ok(())
}

/// Version 0.1 wrote no record; its summary is known by its keys.
fn of_version_0_1(path: &Path) -> Option<Record> {
    let summary = path.join(SUMMARY);
    let text = is_file(&summary).ok()?.then(|| fs::read_to_string(summary).ok())??;
    let summary: Value = serde_json::from_str(&text).ok()?;
    let keys = ["particles", "dt_bound", "replayed_chunks", "lost_contacts", "stopped"];
    let version = summary.get("version")?.as_str().filter(|_| keys.iter().all(|key| summary.get(key).is_some()))?;
    let mut record =
        Record { packstone: version.to_owned(), complete: summary["stopped"].is_null(), ..Record::default() };
    record.list(path).ok()?;
    record.files.retain(|name, _| is_reserved(name));
    Some(record)
}

/// Lock a folder for this process. The system takes the lock away with the process, however that ends.
fn lock(path: &Path, notices: &mut Vec<String>) -> Result<File> {
    let file = path.join(LOCK);
    let own = file.parent().expect("the lock is in a folder");
    match fs::create_dir(own) {
        Err(error) if error.kind() == ErrorKind::AlreadyExists && is_folder(own) => {}
        made => made.map_err(at(own))?,
    }
    is_file(&file).map_err(at(&file))?;
    let mut lock =
        OpenOptions::new().read(true).write(true).create(true).truncate(false).open(&file).map_err(at(&file))?;
    if let Some(notice) = take(&lock, path, File::try_lock)? {
        notices.push(notice);
    }
    let pid = std::process::id().to_string();
    lock.set_len(0).and_then(|()| lock.write_all(pid.as_bytes())).map_err(at(&file))?;
    Ok(lock)
}

/// Take a lock, or say who has it; a notice if the file system has no locks.
fn take(
    file: &File,
    path: &Path,
    lock: impl Fn(&File) -> std::result::Result<(), TryLockError>,
) -> Result<Option<String>> {
    // Whoever only looks whether there is a lock has it for an instant.
    let tried = lock(file).or_else(|_| {
        std::thread::sleep(Duration::from_millis(50));
        lock(file)
    });
    match tried {
        Ok(()) => Ok(None),
        Err(TryLockError::WouldBlock) => {
            let pid = fs::read_to_string(path.join(LOCK)).unwrap_or_default();
            let who = if pid.is_empty() { "another process".to_owned() } else { format!("process {pid}") };
            Err(Error::Folder(format!(
                "{}: {who} is writing its results there; wait for its end, or name another folder with --out",
                path.display()
            )))
        }
        Err(TryLockError::Error(error)) => Ok(Some(format!(
            "{}: its file system has no locks ({error}), so do not start a second run there",
            path.display()
        ))),
    }
}

/// Put the result in `partial` in the place of the one in the folder, from wherever it was left. Before each change,
/// `go_on` can stop it.
fn exchange(path: &Path, go_on: &mut dyn FnMut() -> Result<()>) -> Result<()> {
    let (partial, older) = (path.join(PARTIAL), path.join(OLDER));
    if let Some(new) = Record::read(&partial) {
        if let Some(record) = Record::read(path) {
            record.files_in(path).try_for_each(|name| shift(path, &older, name, go_on))?;
            shift(path, &older, RUN, go_on)?;
        }
        new.files_in(&partial).try_for_each(|name| shift(&partial, path, name, go_on))?;
        shift(&partial, path, RUN, go_on)?;
    }
    // The lock of whoever has gone on with it there.
    let _ = fs::remove_dir_all(partial.join(OWN));
    remove_empty(&partial);
    if is_folder(&partial) {
        // What is left is in nobody's list, and must not be taken for a result.
        fs::rename(&partial, unused(path, PARTIAL)).map_err(at(&partial))?;
    }
    if let Some(record) = Record::read(&older) {
        for name in record.files_in(&older) {
            go_on()?;
            fs::remove_file(older.join(name)).map_err(at(&older))?;
        }
        // A folder that is empty now had nothing but the older result's.
        for inside in record.files.keys().flat_map(|name| folders_of(Path::new(name))) {
            let _ = fs::remove_dir(path.join(inside));
        }
        go_on()?;
        fs::remove_file(older.join(RUN)).map_err(at(&older))?;
    }
    remove_empty(&older);
    Ok(())
}

/// Move a file to another folder, where nothing has its name.
fn shift(from: &Path, to: &Path, name: &str, go_on: &mut dyn FnMut() -> Result<()>) -> Result<()> {
    go_on()?;
    let (source, target) = (from.join(name), to.join(name));
    // Links are not followed.
    for part in folders_of(Path::new(name)).collect::<Vec<_>>().into_iter().rev().map(|part| to.join(part)) {
        if !is_folder(&part) {
            fs::create_dir(&part).map_err(at(&part))?;
        }
    }
    if fs::symlink_metadata(&target).is_ok() {
        return Err(foreign(&target));
    }
    fs::rename(&source, &target).map_err(at(&target))
}

/// Remove a folder that has at most empty ones in it; what somebody else has put there stays.
fn remove_empty(folder: &Path) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten().filter(|entry| is_folder(&entry.path())) {
        remove_empty(&entry.path());
    }
    let _ = fs::remove_dir(folder);
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    /// Files with their content, of a folder and what is in it.
    fn content(folder: &Path) -> BTreeMap<String, String> {
        let mut found = BTreeMap::new();
        for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
            let name = entry.file_name().into_string().unwrap();
            match entry.file_type().unwrap().is_dir() {
                true => found.extend(content(&entry.path()).into_iter().map(|(k, v)| (format!("{name}/{k}"), v))),
                false => drop(found.insert(name, fs::read_to_string(entry.path()).unwrap())),
            }
        }
        found
    }

    /// A result of these files, whose content tells it from others.
    fn result(folder: &Path, mark: &str, names: &[&str]) -> BTreeMap<String, String> {
        fs::create_dir_all(folder.join("inputs")).unwrap();
        for name in names {
            fs::write(folder.join(name), format!("{mark} {name}")).unwrap();
        }
        let mut record = Record { packstone: mark.to_owned(), ..Record::default() };
        record.list(folder).unwrap();
        record.write(folder).unwrap();
        content(folder)
    }

    const OLD_NAMES: [&str; 5] = ["final.csv", "summary.json", "snapshot_000003.vtp", "inputs/bed.csv", "scene.toml"];
    const NEW_NAMES: [&str; 5] = ["final.csv", "summary.json", "snapshot_000000.vtp", "inputs/bed.csv", "inputs/a.stl"];

    /// Whenever it is cut off, one of the two results is whole in one folder, and whoever comes next has the new one.
    #[test]
    fn an_exchange_may_be_cut_off_at_any_change() {
        for cut in 0.. {
            let temporary = tempfile::tempdir().unwrap();
            let path = temporary.path();
            fs::create_dir_all(path.join(OLDER)).unwrap();
            let older = result(path, "1", &OLD_NAMES);
            let new = result(&path.join(PARTIAL), "2", &NEW_NAMES);
            fs::write(path.join("notes.txt"), "mine").unwrap();
            let mut left = cut;
            let ended = exchange(path, &mut || {
                left -= 1;
                if left < 0 { Err(Error::Folder("killed".to_owned())) } else { Ok(()) }
            });
            let has = |folder: &str, result: &BTreeMap<String, String>| {
                let found = content(&path.join(folder));
                result.iter().all(|(name, text)| found.get(name) == Some(text))
            };
            assert!(
                has("", &older) || has(OLDER, &older) || has(PARTIAL, &new) || has("", &new),
                "after {cut} changes: {:?}",
                content(path)
            );
            let (found, notice) = find(path).unwrap();
            assert_eq!((found.as_path(), notice), (path, None));
            let mut all = content(path);
            all.remove(LOCK);
            assert_eq!(all.remove("notes.txt").as_deref(), Some("mine"));
            assert_eq!(all, new, "after {cut} changes");
            assert!(!path.join(PARTIAL).exists() && !path.join(OLDER).exists());
            if ended.is_ok() {
                assert_eq!(cut, 18, "5 + 1 files went, 5 + 1 came, 5 + 1 were removed");
                break;
            }
        }
    }

    /// What the user has put there, or changed, while the run lasted.
    #[test]
    fn what_is_in_the_way_stays() {
        let temporary = tempfile::tempdir().unwrap();
        let path = temporary.path();
        result(path, "1", &OLD_NAMES);
        let mut folder = Folder::open(path).unwrap();
        folder
            .begin(|_, new| {
                result(new, "2", &NEW_NAMES);
                Ok(())
            })
            .unwrap();
        fs::write(path.join("final.csv"), "mine").unwrap();
        let before = content(path);
        let refused = folder.take_place().unwrap_err().to_string();
        assert!(refused.contains("final.csv: was not written by packstone, or was changed since"), "{refused}");
        assert_eq!(content(path), before);
        fs::remove_file(path.join("final.csv")).unwrap();
        folder.take_place().unwrap();
        assert_eq!(Record::read(path).unwrap().packstone, "2");
    }

    #[test]
    fn a_folder_has_one_writer() {
        let temporary = tempfile::tempdir().unwrap();
        let path = temporary.path();
        let folder = Folder::open(path).unwrap();
        let pid = format!("process {}", std::process::id());
        for refused in [Folder::check(path, None).err(), Folder::open(path).err()] {
            assert!(refused.unwrap().to_string().contains(&pid));
        }
        drop(folder);
        Folder::check(path, None).unwrap();
        Folder::open(path).unwrap();
    }
}
