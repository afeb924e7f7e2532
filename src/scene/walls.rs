//! Walls: the surfaces of the scene file, with boxes split into planes.

use glam::DVec3;

use super::check::{AXES, Check, show_list};
use super::motion::{Motion, motion};
use super::schema::{self, WallKind};
use super::servo::servo;
use super::wall_targets::check_servo;
use super::{Domain, Surface, Wall};
use crate::Result;

/// All walls of a scene.
pub fn walls(walls: &[schema::Wall], domain: &Domain, check: &Check) -> Result<Vec<Wall>> {
    let mut out = Vec::new();
    for (number, wall) in walls.iter().enumerate() {
        Maker { key: format!("wall.{number}"), number, wall, domain, check }.make(&mut out)?;
    }
    Ok(out)
}

/// The name of wall number `number`, given or not.
pub fn name(wall: &schema::Wall, number: usize) -> String {
    wall.name.clone().unwrap_or_else(|| format!("{} {number}", kind_name(wall.kind)))
}

/// One wall of the file on its way into the assembly.
struct Maker<'a> {
    key: String,
    number: usize,
    wall: &'a schema::Wall,
    domain: &'a Domain,
    check: &'a Check<'a>,
}

impl Maker<'_> {
    fn make(&self, out: &mut Vec<Wall>) -> Result<()> {
        self.refuse_foreign_keys()?;
        let name = name(self.wall, self.number);
        let spin = self.wall.spin.unwrap_or(0.0);
        let material = self.check.material(&self.at("material"), &self.wall.material)?;
        let velocity = self.check.vector_or_zero(&self.at("velocity"), self.wall.velocity.as_deref())?;
        let motion = motion(self.wall, &self.key, self.check)?;
        let servo = servo(self.wall, &self.key, self.check)?;
        for axis in (0..self.check.dimension).filter(|axis| turns_across(&motion, *axis)) {
            self.not_periodic(axis)?;
        }
        let mut push = |name, surface| {
            let wall = Wall { name, surface, velocity, spin, motion: motion.clone(), servo, material };
            check_servo(&wall, &self.key, self.check)?;
            out.push(wall);
            Ok(())
        };
        match self.wall.kind {
            WallKind::Plane => push(name, self.plane()?),
            WallKind::Cylinder => push(name, self.cylinder()?),
            WallKind::Box => {
                self.faces()?.into_iter().try_for_each(|(face, surface)| push(format!("{name} {face}"), surface))
            }
        }
    }

    fn at(&self, field: &str) -> String {
        format!("{}.{field}", self.key)
    }

    /// A key of another kind of wall is as wrong as an unknown one.
    fn refuse_foreign_keys(&self) -> Result<()> {
        use WallKind::{Box, Cylinder, Plane};
        let wall = self.wall;
        let keys = [
            ("point", Plane, wall.point.is_some()),
            ("normal", Plane, wall.normal.is_some()),
            ("lower", Box, wall.lower.is_some()),
            ("upper", Box, wall.upper.is_some()),
            ("faces", Box, wall.faces.is_some()),
            ("center", Cylinder, wall.center.is_some()),
            ("radius", Cylinder, wall.radius.is_some()),
            ("spin", Cylinder, wall.spin.is_some()),
        ];
        let Some((field, ..)) = keys.iter().find(|(_, kind, set)| *set && *kind != wall.kind) else {
            return Ok(());
        };
        let own: Vec<&str> = keys.iter().filter(|(_, kind, _)| *kind == wall.kind).map(|(field, ..)| *field).collect();
        let message = format!(
            "is no key of a {}; allowed are kind, name, material, velocity, start, stop, oscillation, turning, table, target_force, target_pressure, area, gain, max_speed, inertial_number, {}",
            kind_name(wall.kind),
            own.join(", ")
        );
        Err(self.check.origin.wrong(&self.at(field), message))
    }

    fn need<'v, T>(&self, field: &str, value: &'v Option<T>) -> Result<&'v T> {
        value.as_ref().ok_or_else(|| {
            let message = format!("missing key `{field}` of a {}", kind_name(self.wall.kind));
            self.check.origin.wrong(&self.key, message)
        })
    }

    fn vector(&self, field: &str, value: &Option<Vec<f64>>) -> Result<DVec3> {
        let value = self.need(field, value)?;
        self.check.vector(&self.at(field), value)
    }

    fn plane(&self) -> Result<Surface> {
        let point = self.vector("point", &self.wall.point)?;
        let Some(normal) = self.vector("normal", &self.wall.normal)?.try_normalize() else {
            let rule = "must not be zero; it points to the side where the grains are";
            let value = show_list(self.wall.normal.as_deref().unwrap_or_default());
            return Err(self.check.origin.bad(&self.at("normal"), value, rule));
        };
        for axis in 0..self.check.dimension {
            if normal[axis] != 0.0 {
                self.not_periodic(axis)?;
            }
        }
        Ok(Surface::Plane { point, normal })
    }

    fn cylinder(&self) -> Result<Surface> {
        let center = self.need("center", &self.wall.center)?;
        let &[x, y] = center.as_slice() else {
            let rule = "must have 2 numbers, x and y of the axis";
            let value = show_list(center);
            return Err(self.check.origin.bad(&self.at("center"), value, rule));
        };
        let radius = *self.need("radius", &self.wall.radius)?;
        let radius = self.check.positive(&self.at("radius"), radius, " of m")?;
        self.not_periodic(0)?;
        self.not_periodic(1)?;
        Ok(Surface::Cylinder { center: DVec3::new(x, y, 0.0), radius })
    }

    /// The planes of a box, facing inward, with the names of their faces.
    fn faces(&self) -> Result<Vec<(String, Surface)>> {
        let lower = self.need("lower", &self.wall.lower)?;
        let upper = self.need("upper", &self.wall.upper)?;
        let (lower, upper) = self.check.corners(&self.key, lower, upper)?;
        let all: Vec<String> =
            AXES[..self.check.dimension].iter().flat_map(|axis| [format!("{axis}-"), format!("{axis}+")]).collect();
        let wanted = self.wall.faces.as_ref().unwrap_or(&all);
        if let Some(face) = wanted.iter().find(|face| !all.contains(face)) {
            let rule = format!("is no face; allowed are {}", all.join(", "));
            let value = format!("\"{face}\"");
            return Err(self.check.origin.bad(&self.at("faces"), value, rule));
        }
        let mut planes = Vec::new();
        for (index, face) in all.iter().enumerate() {
            if !wanted.contains(face) {
                continue;
            }
            let axis = index / 2;
            self.not_periodic(axis)?;
            let (point, side) = if index % 2 == 0 { (lower, 1.0) } else { (upper, -1.0) };
            let normal = side * DVec3::AXES[axis];
            planes.push((face.clone(), Surface::Plane { point, normal }));
        }
        Ok(planes)
    }

    fn not_periodic(&self, axis: usize) -> Result<()> {
        not_periodic(&self.key, axis, self.domain, self.check)
    }
}

/// Whether a wall that turns does not keep the direction of an axis.
pub fn turns_across(motion: &Motion, axis: usize) -> bool {
    motion.turning.is_some_and(|turning| (turning.axis - DVec3::AXES[axis] * turning.axis[axis]).length() > ROUNDING)
}

/// The wall called `key` needs an axis that is open.
pub fn not_periodic(key: &str, axis: usize, domain: &Domain, check: &Check) -> Result<()> {
    if !domain.periodic[axis] {
        return Ok(());
    }
    let message = format!("a wall cannot stand across the periodic axis {}", AXES[axis]);
    Err(check.origin.wrong(key, message))
}

/// Parts of a coordinate within which two are the same.
const ROUNDING: f64 = 1e-9;

/// Parts of the smallest radius within which two surfaces are one: a grain that leans on one of them touches the other
/// with most of its overlap.
const NEAR: f64 = 1e-3;

/// Surfaces have no edges: of two in the same place that stay there together grains would feel both. `smallest` is the
/// radius of the smallest grain, m.
///
/// # Errors
/// [`Error::Scene`](crate::Error::Scene) with the first two that do.
pub fn check_apart(walls: &[Wall], smallest: f64, check: &Check) -> Result<()> {
    for (k, wall) in walls.iter().enumerate() {
        if let Some(other) = walls[..k].iter().find(|other| stay_together(wall, other, NEAR * smallest)) {
            let message = format!(
                "\"{}\" and \"{}\" have the same surface and move alike; as surfaces have no edges, grains would feel both: leave one out",
                other.name, wall.name
            );
            return Err(check.origin.wrong("wall", message));
        }
    }
    Ok(())
}

/// Whether two surfaces that face the same way are no further apart than `near`, and remain so.
fn stay_together(a: &Wall, b: &Wall, near: f64) -> bool {
    if a.motion != b.motion || a.servo != b.servo {
        return false;
    }
    let apart = a.velocity - b.velocity;
    match (a.surface, b.surface) {
        (Surface::Plane { point: p, normal: n }, Surface::Plane { point: q, normal: m }) => {
            let slack = near + ROUNDING * p.length().max(q.length());
            let alike = apart.dot(n).abs() <= ROUNDING * a.velocity.length().max(b.velocity.length());
            (n - m).length() <= ROUNDING && (p - q).dot(n).abs() <= slack && alike
        }
        (Surface::Cylinder { center: p, radius: r }, Surface::Cylinder { center: q, radius: s }) => {
            let slack = near + ROUNDING * (p.length().max(q.length()) + r.max(s));
            let sideways = apart.truncate().length();
            (p - q).truncate().length() <= slack && (r - s).abs() <= slack && sideways == 0.0
        }
        _ => false,
    }
}

fn kind_name(kind: WallKind) -> &'static str {
    match kind {
        WallKind::Plane => "plane",
        WallKind::Box => "box",
        WallKind::Cylinder => "cylinder",
    }
}
