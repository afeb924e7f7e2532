//! Results on disk, described in `docs/output.md`. A file is written under another name and renamed when it is
//! complete, so that nothing half-written ever carries the name of a result.

pub mod contacts;
pub mod csv;
mod dump;
pub mod export;
mod files;
pub mod folder;
mod inputs;
mod instant;
pub mod measures;
pub mod names;
mod npz;
pub mod problem;
pub mod record;
mod rows;
pub mod schedule;
mod stages;
pub mod summary;
pub mod vtp;
mod xyz;

use crate::{
    error::{Error, Result},
    measure::{Packing, Sample, micromechanics::packing::LoadOnWall},
    protocol::jamming::RelaxedState,
    scene::{
        Assembly, Material, Output, Scene, Shape,
        grain_file::{self, Moment, Names},
    },
    simulation::Outflow,
};
pub use export::Export;
use export::Kind;
pub(crate) use files::at;
pub use files::{replace, write};
pub use folder::Folder;
use instant::Instant;
pub use measures::MeasureFiles;
use names::{
    CHECKPOINT, FINAL, FINAL_BIN, HISTORY, JAMMING, MEMBERS, PREVIOUS, SERIES, SUMMARY, snapshot, snapshot_number,
};
pub use record::{Kept, Machine, Record, Resumed, Written, cpu_name};
pub use rows::read_rows;
pub use stages::{Kept as KeptStages, Stages};
use std::{
    collections::BTreeSet,
    fs,
    io::{self, Write},
    path::{Path, PathBuf},
};
use summary::Summary;

/// The result of a run while it is written.
pub struct Results {
    folder: Folder,
    /// The folder beside which it goes on where nothing can be written there any more, from the root.
    beside: PathBuf,
    /// Where it is written: the partial result of the folder, or, if that cannot be written, somewhere else.
    place: PathBuf,
    /// How many such places have been tried.
    moved: usize,
    record: Record,
    /// The files with the scene, by their names.
    scene: Vec<(String, String)>,
    output: Output,
    dimension: usize,
    materials: Vec<Material>,
    shapes: Vec<Shape>,
    history: csv::History,
    /// Steps of the snapshots so far, and their times, s.
    snapshots: Vec<(u64, f64)>,
    /// Of those for ParaView, from the first on.
    series: Option<vtp::Series>,
}

impl Results {
    /// Begin a result in a folder, beside the one that is there. `file` is that of the scene, if it has one.
    ///
    /// # Errors
    /// As [`Folder::check`]; [`Error::Io`] here and in all functions below.
    pub fn create(
        folder: &Path,
        file: Option<&Path>,
        scene: &Scene,
        assembly: &Assembly,
        mut record: Record,
    ) -> Result<Results> {
        let mut folder = Folder::open(folder)?;
        record.scene = file.and_then(|file| folder::scene_from(&folder.path, file));
        folder.begin(|folder, new| {
            inputs::keep(scene, &mut record, &folder.path, folder.older(), new)?;
            record.write(new)
        })?;
        let history = csv::History::create(&folder.partial().join(HISTORY), &assembly.walls)?;
        Ok(Results::new(folder, assembly, record, history, Vec::new()))
    }

    /// Go on with the result in `from`, one of [`folder::resumable`]: with the rows of the history of these steps, and with
    /// these snapshots (steps, and times in s). Other rows and later snapshots are removed.
    pub fn resume(
        folder: &Path,
        from: &Path,
        assembly: &Assembly,
        resumed: Resumed,
        rows: BTreeSet<u64>,
        snapshots: Vec<(u64, f64)>,
    ) -> Result<Results> {
        let mut folder = Folder::open(folder)?;
        let place = folder.partial();
        if from != place {
            // It stays as it is until the new one is complete.
            let from = Record::read(from).map(|record| (record, from)).ok_or_else(|| no_record(from))?;
            folder.begin(|_, new| {
                copy(from, new)?;
                csv::History::resume(&new.join(HISTORY), &assembly.walls, &rows).map(drop)
            })?;
        }
        let mut record = Record::read(&place).ok_or_else(|| no_record(&place))?;
        let (history, missing) = csv::History::resume(&place.join(HISTORY), &assembly.walls, &rows)?;
        if missing > 0 {
            let (path, of) = (place.join(HISTORY), rows.len());
            let path = path.display();
            folder.notices.push(format!("{path}: {missing} of {of} rows are gone; it goes on without them"));
        }
        for name in record::names(&place)? {
            let later = snapshot_number(&name).is_some_and(|number| number >= snapshots.len());
            if later || name == SERIES {
                fs::remove_file(place.join(&name)).map_err(at(&place))?;
            }
        }
        record.resumed.push(resumed);
        (record.end, record.ended, record.complete) = (None, None, false);
        record.write(&place)?;
        let mut results = Results::new(folder, assembly, record, history, snapshots);
        if results.output.vtp && !results.snapshots.is_empty() {
            results.series = Some(vtp::Series::create(&place.join(SERIES), &results.listed())?);
        }
        Ok(results)
    }

    fn new(
        folder: Folder,
        assembly: &Assembly,
        record: Record,
        history: csv::History,
        snapshots: Vec<(u64, f64)>,
    ) -> Results {
        Results {
            place: folder.partial(),
            moved: 0,
            scene: scene_texts(&folder.partial(), &record),
            beside: folder.root().to_owned(),
            folder,
            record,
            output: assembly.output,
            dimension: assembly.dimension,
            materials: assembly.materials.clone(),
            shapes: assembly.shapes.clone(),
            history,
            snapshots,
            series: None,
        }
    }

    /// Where it is written now.
    pub fn place(&self) -> &Path {
        &self.place
    }

    /// Where nothing can be written any more, go on beside this folder.
    pub fn rescue_beside(&mut self, folder: &Path) {
        self.beside = folder.to_owned();
    }

    /// What a user should know of the folder.
    pub fn notices(&self) -> &[String] {
        &self.folder.notices
    }

    /// Steps and times, s, of the snapshots so far.
    pub fn snapshots(&self) -> &[(u64, f64)] {
        &self.snapshots
    }

    /// A row of the history; `rate` is in particle-steps/s since the row before, `loads` are those on walls, `outflows` what has left
    /// by outlets.
    pub fn history(&mut self, sample: &Sample, rate: f64, loads: &[LoadOnWall], outflows: &[Outflow]) -> Result<()> {
        self.history.row(sample, rate, loads, outflows)
    }

    /// The states of a search for the jamming fraction so far.
    pub fn jamming(&self, states: &[RelaxedState]) -> Result<()> {
        write(&self.place.join(JAMMING), |file| {
            let mut writer = ::csv::Writer::from_writer(file);
            states.iter().try_for_each(|state| writer.serialize(state)).map_err(io::Error::from)?;
            writer.flush()
        })
    }

    /// Whether files are wanted that contacts are in.
    pub fn wants_contacts(&self) -> bool {
        Kind::wanted(&self.output).next().is_some()
    }

    /// A snapshot, in the formats that the scene wants of those that have them; `packing` if these have contacts.
    pub fn snapshot(&mut self, moment: &Moment, packing: Option<&Packing>) -> Result<()> {
        let number = self.snapshots.len();
        if let Some(packing) = packing {
            self.write_exports(Some(number), moment, packing)?;
        }
        if self.output.vtp {
            self.write_vtp(&snapshot(number, "vtp"), moment)?;
        }
        if self.output.bin {
            self.write_bin(&snapshot(number, "bin"), moment)?;
        }
        self.snapshots.push((moment.step, moment.time));
        match &mut self.series {
            _ if !self.output.vtp => {}
            Some(series) => series.add(moment.time, &snapshot(number, "vtp"))?,
            None => self.series = Some(vtp::Series::create(&self.place.join(SERIES), &self.listed())?),
        }
        Ok(())
    }

    /// The snapshots for ParaView that are there, with their times, s.
    fn listed(&self) -> Vec<(f64, String)> {
        let file = |(number, (_, time)): (usize, &(u64, f64))| (*time, snapshot(number, "vtp"));
        let all = self.snapshots.iter().enumerate().map(file);
        all.filter(|(_, name)| self.place.join(name).exists()).collect()
    }

    /// A checkpoint; the one before it is kept. `write` writes it to a file, which is on the disk when it returns.
    pub fn checkpoint(&mut self, write: impl FnOnce(&Path) -> Result<()>) -> Result<()> {
        let (path, previous) = (self.place.join(CHECKPOINT), self.place.join(PREVIOUS));
        // The rows that it counts on are on the disk before it is.
        self.history.sync()?;
        replace(&path, |part| {
            write(part)?;
            if path.exists() { fs::rename(&path, &previous).map_err(at(&path)) } else { Ok(()) }
        })?;
        sync_folder(&self.place);
        Ok(())
    }

    /// What is written once, of the last state. With clumps `final.csv` has them, and `members.csv` their members.
    /// What can be written is, whatever cannot.
    pub fn finish(&mut self, summary: &Summary, moment: &Moment, packing: Option<&Packing>) -> Result<()> {
        let mut result = Ok(());
        let mut also = |written: Result<()>| result = std::mem::replace(&mut result, Ok(())).and(written);
        if let Some(packing) = packing {
            also(self.write_exports(None, moment, packing));
        }
        let Moment { grains, clumps, numbers, .. } = *moment;
        if self.output.bin {
            also(self.write_bin(FINAL_BIN, moment));
        }
        if self.output.csv {
            let grains_file = if clumps.is_empty() { FINAL } else { MEMBERS };
            let path = self.place.join(grains_file);
            also(write(&path, |file| csv::grains(file, grains, &self.materials, numbers)));
        }
        if self.output.csv && !clumps.is_empty() {
            let path = self.place.join(FINAL);
            also(write(&path, |file| csv::clumps(file, clumps, &self.shapes, &self.materials, numbers)));
        }
        also(write(&self.place.join(SUMMARY), |file| {
            serde_json::to_writer_pretty(&mut *file, summary)?;
            writeln!(file)
        }));
        if self.output.vtp {
            if self.snapshots.last().is_none_or(|(step, _)| *step != moment.step) {
                also(self.write_vtp(&snapshot(self.snapshots.len(), "vtp"), moment));
                self.snapshots.push((moment.step, moment.time));
            }
            self.series = None;
            also(write(&self.place.join(SERIES), |file| vtp::write_series(file, &self.listed())));
        }
        result
    }

    /// Go on in another folder, beside that of the result or among temporary files, if this one cannot be written. The
    /// history goes on there; what was written before stays where it is.
    ///
    /// # Errors
    /// The last one, when no place is left.
    pub fn elsewhere(&mut self) -> Result<()> {
        let root = &self.beside;
        let name = root.file_name().map_or("packstone".into(), |name| name.to_string_lossy());
        let beside = root.parent().map(Path::to_owned);
        let bases: Vec<PathBuf> = beside.into_iter().chain([std::env::temp_dir()]).collect();
        let mut result = Err(at(&self.place)(io::ErrorKind::NotFound.into()));
        while let Some(base) = bases.get(self.moved) {
            self.moved += 1;
            if self.place != self.folder.partial() {
                // Nothing is there that is not written once more.
                let _ = fs::remove_dir_all(&self.place);
            }
            self.place = folder::unused(base, &format!("{name}.rescued"));
            let made = fs::create_dir_all(&self.place).map_err(at(&self.place));
            result = made.and_then(|()| self.history.go_on_in(&self.place.join(HISTORY)));
            result = result.and_then(|()| self.keep_scene());
            if result.is_ok() {
                break;
            }
        }
        result
    }

    /// What it takes to go on from there: the scene, and of what it reads as much as can still be read.
    fn keep_scene(&self) -> Result<()> {
        for (name, text) in &self.scene {
            write(&self.place.join(name), |file| file.write_all(text.as_bytes()))?;
        }
        for input in self.record.inputs.iter().filter(|input| input.path.starts_with(names::INPUTS)) {
            let (from, to) = (self.folder.partial().join(&input.path), self.place.join(&input.path));
            if from.is_file() {
                let inside = to.parent().expect("it is in a folder");
                fs::create_dir_all(inside).map_err(at(inside))?;
                fs::copy(&from, &to).map_err(at(&to))?;
            }
        }
        Ok(())
    }

    /// The last word: how the run ended, and whether it came to its end. A complete result takes the place of the one
    /// that is there; another does so only where there is none. Returns the folder where it is now.
    pub fn close(mut self, ended: &str, complete: bool) -> Result<PathBuf> {
        drop(self.history);
        for entry in fs::read_dir(&self.place).map_err(at(&self.place))?.flatten() {
            if entry.path().extension().is_some_and(|ending| ending == "part") {
                fs::remove_file(entry.path()).map_err(at(&self.place))?;
            }
        }
        (self.record.end, self.record.ended, self.record.complete) =
            (Some(record::now()), Some(ended.to_owned()), complete);
        let previous = self.place.join(PREVIOUS);
        if complete && previous.exists() {
            // The last one is of the last state, and is whole.
            fs::remove_file(&previous).map_err(at(&previous))?;
        }
        self.record.list(&self.place)?;
        self.record.write(&self.place)?;
        let stays = self.moved > 0 || !(complete || self.folder.older().is_none());
        if stays {
            return Ok(self.place);
        }
        self.folder.take_place()?;
        Ok(self.folder.path)
    }

    /// Those of a snapshot, or of the last state.
    fn write_exports(&self, snapshot: Option<usize>, moment: &Moment, packing: &Packing) -> Result<()> {
        let now = Instant { packing, step: moment.step, time: moment.time };
        Kind::wanted(&self.output)
            .map(|kind| write(&self.place.join(kind.name(snapshot)), |file| kind.put(file, &now)))
            .fold(Ok(()), Result::and)
    }

    fn write_vtp(&self, name: &str, moment: &Moment) -> Result<()> {
        write(&self.place.join(name), |file| vtp::write(file, moment))
    }

    fn write_bin(&self, name: &str, moment: &Moment) -> Result<()> {
        let Results { dimension, materials, shapes, .. } = self;
        let names = Names { dimension: *dimension, materials, shapes };
        write(&self.place.join(name), |file| grain_file::write(file, moment, &names))
    }
}

/// The scene as it was run, and as it was given.
fn scene_texts(folder: &Path, record: &Record) -> Vec<(String, String)> {
    let names = record.scene_as_run.iter().chain(&record.scene_as_given);
    names.filter_map(|name| Some((name.clone(), fs::read_to_string(folder.join(name)).ok()?))).collect()
}

/// That names of files have changed, on the disk. Not every system lets a folder be opened.
fn sync_folder(path: &Path) {
    let _ = fs::File::open(path).and_then(|folder| folder.sync_all());
}

fn no_record(folder: &Path) -> Error {
    Error::Folder(format!("{}: has no result that could be continued", folder.display()))
}

/// The files of a result, by links where the system has them; the history, which is written on, as a file of its own.
fn copy((record, from): (Record, &Path), to: &Path) -> Result<()> {
    for name in record.files_in(from) {
        let (source, target) = (from.join(name), to.join(name));
        let inside = target.parent().expect("it is in a folder");
        fs::create_dir_all(inside).map_err(at(inside))?;
        if name == HISTORY || fs::hard_link(&source, &target).is_err() {
            fs::copy(&source, &target).map_err(at(&target))?;
        }
    }
    record.write(to)
}
