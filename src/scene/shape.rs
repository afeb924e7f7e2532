//! Shapes of clumps: rigid sets of spheres (3D) or disks (2D), with the mass properties of their union.

mod generate;
mod member;
mod members;
mod mesh;
mod union;

use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};
use std::path::Path;

use glam::{DMat3, DQuat, DVec2, DVec3};

use super::check::{Check, show};
use super::schema;
use crate::Result;

pub use generate::Kind;
use member::Mass;
pub use member::Member;
pub use mesh::Misfit;

/// A shape: lengths are relative to the radius of the sphere (disk) of the same volume, so that a clump of size R has
/// arms and radii R times as large, the mass of the sphere of radius R, and moments of inertia J = `gyration` m R².
#[derive(Clone, Debug, PartialEq)]
pub struct Shape {
    pub name: String,
    /// From the centre of mass, along the principal axes.
    pub members: Vec<Member>,
    /// The part of every member's surface that is outside of all others.
    pub exposed: Vec<f64>,
    /// J1, J2, J3 over m R². In the plane all three are that about z.
    pub gyration: DVec3,
    /// Rotates from the principal axes to the axes in which the shape was given.
    pub frame: DQuat,
    /// Centre of mass and radius of the sphere (disk) of the same volume, where the shape was given and in its unit.
    pub center: DVec3,
    pub radius: f64,
    /// Bound of the relative error of volume and, over powers of the size, centre and moments; 0 if the user gave them.
    pub error: f64,
    /// How well the members fill the mesh that they were made from.
    pub misfit: Option<Misfit>,
}

/// Moments closer to each other than this part of them are the same: symmetry that rounding has hidden.
const ALIKE: f64 = 1e-9;

impl Shape {
    /// A single sphere or disk.
    pub fn sphere(dimension: usize) -> Shape {
        let gyration = if dimension == 2 { 0.5 } else { 0.4 };
        Shape {
            name: if dimension == 2 { "disk" } else { "sphere" }.to_owned(),
            members: vec![Member { arm: DVec3::ZERO, radius: 1.0 }],
            exposed: vec![1.0],
            gyration: DVec3::splat(gyration),
            frame: DQuat::IDENTITY,
            center: DVec3::ZERO,
            radius: 1.0,
            error: 0.0,
            misfit: None,
        }
    }

    /// The shape of these members, overlaps counted once.
    pub fn of_union(name: &str, members: &[Member], dimension: usize) -> Shape {
        if let &[Member { arm, radius }] = members {
            return Shape { name: name.to_owned(), center: arm, radius, ..Shape::sphere(dimension) };
        }
        let union::Measured { middle, moments, error } = union::measure(members, dimension);
        let shift = moments.first / moments.volume;
        let inertia = moments.moved(-shift).inertia();
        Shape::new(name, members, dimension, &Mass { volume: moments.volume, center: middle + shift, inertia }, error)
    }

    /// The shape of these members with mass properties that are known.
    fn new(name: &str, members: &[Member], dimension: usize, mass: &Mass, error: f64) -> Shape {
        let radius = if dimension == 2 { (mass.volume / PI).sqrt() } else { (0.75 * mass.volume / PI).cbrt() };
        let unit = mass.volume * radius * radius;
        let (moments, axes) = match dimension {
            2 => (DVec3::splat(mass.inertia.z_axis.z / unit), DMat3::IDENTITY),
            _ => principal(mass.inertia * (1.0 / unit)),
        };
        let frame = DQuat::from_mat3(&axes).normalize();
        let inward =
            |m: &Member| Member { arm: frame.inverse() * (m.arm - mass.center) / radius, radius: m.radius / radius };
        Shape {
            name: name.to_owned(),
            members: members.iter().map(inward).collect(),
            exposed: exposed(members, dimension),
            gyration: moments,
            frame,
            center: mass.center,
            radius,
            error,
            misfit: None,
        }
    }

    /// The shape of a closed triangle mesh (STL) in three dimensions, filled by at most `count` spheres, with the mass
    /// properties of what the mesh encloses.
    ///
    /// # Errors
    /// [`crate::Error::Io`] if it cannot be read, [`crate::Error::Scene`] if it is no STL file or its surface is not
    /// closed.
    pub fn of_mesh(name: &str, path: &Path, count: usize) -> Result<Shape> {
        let mesh::Filled { members, mass, misfit } = mesh::fill(path, count)?;
        let shape = Shape::new(name, &members, 3, &mass, mesh::ROUNDING);
        let misfit = Misfit { mean: misfit.mean / shape.radius, max: misfit.max / shape.radius };
        Ok(Shape { misfit: Some(misfit), ..shape })
    }

    /// Radius of the smallest ball about the centre of mass that holds all members.
    pub fn reach(&self) -> f64 {
        self.members.iter().map(|m| m.arm.length() + m.radius).fold(0.0, f64::max)
    }

    /// Whether all moments are equal, so that angular velocity and momentum are parallel and no product of angular
    /// velocities turns up in (2.21)-(2.23).
    pub fn is_round(&self) -> bool {
        self.gyration.x == self.gyration.y && self.gyration.y == self.gyration.z
    }
}

/// The part of every member's surface that is outside of all others, by points spread evenly.
fn exposed(members: &[Member], dimension: usize) -> Vec<f64> {
    const POINTS: usize = 500;
    let golden = PI * (3.0 - 5f64.sqrt());
    let point = |k: usize| match dimension {
        2 => DVec2::from_angle(TAU * k as f64 / POINTS as f64).extend(0.0),
        _ => {
            let z = 1.0 - (2 * k + 1) as f64 / POINTS as f64;
            ((1.0 - z * z).sqrt() * DVec2::from_angle(golden * k as f64)).extend(z)
        }
    };
    let points: Vec<DVec3> = (0..POINTS).map(point).collect();
    let of = |(k, member): (usize, &Member)| {
        let near: Vec<&Member> = members
            .iter()
            .enumerate()
            .filter(|(l, other)| *l != k && other.arm.distance(member.arm) < other.radius + member.radius)
            .map(|(_, other)| other)
            .collect();
        let outside = |p: &&DVec3| {
            let x = member.arm + member.radius * **p;
            near.iter().all(|other| other.arm.distance_squared(x) >= other.radius * other.radius)
        };
        points.iter().filter(outside).count() as f64 / POINTS as f64
    };
    members.iter().enumerate().map(of).collect()
}

/// Principal moments and axes (columns, right-handed) of a symmetric tensor by Jacobi's rotations, the axes in the
/// order in which they resemble x, y and z; moments that are equal but for rounding are made equal.
fn principal(tensor: DMat3) -> (DVec3, DMat3) {
    let (mut a, mut axes) = (tensor, DMat3::IDENTITY);
    for _ in 0..50 {
        let off = a.x_axis.y.abs() + a.x_axis.z.abs() + a.y_axis.z.abs();
        if off <= 1e-17 * (a.x_axis.x + a.y_axis.y + a.z_axis.z) {
            break;
        }
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            let mixed = a.col(q)[p];
            if mixed == 0.0 {
                continue;
            }
            let ratio = (a.col(q)[q] - a.col(p)[p]) / (2.0 * mixed);
            let t = ratio.signum() / (ratio.abs() + (1.0 + ratio * ratio).sqrt());
            let c = 1.0 / (1.0 + t * t).sqrt();
            let mut rotation = DMat3::IDENTITY;
            (rotation.col_mut(p)[p], rotation.col_mut(q)[q]) = (c, c);
            (rotation.col_mut(p)[q], rotation.col_mut(q)[p]) = (-t * c, t * c);
            a = rotation.transpose() * a * rotation;
            axes *= rotation;
        }
    }
    let mut moments = [a.x_axis.x, a.y_axis.y, a.z_axis.z];
    let alike = |x: f64, y: f64| (x - y).abs() <= ALIKE * (x + y);
    if alike(moments[0], moments[1]) && alike(moments[1], moments[2]) && alike(moments[0], moments[2]) {
        // Any axes are principal, so those that the shape has will do.
        return (DVec3::splat((moments[0] + moments[1] + moments[2]) / 3.0), DMat3::IDENTITY);
    }
    for (p, q) in [(0, 1), (0, 2), (1, 2)] {
        if alike(moments[p], moments[q]) {
            let mean = 0.5 * (moments[p] + moments[q]);
            (moments[p], moments[q]) = (mean, mean);
        }
    }
    if axes.determinant() < 0.0 {
        axes.z_axis = -axes.z_axis;
    }
    (DVec3::from_array(moments), axes)
}

/// The shapes of a scene: those of its tables, those of the library that it names, and single spheres.
pub struct Shapes<'a> {
    check: &'a Check<'a>,
    pub all: Vec<Shape>,
    known: BTreeMap<String, u32>,
}

impl<'a> Shapes<'a> {
    /// The shapes that the file describes.
    pub fn read(tables: &[schema::Shape], check: &'a Check<'a>) -> Result<Shapes<'a>> {
        let mut shapes = Shapes { check, all: Vec::new(), known: BTreeMap::new() };
        for (number, given) in tables.iter().enumerate() {
            let key = format!("shape.{number}");
            // The library's names mean what they say, spheres among clumps above all.
            let taken = shapes.known.contains_key(&given.name) || given.name.parse::<Kind>().is_ok();
            if taken || given.name.is_empty() || given.name.contains(['"', ',', '\n']) {
                let rule = "must be a name that neither another shape nor the library has, without commas and quotes";
                return Err(check.origin.bad(&format!("{key}.name"), format!("\"{}\"", given.name), rule));
            }
            let shape = read(given, &key, check)?;
            shapes.insert(shape);
        }
        Ok(shapes)
    }

    fn insert(&mut self, shape: Shape) -> u32 {
        let index = self.all.len() as u32;
        self.known.insert(shape.name.clone(), index);
        self.all.push(shape);
        index
    }

    /// The index of the shape of this name; one of the library comes in when it is named first.
    ///
    /// # Errors
    /// [`crate::Error::Scene`] if there is none.
    pub fn named(&mut self, key: impl Fn() -> String, name: &str) -> Result<u32> {
        if let Some(index) = self.known.get(name) {
            return Ok(*index);
        }
        let dimension = self.check.dimension;
        let known = || {
            let kinds = Kind::ALL.iter().filter(|k| k.fits(dimension)).map(|k| k.label());
            let own = self.known.keys().map(String::as_str);
            own.chain(kinds).collect::<Vec<_>>().join(", ")
        };
        let unknown = |_| {
            let rule = format!("is no shape; there are {}", known());
            self.check.origin.bad(&key(), format!("\"{name}\""), rule)
        };
        let kind: Kind = name.parse().map_err(unknown)?;
        if !kind.fits(dimension) {
            return Err(unknown(String::new()));
        }
        let shape = Shape::of_union(name, &kind.members(dimension, &generate::Options::default()), dimension);
        Ok(self.insert(shape))
    }

    /// The index of single spheres (disks).
    pub fn sphere(&mut self) -> u32 {
        let sphere = Shape::sphere(self.check.dimension);
        self.known.get(&sphere.name).copied().unwrap_or_else(|| self.insert(sphere))
    }
}

/// What they share is found by looking at all pairs of them, many times.
const MOST_MEMBERS: usize = 500;

fn read(given: &schema::Shape, key: &str, check: &Check) -> Result<Shape> {
    if let Some(file) = &given.mesh {
        return of_mesh(given, file, key, check);
    }
    if given.spheres.is_some() {
        return Err(check.origin.wrong(&format!("{key}.spheres"), "goes with `mesh` only"));
    }
    let members = members(given, key, check)?;
    if members.len() > MOST_MEMBERS {
        let message = format!("has {} members, at most {MOST_MEMBERS} are possible (2000 in a mesh)", members.len());
        return Err(check.origin.wrong(key, message));
    }
    let at = |field: &str| format!("{key}.{field}");
    let (Some(volume), Some(center), Some(inertia)) = (given.volume, &given.center, &given.inertia) else {
        if given.volume.is_some() || given.center.is_some() || given.inertia.is_some() {
            let message = "volume, center and inertia go together: all of them, or none to have them computed";
            return Err(check.origin.wrong(key, message));
        }
        return Ok(Shape::of_union(&given.name, &members, check.dimension));
    };
    let volume = check.positive(&at("volume"), volume, "")?;
    let inertia = match (check.dimension, &inertia[..]) {
        (2, &[zz]) => DMat3::from_diagonal(DVec3::splat(zz)),
        (3, &[xx, yy, zz, xy, xz, yz]) => {
            DMat3::from_cols(DVec3::new(xx, xy, xz), DVec3::new(xy, yy, yz), DVec3::new(xz, yz, zz))
        }
        (2, _) => return Err(check.origin.wrong(&at("inertia"), "must be [Jzz] (dimension = 2)")),
        _ => {
            let message =
                "must be [Jxx, Jyy, Jzz, Jxy, Jxz, Jyz], off the diagonal the tensor's own components -∫xy dV";
            return Err(check.origin.wrong(&at("inertia"), message));
        }
    };
    let mass = Mass { volume, center: check.vector(&at("center"), center)?, inertia };
    let shape = Shape::new(&given.name, &members, check.dimension, &mass, 0.0);
    let g = shape.gyration;
    let real = g.min_element() > 1e-6
        && g.max_element() < 1e6
        && (check.dimension == 2 || 2.0 * g.max_element() <= g.element_sum() * (1.0 + 1e-9));
    match real {
        true => Ok(shape),
        false => Err(check.origin.wrong(
            &at("inertia"),
            format!(
                "belongs to no body: the principal moments {}, {}, {} (over m R²) must be from 1e-6 to 1e6, none above the sum of the others",
                show(g.x),
                show(g.y),
                show(g.z)
            ),
        )),
    }
}

fn of_mesh(given: &schema::Shape, file: &str, key: &str, check: &Check) -> Result<Shape> {
    let others = [
        ("members", given.members.is_some()),
        ("file", given.file.is_some()),
        ("kind", given.kind.is_some()),
        ("distance", given.distance.is_some()),
        ("count", given.count.is_some()),
        ("seed", given.seed.is_some()),
        ("volume", given.volume.is_some()),
        ("center", given.center.is_some()),
        ("inertia", given.inertia.is_some()),
    ];
    if let Some((field, _)) = others.iter().find(|(_, set)| *set) {
        let message = "does not go with `mesh`, which gives members and mass properties";
        return Err(check.origin.wrong(&format!("{key}.{field}"), message));
    }
    if check.dimension == 2 {
        return Err(check.origin.wrong(&format!("{key}.mesh"), "is for three dimensions only"));
    }
    let spheres = given.spheres.unwrap_or(30);
    check.within(&format!("{key}.spheres"), spheres as f64, 1.0, 2000.0, "")?;
    Shape::of_mesh(&given.name, &check.origin.directory.join(file), spheres)
}

fn members(given: &schema::Shape, key: &str, check: &Check) -> Result<Vec<Member>> {
    let sources = [given.members.is_some(), given.file.is_some(), given.kind.is_some()];
    if sources.iter().filter(|is| **is).count() != 1 {
        return Err(check.origin.wrong(key, "needs exactly one of members, file, kind, mesh"));
    }
    let generated =
        [("distance", given.distance.is_some()), ("count", given.count.is_some()), ("seed", given.seed.is_some())];
    if let Some((field, _)) = generated.iter().find(|(_, set)| *set && given.kind.is_none()) {
        return Err(check.origin.wrong(&format!("{key}.{field}"), "goes with `kind` only"));
    }
    if let Some(file) = &given.file {
        return members::read(&check.origin.directory.join(file), check);
    }
    if let Some(list) = &given.members {
        if list.is_empty() {
            return Err(check.origin.wrong(&format!("{key}.members"), "must have at least one"));
        }
        let member = |(k, member): (usize, &schema::Member)| {
            let at = |field: &str| format!("{key}.members.{k}.{field}");
            let arm = check.vector(&at("center"), &member.center)?;
            Ok(Member { arm, radius: check.positive(&at("radius"), member.radius, "")? })
        };
        return list.iter().enumerate().map(member).collect();
    }
    let word = given.kind.as_deref().unwrap_or_default();
    let at = |field: &str| format!("{key}.{field}");
    let kind = word.parse::<Kind>().ok().filter(|kind| kind.fits(check.dimension));
    let kind = kind.ok_or_else(|| {
        let kinds: Vec<_> = Kind::ALL.iter().filter(|k| k.fits(check.dimension)).map(|k| k.label()).collect();
        check.origin.bad(&at("kind"), format!("\"{word}\""), format!("must be one of {}", kinds.join(", ")))
    })?;
    let mut options = generate::Options::default();
    if let Some(distance) = given.distance {
        options.distance = check.within(&at("distance"), distance, 1e-3, 2.0, " radii")?;
    }
    if let Some(count) = given.count {
        if !kind.counts() {
            return Err(check.origin.wrong(&at("count"), "goes with kind = \"rod\" or \"random\" only"));
        }
        options.count = Some(check.within(&at("count"), count as f64, 1.0, MOST_MEMBERS as f64, "")? as usize);
    }
    if let Some(seed) = given.seed {
        if kind != Kind::Random {
            return Err(check.origin.wrong(&at("seed"), "goes with kind = \"random\" only"));
        }
        options.seed = seed;
    }
    Ok(kind.members(check.dimension, &options))
}
