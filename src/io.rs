//! Results on disk, described in `docs/output.md`. A file is written under another name and renamed when it is
//! complete, so that nothing half-written ever carries the name of a result.

pub mod csv;
mod files;
pub mod problem;
pub mod summary;
pub mod vtp;

use crate::{
    container::{Container, is_container},
    error::Result,
    measure::Sample,
    scene::{
        Assembly, Material, Output, Shape,
        grain_file::{self, Moment, Names},
    },
};
use csv::GrainRow;
pub(crate) use files::at;
pub use files::replace;
use files::write;
use std::{
    fs,
    io::Write,
    path::{Path, PathBuf},
};
use summary::Summary;

pub const HISTORY: &str = "history.csv";
pub const FINAL: &str = "final.csv";
pub const FINAL_BIN: &str = "final.bin";
pub const MEMBERS: &str = "members.csv";
pub const SUMMARY: &str = "summary.json";
pub const SERIES: &str = "packstone.pvd";

/// The folder a run writes to.
pub struct Results {
    folder: PathBuf,
    output: Output,
    dimension: usize,
    materials: Vec<Material>,
    shapes: Vec<Shape>,
    /// The clumps of the grains; empty without clumps.
    owners: Vec<u32>,
    history: csv::History,
    /// Steps of the snapshots so far, and their times, s.
    snapshots: Vec<(u64, f64)>,
}

impl Results {
    /// Make the folder. What an earlier run left there is removed, everything else stays.
    ///
    /// # Errors
    /// [`Error::Io`](crate::Error::Io), here and in all functions below.
    pub fn create(folder: &Path, assembly: &Assembly) -> Result<Results> {
        fs::create_dir_all(folder).map_err(at(folder))?;
        for entry in fs::read_dir(folder).map_err(at(folder))? {
            let path = entry.map_err(at(folder))?.path();
            if path.file_name().and_then(|name| name.to_str()).is_some_and(is_ours) {
                fs::remove_file(&path).map_err(at(&path))?;
            }
        }
        let history = csv::History::create(&folder.join(HISTORY))?;
        Ok(Results {
            folder: folder.to_owned(),
            output: assembly.output,
            dimension: assembly.dimension,
            materials: assembly.materials.clone(),
            shapes: assembly.shapes.clone(),
            owners: assembly.owners(),
            history,
            snapshots: Vec::new(),
        })
    }

    /// A row of the history; `rate` is in particle-steps/s since the row before.
    pub fn history(&mut self, sample: &Sample, rate: f64) -> Result<()> {
        self.history.row(sample, rate)
    }

    /// A snapshot, in the formats that the scene wants of those that have them.
    pub fn snapshot(&mut self, moment: &Moment) -> Result<()> {
        let number = self.snapshots.len();
        if self.output.vtp {
            self.write_vtp(&snapshot_name(number, "vtp"), moment)?;
        }
        if self.output.bin {
            self.write_bin(&snapshot_name(number, "bin"), moment)?;
        }
        self.snapshots.push((moment.step, moment.time));
        Ok(())
    }

    /// Everything that is written once, at the end. With clumps `final.csv` has them, and `members.csv` their members.
    /// What can be written is, whatever cannot.
    pub fn finish(mut self, summary: &Summary, moment: &Moment) -> Result<()> {
        let mut result = self.history.finish();
        let mut also = |written: Result<()>| result = std::mem::replace(&mut result, Ok(())).and(written);
        let Moment { grains, clumps, .. } = *moment;
        if self.output.bin {
            also(self.write_bin(FINAL_BIN, moment));
        }
        if self.output.csv {
            let grains_file = if clumps.is_empty() { FINAL } else { MEMBERS };
            also(csv::write_grains(&self.folder.join(grains_file), grains, &self.materials));
        }
        if self.output.csv && !clumps.is_empty() {
            also(csv::write_clumps(&self.folder.join(FINAL), clumps, &self.shapes, &self.materials));
        }
        also(write(&self.folder.join(SUMMARY), |file| {
            serde_json::to_writer_pretty(&mut *file, summary)?;
            writeln!(file)
        }));
        if self.output.vtp {
            if self.snapshots.last().is_none_or(|(step, _)| *step != moment.step) {
                also(self.write_vtp(&snapshot_name(self.snapshots.len(), "vtp"), moment));
                self.snapshots.push((moment.step, moment.time));
            }
            let file = |(number, (_, time)): (usize, &(u64, f64))| (*time, snapshot_name(number, "vtp"));
            let series: Vec<_> = self.snapshots.iter().enumerate().map(file).collect();
            also(write(&self.folder.join(SERIES), |file| vtp::write_series(file, &series)));
        }
        result
    }

    fn write_vtp(&self, name: &str, moment: &Moment) -> Result<()> {
        write(&self.folder.join(name), |file| vtp::write(file, moment.time, moment.grains, &self.owners))
    }

    fn write_bin(&self, name: &str, moment: &Moment) -> Result<()> {
        let Results { dimension, materials, shapes, owners, .. } = self;
        let names = Names { dimension: *dimension, materials, shapes, owners };
        write(&self.folder.join(name), |file| grain_file::write(file, moment, &names))
    }
}

/// Reads the spheres of a table or of a binary file; of clumps in a binary file the members.
///
/// # Errors
/// As [`csv::read_grains`] and [`Container::open`].
pub fn read_rows(path: &Path) -> Result<Vec<GrainRow>> {
    if !is_container(path) {
        return csv::read_grains(path);
    }
    let mut file = Container::<serde_json::Value>::open(path)?;
    let prefix = if file.rows("member_position").is_some() { "member_" } else { "" };
    let mut rows = Vec::new();
    file.read(&format!("{prefix}position"), |k, [x, y, z]| {
        rows.push(GrainRow { id: Some(k as u64), x, y, z, ..GrainRow::default() });
    })?;
    file.read(&format!("{prefix}radius"), |k, [radius]| {
        if let Some(row) = rows.get_mut(k) {
            row.radius = radius;
        }
    })?;
    file.read(&format!("{prefix}velocity"), |k, [x, y, z]| {
        if let Some(row) = rows.get_mut(k) {
            (row.vx, row.vy, row.vz) = (x, y, z);
        }
    })?;
    Ok(rows)
}

fn snapshot_name(number: usize, extension: &str) -> String {
    format!("snapshot_{number:06}.{extension}")
}

/// Whether a run may have written a file of this name.
fn is_ours(name: &str) -> bool {
    let name = name.strip_suffix(".part").unwrap_or(name);
    let of_snapshot = name.strip_suffix(".vtp").or_else(|| name.strip_suffix(".bin"));
    let number = of_snapshot.and_then(|name| name.strip_prefix("snapshot_"));
    [HISTORY, FINAL, MEMBERS, FINAL_BIN, SUMMARY, SERIES].contains(&name)
        || number.is_some_and(|n| n.parse::<u64>().is_ok())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_files_of_a_run_are_ours() {
        assert!(
            ["summary.json", "snapshot_000012.vtp", "snapshot_000012.bin.part", "final.bin", "history.csv.part"]
                .into_iter()
                .all(is_ours)
        );
        assert!(!["picture.png", "snapshot_mine.vtp", "notes.csv", "summary.json.bak"].into_iter().any(is_ours));
    }
}
