//! What walls with a servo can be asked for, on which areas their pressures act, and whether they have what they were asked
//! for.

use std::f64::consts::PI;

use glam::DVec3;

use super::check::{Check, show};
use super::targets::CLOSE;
use super::{Assembly, Motion, Servo, Surface, Target, Wall};
use crate::Result;

/// The area of a wall between others: a factor, times breadth, in space times depth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Area {
    pub factor: f64,
    pub breadth: Span,
    pub depth: Span,
}

/// A length that may change as walls move.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Span {
    /// m
    Fixed(f64),
    /// From a plane to the one that faces it, by their numbers.
    Between(usize, usize),
    /// Of a cylinder.
    Radius(usize),
}

impl Span {
    /// m
    fn of(self, walls: &[Wall]) -> f64 {
        match self {
            Span::Fixed(length) => length,
            Span::Between(from, to) => walls[from].surface.distance(walls[to].surface.reference()),
            Span::Radius(of) => walls[of].surface.position(),
        }
    }
}

impl Area {
    /// Of a plane of this area, m² (m).
    fn fixed(area: f64, dimension: usize) -> Area {
        let side = Span::Fixed(if dimension == 2 { area } else { area.sqrt() });
        Area { factor: 1.0, breadth: side, depth: side }
    }

    /// m² (m), with walls where they are.
    pub fn of(&self, walls: &[Wall], dimension: usize) -> f64 {
        let depth = if dimension == 2 { 1.0 } else { self.depth.of(walls) };
        self.factor * self.breadth.of(walls) * depth
    }
}

/// Normals are along an axis up to this.
const ROUNDING: f64 = 1e-9;

impl Assembly {
    /// The area of a wall that other walls or periodic faces bound along the axes; None where they do not.
    pub fn area_of_wall(&self, number: usize) -> Option<Area> {
        let wall = &self.walls[number];
        if let Some(area) = wall.servo.and_then(|servo| servo.area) {
            return Some(Area::fixed(area, self.dimension));
        }
        let axis = match wall.surface {
            Surface::Cylinder { .. } => {
                let around = Area { factor: 2.0 * PI, breadth: Span::Radius(number), depth: Span::Fixed(1.0) };
                return match self.dimension {
                    2 => Some(around),
                    _ => self.length_along(2).map(|depth| Area { depth, ..around }),
                };
            }
            Surface::Plane { normal, .. } => {
                (0..self.dimension).find(|axis| (normal.abs() - DVec3::AXES[*axis]).length() < ROUNDING)?
            }
        };
        let cylinders: Vec<usize> =
            (0..self.walls.len()).filter(|k| matches!(self.walls[*k].surface, Surface::Cylinder { .. })).collect();
        match (&cylinders[..], self.dimension) {
            ([], 2) => {
                self.length_along(1 - axis).map(|breadth| Area { factor: 1.0, breadth, depth: Span::Fixed(1.0) })
            }
            ([], _) => {
                let [breadth, depth] = [(axis + 1) % 3, (axis + 2) % 3].map(|other| self.length_along(other));
                Some(Area { factor: 1.0, breadth: breadth?, depth: depth? })
            }
            // A piston.
            ([around], 3) if axis == 2 && self.length_along(0).is_none() && self.length_along(1).is_none() => {
                let radius = Span::Radius(*around);
                Some(Area { factor: PI, breadth: radius, depth: radius })
            }
            _ => None,
        }
    }

    /// The period along an axis, or from the only plane at its lower end to the only one at its upper end.
    fn length_along(&self, axis: usize) -> Option<Span> {
        if self.domain.periodic[axis] {
            // What deforms is no length.
            let fixed = self.cell.strain_rate[axis] == 0.0 && self.cell.stress[axis].is_none();
            return fixed.then(|| Span::Fixed(self.domain.upper[axis] - self.domain.lower[axis]));
        }
        let facing = |to: DVec3| {
            let is = |k: &usize| matches!(self.walls[*k].surface, Surface::Plane { normal, .. } if (normal - to).length() < ROUNDING);
            let mut found = (0..self.walls.len()).filter(is);
            found.next().filter(|_| found.next().is_none())
        };
        Some(Span::Between(facing(DVec3::AXES[axis])?, facing(-DVec3::AXES[axis])?))
    }

    /// The force along its normal that a wall is to have where the walls are now, N; None without a servo.
    fn target_force(&self, number: usize, walls: &[Wall]) -> Option<f64> {
        match self.walls[number].servo?.target {
            Target::Force(force) => Some(force),
            Target::Pressure(pressure) => Some(pressure * self.area_of_wall(number)?.of(walls, self.dimension)),
        }
    }

    /// The speed of a wall that makes the whole bed deform with the inertial number of its servo, m/s.
    fn speed_of_servo(&self, number: usize) -> Option<f64> {
        let servo = self.walls[number].servo?;
        let pressure = match servo.target {
            Target::Pressure(pressure) => pressure,
            Target::Force(force) => force / self.area_of_wall(number)?.of(&self.walls, self.dimension),
        };
        Some(self.rate_of(servo.inertial_number?, pressure) * self.depth_of_bed(self.walls[number].surface))
    }

    /// How far grains reach along the normal of a plane, or from the axis of a cylinder, m.
    fn depth_of_bed(&self, surface: Surface) -> f64 {
        let ends = self.grains.iter().map(|grain| {
            let distance = surface.distance(grain.position);
            (distance - grain.radius, distance + grain.radius)
        });
        let (near, far) = ends.fold((f64::INFINITY, f64::NEG_INFINITY), |a, b| (a.0.min(b.0), a.1.max(b.1)));
        match surface {
            Surface::Plane { .. } => far - near,
            Surface::Cylinder { radius, .. } => radius - near,
        }
    }

    /// Which walls are pressed otherwise than their servos are asked for, in words. `walls`: where they are now,
    /// `normal_forces`: what presses on them, N.
    pub fn missed_forces(&self, walls: &[Wall], normal_forces: impl IntoIterator<Item = f64>) -> Vec<String> {
        let missed = |(number, found): (usize, f64)| {
            let wall = &self.walls[number];
            let target = self.target_force(number, walls)?;
            let words = match wall.servo?.target {
                _ if (found - target).abs() <= self.tolerance() * target => return None,
                Target::Force(force) => format!("target_force = {force:e} N was not reached: it is {found:.4e} N"),
                Target::Pressure(asked) => {
                    let pressure = asked * found / target;
                    format!("target_pressure = {asked:e} Pa was not reached: it is {pressure:.4e} Pa")
                }
            };
            Some(format!("wall \"{}\": {words}", wall.name))
        };
        normal_forces.into_iter().enumerate().filter_map(missed).collect()
    }

    /// How far the servo of a wall may move it from where it begins before it is plain that it will find nothing to press
    /// on, m: until it is where the farthest grain was, of a cylinder until the largest grain hardly fits in.
    pub fn longest_way(&self, number: usize) -> f64 {
        let surface = self.walls[number].surface;
        let largest = self.grains.iter().map(|grain| grain.radius).fold(0.0, f64::max);
        match surface {
            Surface::Plane { .. } => {
                self.grains.iter().map(|g| surface.distance(g.position) + g.radius).fold(largest, f64::max)
            }
            Surface::Cylinder { radius, .. } => radius - (1.0 + CLOSE) * largest,
        }
    }
}

/// What a servo can be asked for, of a wall called `key`.
pub fn check_servo(wall: &Wall, key: &str, check: &Check) -> Result<()> {
    let Some(servo) = &wall.servo else { return Ok(()) };
    let at = |field: &str| format!("{key}.{field}");
    let target = match servo.target {
        Target::Force(force) => {
            check.positive(&at("target_force"), force, " of N, of grains that press on the wall")?;
            "target_force"
        }
        Target::Pressure(pressure) => {
            let unit = " of Pa (N/m in two dimensions); compression is positive";
            check.positive(&at("target_pressure"), pressure, unit)?;
            "target_pressure"
        }
    };
    check.fraction(&at("gain"), servo.gain)?;
    match servo.inertial_number {
        Some(number) => check.positive(&at("inertial_number"), number, "")?,
        None => check.positive(&at("max_speed"), servo.max_speed, " of m/s")?,
    };
    if let Some(area) = servo.area {
        check.positive(&at("area"), area, " of m² (m in two dimensions)")?;
        if target == "target_force" && servo.inertial_number.is_none() {
            return Err(check.origin.wrong(&at("area"), "goes with target_pressure, or with inertial_number"));
        }
    }
    if check.rigid {
        return Err(check.origin.wrong(&at(target), "is for method = \"dem\" only"));
    }
    if wall.motion != Motion::default() {
        let message =
            "start, stop, oscillation, turning and table are not for a wall that a servo moves; a stage can change it";
        return Err(check.origin.wrong(&at(target), message));
    }
    match wall.surface {
        Surface::Cylinder { .. } if target == "target_force" => {
            Err(check.origin.wrong(&at(target), "is for planes; the radius of a cylinder has a target_pressure"))
        }
        Surface::Plane { normal, .. } if wall.velocity.dot(normal).abs() > ROUNDING * wall.velocity.length() => {
            let value = format!("[{}, {}, {}]", show(wall.velocity.x), show(wall.velocity.y), show(wall.velocity.z));
            let rule = format!("must be along the wall, because {target} moves it along its normal");
            Err(check.origin.bad(&at("velocity"), value, rule))
        }
        _ => Ok(()),
    }
}

/// Pressures act on areas, and inertial numbers follow from pressures.
pub fn check_areas(assembly: &Assembly, check: &Check) -> Result<()> {
    for (number, wall) in assembly.walls.iter().enumerate() {
        let has = match wall.servo {
            Some(Servo { target: Target::Pressure(_), .. }) => "a target_pressure",
            Some(Servo { inertial_number: Some(_), .. }) => "an inertial_number",
            _ => continue,
        };
        if assembly.area_of_wall(number).is_none() {
            let message = format!(
                "\"{}\" has {has}, and its area is not known: give `area`, in m² (m in two dimensions). It is known of a plane \
                 across an axis where, along every other one, the domain is periodic and keeps its length, or one plane faces one other; \
                 across z also inside of one cylinder; and of a cylinder between two such planes or periodic faces",
                wall.name
            );
            return Err(check.origin.wrong("wall", message));
        }
    }
    Ok(())
}

/// Where servos have an inertial number, the most of their speeds follows from it and from the grains.
pub fn limit_speeds(assembly: &mut Assembly, check: &Check) -> Result<()> {
    if assembly.walls.iter().any(|wall| wall.servo.is_some_and(|servo| servo.inertial_number.is_some())) {
        check_areas(assembly, check)?;
        let whole = assembly.whole();
        let speeds: Vec<Option<f64>> = (0..whole.walls.len()).map(|number| whole.speed_of_servo(number)).collect();
        for (wall, speed) in assembly.walls.iter_mut().zip(speeds) {
            wall.servo.iter_mut().zip(speed).for_each(|(servo, speed)| servo.max_speed = speed);
        }
    }
    Ok(())
}
