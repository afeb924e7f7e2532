//! Walls that a servo moves until grains press on them with a target force or pressure.

use super::check::Check;
use super::schema::{self, WallKind};
use crate::Result;

/// The servo of a plane, which it moves along the normal, or of the radius of a cylinder.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Servo {
    pub target: Target,
    /// m² (m in two dimensions), that a pressure acts on. None: what other walls and periodic faces leave of the wall.
    pub area: Option<f64>,
    /// Part of a missing force that the servo adds in a step if nothing but the contacts at the wall gives way.
    pub gain: f64,
    /// m/s, most of its speed.
    pub max_speed: f64,
    /// Of the bed at that speed, from which a scene file has it: it follows when grains are known, until then it is 0.
    pub inertial_number: Option<f64>,
}

/// What free grains are to do to the wall along its normal, dashpots and friction included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Target {
    /// N
    Force(f64),
    /// Pa (N/m in two dimensions)
    Pressure(f64),
}

/// Part of a missing force that a servo of a wall adds in a step, if nothing else is said.
pub const GAIN: f64 = 1e-2;

/// What a wall of the scene file, called `key`, is asked for.
pub fn servo(wall: &schema::Wall, key: &str, check: &Check) -> Result<Option<Servo>> {
    let wrong = |field: &str, message: &str| Err(check.origin.wrong(&format!("{key}.{field}"), message));
    let target = match (wall.target_force, wall.target_pressure) {
        (Some(force), None) => Target::Force(force),
        (None, Some(pressure)) => Target::Pressure(pressure),
        (Some(_), Some(_)) => return wrong("target_pressure", "target_force is given, too; one of them has to go"),
        (None, None) => {
            let own = [
                ("area", wall.area),
                ("gain", wall.gain),
                ("max_speed", wall.max_speed),
                ("inertial_number", wall.inertial_number),
            ];
            return match own.iter().find(|(_, given)| given.is_some()) {
                Some((field, _)) => wrong(field, "goes with target_force or target_pressure"),
                None => Ok(None),
            };
        }
    };
    if wall.kind == WallKind::Box && wall.area.is_some() {
        return wrong("area", "is for planes and cylinders; give the faces of the box as planes");
    }
    match (wall.max_speed, wall.inertial_number) {
        (None, None) => {
            let message = "missing key `max_speed` (m/s) or `inertial_number`: the most that the servo of target_force or target_pressure \
                 makes of its speed";
            return Err(check.origin.wrong(key, message));
        }
        (Some(_), Some(_)) => return wrong("inertial_number", "max_speed is given, too; one of them has to go"),
        _ => {}
    }
    Ok(Some(Servo {
        target,
        area: wall.area,
        gain: wall.gain.unwrap_or(GAIN),
        max_speed: wall.max_speed.unwrap_or(0.0),
        inertial_number: wall.inertial_number,
    }))
}
