//! Grains of text files.

use std::{collections::BTreeMap, path::Path};

use glam::{DQuat, DVec3};

use super::bodies::{Placed, Pose};
use super::check::{AXES, Check, show, show_vector};
use super::formats;
use super::origin::read_text;
use super::rows::{Parsed, number, quoted, unit};
use super::shape::Shapes;
use super::sheet::{Bounds, Fault, Geometry, Rows, Sheet, vector};
use super::{Domain, Grain};
use crate::{Error, Result};

/// How a file is read.
pub struct Options<'a> {
    /// Factor on positions and radii.
    pub scale: f64,
    /// Read only that many rows.
    pub count: Option<usize>,
    pub materials: Materials<'a>,
    /// Of all grains, m, where the file has none.
    pub radius: Option<f64>,
    pub domain: &'a Domain,
}

/// What grains are made of.
pub enum Materials<'a> {
    /// What their rows say.
    Named,
    /// This, but for rows of tables that name another.
    All(u32),
    /// What this says of the types, or names, in the rows.
    Types(BTreeMap<&'a str, u32>),
}

/// Reads the grains and clumps of a text file.
pub fn read(
    path: &Path,
    options: &Options,
    shapes: &mut Shapes,
    notices: &mut Vec<String>,
    check: &Check,
) -> Result<Placed> {
    let text = read_text(path, "a grain table")?;
    let name = path.display();
    let file_error = |message| Error::Scene(format!("{name}: {message}"));
    let fault = |(line, message): Fault| Error::Scene(format!("{name}:{line}: {message}"));
    let sheet = formats::parse(&text).map_err(fault)?;
    let rows = &sheet.rows;
    let columns = Columns::find(&sheet, options, check).map_err(|message| fault((rows.header, message)))?;
    notices.extend(sheet.notices.iter().map(|notice| format!("{name}: {notice}")));
    let other = other_box(&sheet, options, check).map_err(file_error)?;
    notices.extend(other.map(|notice| format!("{name}: {notice}")));

    let mut values = Vec::new();
    let (mut grains, mut poses) = (Vec::new(), Vec::new());
    for (k, (row, line)) in rows.lines.iter().take(options.count.unwrap_or(usize::MAX)).enumerate() {
        let mut read = || {
            rows.split(row, &mut values)?;
            columns.grain(&values, options, check)
        };
        let mut grain = read().map_err(|message| fault((*line, message)))?;
        if let Some(column) = columns.shape {
            let pose = match values[column] {
                "" => Pose { shape: shapes.sphere(), orientation: DQuat::IDENTITY },
                name => {
                    let flat = check.dimension == 2;
                    let orientation = columns.orientation(&values, flat).map_err(|message| fault((*line, message)))?;
                    let key = || format!("{}:{line}: shape", path.display());
                    Pose { shape: shapes.named(key, name)?, orientation }
                }
            };
            poses.push(pose);
        }
        if let Some(rows) = &sheet.velocities {
            let (row, line) = rows.lines[k];
            let mut read = || {
                rows.split(row, &mut values)?;
                velocities(rows, &values, check)
            };
            (grain.velocity, grain.spin) = read().map_err(|message| fault((line, message)))?;
        }
        if sheet.foreign {
            // Particle codes let grains go out of their periods for a while.
            options.domain.fold(&mut grain.position);
        }
        grains.push(grain);
    }
    match options.count {
        Some(count) if grains.len() < count => {
            Err(file_error(format!("has {} rows, but count = {count} are asked for", grains.len())))
        }
        _ if grains.is_empty() && sheet.foreign => Err(file_error("has no atoms".to_owned())),
        _ if grains.is_empty() => Err(file_error("has no rows below its header line".to_owned())),
        _ => Ok(Placed { grains, poses: columns.shape.map(|_| poses), numbers: None }),
    }
}

/// What is said of a box that is not the domain.
///
/// # Errors
/// If it is tilted as the domain is not: its grains would be other ones' neighbours.
fn other_box(sheet: &Sheet, options: &Options, check: &Check) -> Parsed<Option<String>> {
    /// Digits that files may lack.
    const ROUNDING: f64 = 1e-6;
    let Some(Bounds { lower, lengths, tilt }) = sheet.bounds else { return Ok(None) };
    let (scale, domain) = (options.scale, options.domain);
    let (lower, lengths, tilt) = (scale * lower, scale * lengths, scale * tilt);
    let upper = lower + lengths;
    let alike = |axis: usize| {
        let near = |a: f64, b: f64| (a - b).abs() <= ROUNDING * lengths[axis].abs();
        near(lower[axis], domain.lower[axis]) && near(upper[axis], domain.upper[axis])
    };
    let edges = Bounds { lower, lengths, tilt }.edges();
    let is_straight = |axis: usize| edges[axis] == edges[axis] * DVec3::AXES[axis];
    // Tilts by whole lengths are none.
    let is_edge = |axis: usize| domain.nearest(edges[axis]).length() <= ROUNDING * lengths.max_element();
    let fits = |axis: usize| match domain.periodic[axis] {
        true => alike(axis) && is_edge(axis),
        false => is_straight(axis),
    };
    let mut axes = 0..check.dimension;
    if !(domain.tilt == DVec3::ZERO && axes.clone().all(is_straight) || axes.all(fits)) {
        let [yz, xz, xy] = tilt.to_array().map(show);
        return Err(format!(
            "its box, from {} with the lengths {} and the tilts yz = {yz}, xz = {xz} and xy = {xy} m, is not the cell of the scene; \
             let the domain have its bounds, its faces be periodic, and domain.tilt be the same",
            show_vector(lower, check.dimension),
            show_vector(lengths, check.dimension),
        ));
    }
    let other: Vec<_> = (0..check.dimension).filter(|axis| !alike(*axis)).map(|axis| AXES[axis].to_string()).collect();
    let show = |corner: DVec3| show_vector(corner, check.dimension);
    Ok((!other.is_empty()).then(|| {
        format!(
            "its box, from {} to {} m, is not the domain of the scene along {}",
            show(lower),
            show(upper),
            other.join(", ")
        )
    }))
}

/// Velocity and spin where they have rows of their own.
fn velocities(rows: &Rows, row: &[&str], check: &Check) -> Parsed<(DVec3, DVec3)> {
    let flat = check.dimension == 2;
    let columns = |names: [&str; 3]| names.map(|name| rows.find(name));
    let velocity = vector(row, columns(["vx", "vy", "vz"]), [false, false, flat])?;
    Ok((velocity, vector(row, columns(["wx", "wy", "wz"]), [flat, flat, false])?))
}

/// Where each quantity stands in a row.
struct Columns {
    geometry: Geometry,
    velocity: [Option<usize>; 3],
    spin: [Option<usize>; 3],
    material: Option<usize>,
    /// Whether what stands there is the name of a material, and not a type.
    named: bool,
    shape: Option<usize>,
    /// w, x, y, z
    orientation: [Option<usize>; 4],
}

impl Columns {
    fn find(sheet: &Sheet, options: &Options, check: &Check) -> Parsed<Columns> {
        let find = |name: &str| sheet.rows.find(name);
        let columns = Columns {
            geometry: sheet.geometry(check.dimension)?,
            velocity: ["vx", "vy", "vz"].map(find),
            spin: ["wx", "wy", "wz"].map(find),
            material: find("material"),
            named: !sheet.foreign,
            shape: find("shape"),
            orientation: ["qw", "qx", "qy", "qz"].map(find),
        };
        if columns.shape.is_none() && columns.orientation.iter().any(Option::is_some) {
            return Err("has an orientation (qw, qx, qy, qz) but no column \"shape\"".to_owned());
        }
        match (columns.geometry.radius, options.radius) {
            (None, None) => {
                let hint = "; if all grains have the same, give the population the key `radius`";
                return Err(format!("lacks the column \"radius\" (or \"diameter\"){hint}"));
            }
            (Some(_), Some(_)) => return Err("has radii, so the population must not have the key `radius`".to_owned()),
            _ => {}
        }
        if columns.material.is_none() && !matches!(options.materials, Materials::All(_)) {
            return Err(
                "has no column \"material\", so the population needs the key `material`, with one name".to_owned()
            );
        }
        Ok(columns)
    }

    fn grain(&self, row: &[&str], options: &Options, check: &Check) -> Parsed<Grain> {
        let flat = check.dimension == 2;
        let radius = match self.geometry.radius(row)? {
            Some(radius) => radius * options.scale,
            None => options.radius.unwrap_or_default(),
        };
        let material = self.material(row, options, check)?;
        if let Some(rule) = check.fault_of_body(radius, material) {
            let value = show(radius);
            return Err(format!("radius = {value}: {rule}"));
        }
        Ok(Grain {
            position: self.geometry.position(row, flat)? * options.scale,
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
        match &options.materials {
            Materials::All(material) if name.is_empty() || !self.named => Ok(*material),
            Materials::Types(types) => types.get(name).copied().ok_or_else(|| {
                let known: Vec<&str> = types.keys().copied().collect();
                format!("{}: the key `material` of the population has only {}", quoted(name), known.join(", "))
            }),
            _ => check.material_index(name).ok_or_else(|| {
                let hint = if self.named { "" } else { "; say what types are, as in material = { 1 = \"glass\" }" };
                format!("material = {}: is no material; {}{hint}", quoted(name), check.known_materials())
            }),
        }
    }
}
