//! `history.csv` and grain tables such as `final.csv`.

use super::files::{at, create, is_file, write};
use crate::{
    error::{Error, Result},
    input,
    measure::{Sample, micromechanics::packing::LoadOnWall},
    scene::{Clump, Grain, Material, Numbers, Shape, Wall},
    simulation::Outflow,
};
use glam::DVec3;
use serde::{Deserialize, Serialize};
use std::{
    collections::BTreeSet,
    fs::{self, File, OpenOptions},
    io::{self, Read, Seek, SeekFrom, Write},
    path::{Path, PathBuf},
};

/// What follows the members of [`Sample`] in `history.csv`.
#[derive(Serialize)]
struct Rate {
    particle_steps_per_second: f64,
}

/// The history, written row by row so that a run can be followed. A row is there as a whole or not at all.
pub struct History {
    path: PathBuf,
    file: File,
    /// Names of the walls, whose loads are the last columns.
    walls: Vec<String>,
    /// Bytes of whole rows.
    length: u64,
}

impl History {
    pub(super) fn create(path: &Path, walls: &[Wall]) -> Result<History> {
        let walls = walls.iter().map(|wall| wall.name.clone()).collect();
        Ok(History { path: path.to_owned(), file: create(path).map_err(at(path))?, walls, length: 0 })
    }

    /// Go on after the rows of these steps, as many of them as are there; all others go. Returns how many are missing.
    pub(super) fn resume(path: &Path, walls: &[Wall], steps: &BTreeSet<u64>) -> Result<(History, usize)> {
        if !is_file(path).map_err(at(path))? {
            return Ok((History::create(path, walls)?, steps.len()));
        }
        let text = fs::read_to_string(path).map_err(at(path))?;
        let mut left = steps.clone();
        let mut is_kept = |line: &&str| {
            let step = line.split(',').next().unwrap_or_default();
            let is_head = line.ends_with('\n') && !steps.is_empty() && line.starts_with("step,");
            is_head || line.ends_with('\n') && step.parse().is_ok_and(|step| left.remove(&step))
        };
        let kept: String = text.split_inclusive('\n').filter(|line| is_kept(line)).collect();
        if !text.starts_with(&kept) {
            write(path, |file| file.write_all(kept.as_bytes()))?;
        }
        let length = kept.len() as u64;
        let file = OpenOptions::new().read(true).write(true).open(path);
        let file = file.and_then(|file| file.set_len(length).map(|()| file)).map_err(at(path))?;
        let walls = walls.iter().map(|wall| wall.name.clone()).collect();
        Ok((History { path: path.to_owned(), file, walls, length }, left.len()))
    }

    pub(super) fn row(&mut self, sample: &Sample, rate: f64, loads: &[LoadOnWall], outflows: &[Outflow]) -> Result<()> {
        let mut writer = csv::WriterBuilder::new().has_headers(self.length == 0).from_writer(Vec::new());
        let rate = Rate { particle_steps_per_second: rate };
        let row = match (&sample.cell, &sample.openings, &sample.growth) {
            (Some(cell), Some(openings), _) => writer.serialize((sample, cell, openings, rate)),
            (None, Some(openings), _) => writer.serialize((sample, openings, rate)),
            (Some(cell), None, Some(growth)) => writer.serialize((sample, cell, growth, rate)),
            (None, None, Some(growth)) => writer.serialize((sample, growth, rate)),
            (Some(cell), None, None) => writer.serialize((sample, cell, rate)),
            (None, None, None) => writer.serialize((sample, rate)),
        };
        let row = row.map_err(io::Error::from);
        let row = row.and_then(|()| writer.into_inner().map_err(|e| io::Error::other(e.to_string())));
        let row = row.and_then(|row| self.with_loads(row, loads, outflows)).map_err(at(&self.path))?;
        let written = self.file.seek(SeekFrom::Start(self.length)).and_then(|_| self.file.write_all(&row));
        match written {
            Ok(()) => self.length += row.len() as u64,
            // The error that is reported is the first.
            Err(_) => drop(self.file.set_len(self.length)),
        }
        written.map_err(at(&self.path))
    }

    /// A line, which that of the names may be before, with the loads on walls and what has left behind it.
    fn with_loads(&self, row: Vec<u8>, loads: &[LoadOnWall], outflows: &[Outflow]) -> io::Result<Vec<u8>> {
        let parts = ["force.x", "force.y", "force.z", "moment.x", "moment.y", "moment.z", "normal_force", "position"];
        let names = self.walls.iter().flat_map(|wall| parts.map(|part| format!("walls.{wall}.{part}")));
        let numbers = loads.iter().flat_map(|load| {
            let LoadOnWall { force, moment, normal_force, position } = load;
            [&force.to_array()[..], &moment.to_array(), &[*normal_force, *position]].concat()
        });
        let mut more = [names.collect::<Vec<_>>(), numbers.map(|x| format!("{x:?}")).collect()];
        for Outflow { name, removed, mass, rate } in outflows {
            more[0].extend(["particles", "mass", "flow_rate"].map(|part| format!("outlets.{name}.{part}")));
            more[1].extend([removed.to_string(), format!("{mass:?}"), format!("{rate:?}")]);
        }
        let lines: Vec<&[u8]> = row.split_inclusive(|byte| *byte == b'\n').collect();
        let mut writer = csv::WriterBuilder::new().flexible(true).from_writer(Vec::new());
        for (line, more) in lines.iter().zip(&more[2 - lines.len()..]) {
            let mut reader = csv::ReaderBuilder::new().has_headers(false).from_reader(*line);
            let fields = reader.records().next().transpose()?.unwrap_or_default();
            writer.write_record(fields.iter().chain(more.iter().map(String::as_str)))?;
        }
        writer.into_inner().map_err(|e| io::Error::other(e.to_string()))
    }

    /// The rows are on the disk when this returns.
    pub(super) fn sync(&self) -> Result<()> {
        self.file.sync_data().map_err(at(&self.path))
    }

    /// Go on in another file, with the rows so far, as many as can still be read.
    pub(super) fn go_on_in(&mut self, path: &Path) -> Result<()> {
        let mut rows = Vec::new();
        let _ = self.file.rewind().and_then(|()| (&self.file).take(self.length).read_to_end(&mut rows));
        let mut file = create(path).map_err(at(path))?;
        file.write_all(&rows).map_err(at(path))?;
        (self.path, self.file, self.length) = (path.to_owned(), file, rows.len() as u64);
        Ok(())
    }
}

/// A row of a grain table, in SI units; the names of the members are those of the columns. Scenes read such tables as
/// the `file` of a population.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct GrainRow {
    pub id: Option<u64>,
    pub x: f64,
    pub y: f64,
    pub z: f64,
    pub vx: f64,
    pub vy: f64,
    pub vz: f64,
    pub wx: f64,
    pub wy: f64,
    pub wz: f64,
    pub radius: f64,
    pub material: String,
}

impl GrainRow {
    /// Of a grain with a number.
    pub fn new(id: usize, grain: &Grain, materials: &[Material]) -> GrainRow {
        let (x, v, w) = (grain.position, grain.velocity, grain.spin);
        let material = materials[grain.material as usize].name.clone();
        let (id, radius) = (Some(id as u64), grain.radius);
        GrainRow { id, x: x.x, y: x.y, z: x.z, vx: v.x, vy: v.y, vz: v.z, wx: w.x, wy: w.y, wz: w.z, radius, material }
    }

    /// m
    pub fn position(&self) -> DVec3 {
        DVec3::new(self.x, self.y, self.z)
    }

    /// m/s
    pub fn velocity(&self) -> DVec3 {
        DVec3::new(self.vx, self.vy, self.vz)
    }
}

/// Writes all grains in their order. Numbers have as many digits as it takes to read the same number back.
pub fn write_grains(path: &Path, grains: &[Grain], materials: &[Material]) -> Result<()> {
    write(path, |file| self::grains(file, grains, materials, &Numbers::default()))
}

pub(super) fn grains(out: impl Write, grains: &[Grain], materials: &[Material], numbers: &Numbers) -> io::Result<()> {
    let mut writer = csv::Writer::from_writer(out);
    for (k, grain) in grains.iter().enumerate() {
        writer.serialize(GrainRow::new(numbers.of_grain(k) as usize, grain, materials))?;
    }
    writer.flush()
}

/// What a row of a clump has more than that of a grain, whose radius is that of the sphere (disk) of the same volume.
/// Scenes read such tables too.
#[derive(Serialize)]
struct Pose<'a> {
    shape: &'a str,
    qw: f64,
    qx: f64,
    qy: f64,
    qz: f64,
}

/// Writes all clumps in their order, with their centres of mass and the turn from the axes of their shapes to those of
/// the scene.
pub fn write_clumps(path: &Path, clumps: &[Clump], shapes: &[Shape], materials: &[Material]) -> Result<()> {
    write(path, |file| self::clumps(file, clumps, shapes, materials, &Numbers::default()))
}

pub(super) fn clumps(
    out: impl Write,
    clumps: &[Clump],
    shapes: &[Shape],
    materials: &[Material],
    numbers: &Numbers,
) -> io::Result<()> {
    let mut writer = csv::Writer::from_writer(out);
    for (k, clump) in clumps.iter().enumerate() {
        let Clump { position, velocity, spin, radius, material, fixed, .. } = *clump;
        let grain = Grain { position, velocity, spin, radius, material, fixed };
        let q = clump.orientation;
        let shape = &shapes[clump.shape as usize].name;
        let pose = Pose { shape, qw: q.w, qx: q.x, qy: q.y, qz: q.z };
        writer.serialize((GrainRow::new(numbers.of_clump(k) as usize, &grain, materials), pose))?;
    }
    writer.flush()
}

/// Reads a grain table; `x`, `y` and `radius` must be there, everything else counts as 0 where it is missing.
///
/// # Errors
/// [`Error::Io`] if there is no such file, [`Error::Scene`] if it is no grain table.
pub fn read_grains(path: &Path) -> Result<Vec<GrainRow>> {
    let bytes = input::read(path)?;
    let wrong = |message: String| Error::Scene(format!("{}: {message}", path.display()));
    let mut reader = csv::ReaderBuilder::new().comment(Some(b'#')).trim(csv::Trim::All).from_reader(&*bytes);
    let header = reader.headers().map_err(|e| wrong(e.to_string()))?;
    if let Some(missing) = ["x", "y", "radius"].into_iter().find(|name| !header.iter().any(|h| h == *name)) {
        return Err(wrong(format!("the header line lacks the column \"{missing}\"")));
    }
    let rows: Vec<GrainRow> =
        reader.deserialize().collect::<std::result::Result<_, _>>().map_err(|e| wrong(e.to_string()))?;
    if rows.is_empty() {
        return Err(wrong("has no rows below its header line".to_owned()));
    }
    Ok(rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_bit_survives() {
        let material = |name: &str| Material { name: name.into(), density: 1.0 };
        let materials = [material("glass"), material("a, \"b\"")];
        let grain = Grain {
            position: DVec3::new(0.1 + 0.2, -1.0 / 3.0, f64::MIN_POSITIVE),
            velocity: DVec3::new(1e300, -0.0, 5e-324),
            spin: DVec3::new(f64::from(0.1_f32), 2e22, 1.0),
            radius: 1e-3,
            material: 1,
            fixed: false,
        };
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("grains.csv");
        write_grains(&path, &[grain], &materials).unwrap();
        assert_eq!(read_grains(&path).unwrap(), [GrainRow::new(0, &grain, &materials)]);
    }

    #[test]
    fn what_is_no_table_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("grains.csv");
        for (text, part) in [
            ("x,y\n0,0\n", "lacks the column \"radius\""),
            ("x,y,radius\n", "no rows"),
            ("x,y,radius\n0,a,1\n", "line: 2"),
        ] {
            fs::write(&path, text).unwrap();
            let message = read_grains(&path).unwrap_err().to_string();
            assert!(message.contains(part), "{message}");
        }
    }
}
