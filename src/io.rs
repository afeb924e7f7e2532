//! Results on disk, described in `docs/output.md`. A file is written under another name and renamed when it is
//! complete, so that nothing half-written ever carries the name of a result.

pub mod csv;
mod files;
pub mod problem;
pub mod summary;
pub mod vtp;

use crate::{
    error::Result,
    measure::Sample,
    scene::{Assembly, Clump, Grain, Material, Output, Shape},
};
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
pub const MEMBERS: &str = "members.csv";
pub const SUMMARY: &str = "summary.json";
pub const SERIES: &str = "packstone.pvd";

/// The folder a run writes to.
pub struct Results {
    folder: PathBuf,
    output: Output,
    materials: Vec<Material>,
    shapes: Vec<Shape>,
    /// The clumps of the grains; empty without clumps.
    owners: Vec<u32>,
    history: csv::History,
    /// Snapshots so far: time and file name.
    series: Vec<(f64, String)>,
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
            materials: assembly.materials.clone(),
            shapes: assembly.shapes.clone(),
            owners: assembly.owners(),
            history,
            series: Vec::new(),
        })
    }

    /// A row of the history; `rate` is in particle-steps/s since the row before.
    pub fn history(&mut self, sample: &Sample, rate: f64) -> Result<()> {
        self.history.row(sample, rate)
    }

    /// A snapshot, if the scene wants any.
    pub fn snapshot(&mut self, time: f64, grains: &[Grain]) -> Result<()> {
        if self.output.vtp {
            let name = format!("snapshot_{:06}.vtp", self.series.len());
            write(&self.folder.join(&name), |file| vtp::write(file, time, grains, &self.owners))?;
            self.series.push((time, name));
        }
        Ok(())
    }

    /// Everything that is written once, at the end. With clumps `final.csv` has them, and `members.csv` their members.
    pub fn finish(self, summary: &Summary, grains: &[Grain], clumps: &[Clump]) -> Result<()> {
        self.history.finish()?;
        if self.output.csv {
            let grains_file = if clumps.is_empty() { FINAL } else { MEMBERS };
            csv::write_grains(&self.folder.join(grains_file), grains, &self.materials)?;
        }
        if self.output.csv && !clumps.is_empty() {
            csv::write_clumps(&self.folder.join(FINAL), clumps, &self.shapes, &self.materials)?;
        }
        if self.output.vtp {
            write(&self.folder.join(SERIES), |file| vtp::write_series(file, &self.series))?;
        }
        write(&self.folder.join(SUMMARY), |file| {
            serde_json::to_writer_pretty(&mut *file, summary)?;
            writeln!(file)
        })
    }
}

/// Whether a run may have written a file of this name.
fn is_ours(name: &str) -> bool {
    let name = name.strip_suffix(".part").unwrap_or(name);
    let number = name.strip_prefix("snapshot_").and_then(|rest| rest.strip_suffix(".vtp"));
    [HISTORY, FINAL, MEMBERS, SUMMARY, SERIES].contains(&name) || number.is_some_and(|n| n.parse::<u64>().is_ok())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_files_of_a_run_are_ours() {
        assert!(["summary.json", "snapshot_000012.vtp", "history.csv.part"].into_iter().all(is_ours));
        assert!(!["picture.png", "snapshot_mine.vtp", "notes.csv", "summary.json.bak"].into_iter().any(is_ours));
    }
}
