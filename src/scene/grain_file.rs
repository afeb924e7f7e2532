//! Grains in the binary files of runs.

use super::bodies::{Placed, Pose};
use super::check::{Check, show};
use super::rows::unit;
use super::shape::Shapes;
use super::table::{Materials, Options};
use super::{Clump, Grain, Material, Numbers, Shape};
use crate::container::{self, Column, Container};
use crate::{Error, Result, memory};
use glam::{DQuat, DVec3};
use serde::{Deserialize, Serialize};
use std::{io, path::Path};

/// What such a file says of itself.
const KIND: &str = "grains";

/// What it says besides its columns.
#[derive(Debug, Serialize, Deserialize)]
struct About {
    kind: String,
    version: String,
    dimension: usize,
    step: u64,
    /// s
    time: f64,
    /// What the columns of materials and shapes count, from 0.
    materials: Vec<String>,
    shapes: Vec<String>,
}

/// Grains at one time; in a scene with clumps these, and the grains are their members.
#[derive(Clone, Copy, Debug)]
pub struct Moment<'a> {
    pub step: u64,
    /// s
    pub time: f64,
    pub grains: &'a [Grain],
    pub clumps: &'a [Clump],
    /// The clumps of the grains; empty without clumps.
    pub owners: &'a [u32],
    pub numbers: &'a Numbers,
}

/// What the numbers of grains and clumps refer to.
#[derive(Clone, Copy, Debug)]
pub struct Names<'a> {
    pub dimension: usize,
    pub materials: &'a [Material],
    pub shapes: &'a [Shape],
}

/// Write the grains of a moment.
pub(crate) fn write(out: &mut impl io::Write, moment: &Moment, names: &Names) -> io::Result<()> {
    let about = About {
        kind: KIND.to_owned(),
        version: env!("CARGO_PKG_VERSION").to_owned(),
        dimension: names.dimension,
        step: moment.step,
        time: moment.time,
        materials: names.materials.iter().map(|material| material.name.clone()).collect(),
        shapes: names.shapes.iter().map(|shape| shape.name.clone()).collect(),
    };
    let Moment { grains, clumps, owners, numbers, .. } = *moment;
    // Only where they are not the places in the file.
    let (ids, clump_ids) = (&numbers.grains, &numbers.clumps);
    if clumps.is_empty() {
        let columns = [
            Column::new("position", "m", grains, |g| g.position.to_array()),
            Column::new("velocity", "m/s", grains, |g| g.velocity.to_array()),
            Column::new("angular_velocity", "rad/s", grains, |g| g.spin.to_array()),
            Column::new("radius", "m", grains, |g| [g.radius]),
            Column::new("material", "", grains, |g| [g.material]),
            Column::new("fixed", "", grains, |g| [u32::from(g.fixed)]),
            Column::new("id", "", ids, |id| [*id]),
        ];
        let columns = &columns[..columns.len() - usize::from(ids.is_empty())];
        return container::write(out, &about, columns);
    }
    let columns = [
        Column::new("position", "m", clumps, |c| c.position.to_array()),
        Column::new("velocity", "m/s", clumps, |c| c.velocity.to_array()),
        Column::new("angular_velocity", "rad/s", clumps, |c| c.spin.to_array()),
        Column::new("radius", "m", clumps, |c| [c.radius]),
        Column::new("material", "", clumps, |c| [c.material]),
        Column::new("fixed", "", clumps, |c| [u32::from(c.fixed)]),
        Column::new("shape", "", clumps, |c| [c.shape]),
        Column::new("orientation", "", clumps, |c| c.orientation.to_array()),
        Column::new("member_position", "m", grains, |g| g.position.to_array()),
        Column::new("member_velocity", "m/s", grains, |g| g.velocity.to_array()),
        Column::new("member_radius", "m", grains, |g| [g.radius]),
        Column::new("member_clump", "", owners, |owner| [*owner]),
        Column::new("id", "", clump_ids, |id| [*id]),
        Column::new("member_id", "", ids, |id| [*id]),
    ];
    let columns = &columns[..columns.len() - 2 * usize::from(ids.is_empty())];
    container::write(out, &about, columns)
}

/// Reads the grains or clumps of a file.
pub(super) fn read(path: &Path, options: &Options, shapes: &mut Shapes, check: &Check) -> Result<Placed> {
    let wrong = |message: String| Error::Scene(format!("{}: {message}", path.display()));
    let mut file = Container::<About>::open(path)?;
    if file.about.kind != KIND {
        return Err(wrong(format!("holds {}, not {KIND}", file.about.kind)));
    }
    if file.about.dimension != check.dimension {
        return Err(wrong(format!(
            "has grains of dimension = {}, the scene {}",
            file.about.dimension, check.dimension
        )));
    }
    if options.radius.is_some() || matches!(options.materials, Materials::Types(_)) {
        return Err(wrong(
            "has radii and materials by name: `radius` and a table of types do not go with it".to_owned(),
        ));
    }
    let rows = file.rows("position").unwrap_or(0);
    let count = options.count.map_or(rows, |count| count as u64);
    if rows < count {
        return Err(wrong(format!("has {rows} rows, but count = {count} are asked for")));
    }
    if count == 0 {
        return Err(wrong("has no rows".to_owned()));
    }
    let clumped = file.rows("shape").is_some();
    let needed = ["velocity", "angular_velocity", "radius", "material"];
    let of_clumps = ["shape", "orientation"].into_iter().filter(|_| clumped);
    if let Some(name) = needed.into_iter().chain(of_clumps).find(|name| file.rows(name) != Some(rows)) {
        return Err(wrong(format!("lacks {rows} rows of the column \"{name}\"")));
    }
    let none = Grain {
        position: DVec3::ZERO,
        velocity: DVec3::ZERO,
        spin: DVec3::ZERO,
        radius: 0.0,
        material: 0,
        fixed: false,
    };
    memory::check_host(memory::of_grains(count))?;
    let mut grains = memory::filled(none, count as usize)?;
    file.vectors("position", &mut grains, |grain, x| grain.position = options.scale * x)?;
    file.vectors("velocity", &mut grains, |grain, v| grain.velocity = v)?;
    file.vectors("angular_velocity", &mut grains, |grain, spin| grain.spin = spin)?;
    file.read("radius", |k, [radius]: [f64; 1]| {
        if_there(&mut grains, k, |grain| grain.radius = options.scale * radius)
    })?;
    file.read("material", |k, [material]| if_there(&mut grains, k, |grain| grain.material = material))?;
    if file.rows("fixed") == Some(rows) {
        file.read("fixed", |k, [fixed]: [u32; 1]| if_there(&mut grains, k, |grain| grain.fixed = fixed != 0))?;
    }

    let names = |names: &[String], index: u32| names.get(index as usize).cloned().unwrap_or_default();
    let materials: Vec<_> = file.about.materials.iter().map(|name| check.material_index(name)).collect();
    for (k, grain) in grains.iter_mut().enumerate() {
        let unknown = || {
            let name = names(&file.about.materials, grain.material);
            wrong(format!("row {k}: material = \"{name}\": is no material; {}", check.known_materials()))
        };
        grain.material = materials.get(grain.material as usize).copied().flatten().ok_or_else(unknown)?;
        if let Some(fault) = fault(grain, check) {
            return Err(wrong(format!("row {k}: {fault}")));
        }
    }
    let ids = file.ids("id", count)?;
    let numbers = |grains: Vec<u32>, clumps| (!grains.is_empty()).then_some(Numbers { grains, clumps });
    if !clumped {
        return Ok(Placed { grains, poses: None, numbers: numbers(ids, Vec::new()) });
    }
    let mut poses = memory::filled(Pose { shape: 0, orientation: DQuat::IDENTITY }, grains.len())?;
    file.read("orientation", |k, q| if_there(&mut poses, k, |pose| pose.orientation = DQuat::from_array(q)))?;
    file.read("shape", |k, [shape]| if_there(&mut poses, k, |pose| pose.shape = shape))?;
    for (k, pose) in poses.iter_mut().enumerate() {
        let q = pose.orientation;
        let flat = check.dimension == 2 && (q.x != 0.0 || q.y != 0.0);
        if flat || (q.length() - 1.0).abs() >= 1e-3 || !q.is_finite() {
            return Err(wrong(format!(
                "row {k}: orientation = {q}: must be a unit quaternion, about z in two dimensions"
            )));
        }
        let key = || format!("{}: row {k}: shape", path.display());
        let shape = shapes.named(key, &names(&file.about.shapes, pose.shape))?;
        *pose = Pose { shape, orientation: unit(q) };
    }
    let members = file.ids("member_id", u64::MAX)?;
    Ok(Placed { grains, poses: Some(poses), numbers: numbers(members, ids) })
}

/// A file may have more rows than are asked for.
fn if_there<T>(rows: &mut [T], k: usize, set: impl FnOnce(&mut T)) {
    if let Some(row) = rows.get_mut(k) {
        set(row);
    }
}

impl<A> Container<A> {
    /// What its first so many grains are called; none if it does not say.
    fn ids(&mut self, name: &str, count: u64) -> Result<Vec<u32>> {
        let mut ids = Vec::new();
        if self.rows(name).is_some() {
            self.read(name, |_, [id]: [u32; 1]| ids.push(id))?;
        }
        ids.truncate(usize::try_from(count).unwrap_or(usize::MAX));
        Ok(ids)
    }

    fn vectors(&mut self, name: &str, grains: &mut [Grain], set: impl Fn(&mut Grain, DVec3)) -> Result<()> {
        self.read(name, |k, x| if_there(grains, k, |grain| set(grain, DVec3::from_array(x))))
    }
}

/// What is wrong with a row.
fn fault(grain: &Grain, check: &Check) -> Option<String> {
    let vectors = [("position", grain.position), ("velocity", grain.velocity), ("angular_velocity", grain.spin)];
    let flat = [DVec3::Z, DVec3::Z, DVec3::new(1.0, 1.0, 0.0)];
    for ((name, vector), must_be_zero) in vectors.into_iter().zip(flat) {
        if !vector.is_finite() {
            return Some(format!("{name} = {vector}: must be finite numbers"));
        }
        if check.dimension == 2 && vector * must_be_zero != DVec3::ZERO {
            return Some(format!("{name} = {vector}: must be in the plane in two dimensions"));
        }
    }
    if !(grain.radius > 0.0 && grain.radius.is_finite()) {
        return Some(format!("radius = {}: must be a positive number of m", show(grain.radius)));
    }
    check.fault_of_body(grain.radius, grain.material).map(|rule| format!("radius = {}: {rule}", show(grain.radius)))
}
