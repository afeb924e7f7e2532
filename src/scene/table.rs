//! Grain tables in CSV files.

use std::path::Path;

use glam::{DQuat, DVec3};

use super::Grain;
use super::bodies::{Placed, Pose};
use super::check::{Check, show};
use super::origin::read_text;
use super::rows::{Parsed, lines, number, split, unit};
use super::shape::Shapes;
use crate::{Error, Result};

const COLUMNS: [&str; 17] =
    ["id", "x", "y", "z", "radius", "vx", "vy", "vz", "wx", "wy", "wz", "material", "shape", "qw", "qx", "qy", "qz"];

/// How a table is read.
pub struct Options {
    /// Factor on positions and radii.
    pub scale: f64,
    /// Read only that many rows.
    pub count: Option<usize>,
    /// Material of the rows that name none.
    pub material: Option<u32>,
}

/// Reads the grains and clumps of a CSV file.
pub fn read(path: &Path, options: &Options, shapes: &mut Shapes, check: &Check) -> Result<Placed> {
    let text = read_text(path, "a grain table")?;
    let file_error = |message| Error::Scene(format!("{}: {message}", path.display()));
    let line_error = |line: usize, message| Error::Scene(format!("{}:{line}: {message}", path.display()));
    let mut lines = lines(&text);
    let mut values = Vec::new();

    let (header, line) = lines.next().ok_or_else(|| file_error("has no header line".to_owned()))?;
    split(header, &mut values);
    let columns = Columns::find(&values, options, check).map_err(|message| line_error(line, message))?;

    let (mut grains, mut poses) = (Vec::new(), Vec::new());
    for (row, line) in lines.take(options.count.unwrap_or(usize::MAX)) {
        split(row, &mut values);
        let grain = columns.grain(&values, options, check).map_err(|message| line_error(line, message))?;
        grains.push(grain);
        let Some(column) = columns.shape else { continue };
        let pose = match values[column] {
            "" => Pose { shape: shapes.sphere(), orientation: DQuat::IDENTITY },
            name => {
                let flat = check.dimension == 2;
                let orientation = columns.orientation(&values, flat).map_err(|message| line_error(line, message))?;
                let key = || format!("{}:{line}: shape", path.display());
                Pose { shape: shapes.named(key, name)?, orientation }
            }
        };
        poses.push(pose);
    }
    match options.count {
        Some(count) if grains.len() < count => {
            Err(file_error(format!("has {} rows, but count = {count} are asked for", grains.len())))
        }
        _ if grains.is_empty() => Err(file_error("has no rows below its header line".to_owned())),
        _ => Ok(Placed { grains, poses: columns.shape.map(|_| poses) }),
    }
}

/// Where each quantity stands in a row.
struct Columns {
    count: usize,
    position: [Option<usize>; 3],
    velocity: [Option<usize>; 3],
    spin: [Option<usize>; 3],
    radius: usize,
    material: Option<usize>,
    shape: Option<usize>,
    /// w, x, y, z
    orientation: [Option<usize>; 4],
}

impl Columns {
    fn find(header: &[&str], options: &Options, check: &Check) -> Parsed<Columns> {
        for (at, name) in header.iter().copied().enumerate() {
            if !COLUMNS.contains(&name) {
                let known = COLUMNS.join(", ");
                return Err(format!("unknown column \"{name}\"; allowed are {known}"));
            }
            if header[..at].contains(&name) {
                return Err(format!("column \"{name}\" appears twice"));
            }
        }
        let find = |name: &str| header.iter().position(|column| *column == name);
        let need = |name: &str| find(name).ok_or_else(|| format!("the header line lacks the column \"{name}\""));
        for axis in &["x", "y", "z"][..check.dimension] {
            need(axis)?;
        }
        let columns = Columns {
            count: header.len(),
            position: ["x", "y", "z"].map(find),
            velocity: ["vx", "vy", "vz"].map(find),
            spin: ["wx", "wy", "wz"].map(find),
            radius: need("radius")?,
            material: find("material"),
            shape: find("shape"),
            orientation: ["qw", "qx", "qy", "qz"].map(find),
        };
        if columns.shape.is_none() && columns.orientation.iter().any(Option::is_some) {
            return Err("has an orientation (qw, qx, qy, qz) but no column \"shape\"".to_owned());
        }
        if columns.material.is_none() && options.material.is_none() {
            return Err("has no column \"material\", so the population needs the key `material`".to_owned());
        }
        Ok(columns)
    }

    fn grain(&self, row: &[&str], options: &Options, check: &Check) -> Parsed<Grain> {
        if row.len() != self.count {
            let (found, wanted) = (row.len(), self.count);
            return Err(format!("has {found} values, the header line {wanted} columns"));
        }
        let flat = check.dimension == 2;
        let radius = number(row, self.radius)? * options.scale;
        if radius <= 0.0 {
            let value = row[self.radius];
            return Err(format!("radius = {value}: must be a positive number of m"));
        }
        let material = self.material(row, options, check)?;
        if let Some(rule) = check.fault_of_body(radius, material) {
            let value = show(radius);
            return Err(format!("radius = {value}: {rule}"));
        }
        Ok(Grain {
            position: vector(row, self.position, [false, false, flat])? * options.scale,
            velocity: vector(row, self.velocity, [false, false, flat])?,
            spin: vector(row, self.spin, [flat, flat, false])?,
            radius,
            material,
            fixed: false,
        })
    }

    /// A unit quaternion; identity where the table has none.
    fn orientation(&self, row: &[&str], flat: bool) -> Parsed<DQuat> {
        let [Some(w), Some(x), Some(y), Some(z)] = self.orientation else {
            return match self.orientation {
                [None, None, None, None] => Ok(DQuat::IDENTITY),
                _ => Err("the columns qw, qx, qy, qz go together".to_owned()),
            };
        };
        let q = DQuat::from_xyzw(number(row, x)?, number(row, y)?, number(row, z)?, number(row, w)?);
        if flat && (q.x != 0.0 || q.y != 0.0) {
            return Err("qx and qy must be 0 in two dimensions".to_owned());
        }
        match (q.length() - 1.0).abs() < 1e-3 {
            true => Ok(unit(q)),
            false => Err(format!("the quaternion has the length {}, must be 1", show(q.length()))),
        }
    }

    fn material(&self, row: &[&str], options: &Options, check: &Check) -> Parsed<u32> {
        let name = self.material.map_or("", |column| row[column]);
        match (name, options.material) {
            ("", Some(material)) => Ok(material),
            _ => check
                .material_index(name)
                .ok_or_else(|| format!("material = \"{name}\": is no material; {}", check.known_materials())),
        }
    }
}

/// Three components; missing columns are 0, and so must be those that do not exist in two dimensions.
fn vector(row: &[&str], columns: [Option<usize>; 3], must_be_zero: [bool; 3]) -> Parsed<DVec3> {
    let mut vector = DVec3::ZERO;
    for axis in 0..3 {
        let Some(column) = columns[axis] else {
            continue;
        };
        vector[axis] = number(row, column)?;
        if must_be_zero[axis] && vector[axis] != 0.0 {
            let value = row[column];
            return Err(format!("value {} = {value}: must be 0 or missing in two dimensions", column + 1));
        }
    }
    Ok(vector)
}
