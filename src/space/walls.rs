//! Twin of `shaders/space/walls/`: planes and vertical cylinders.

use crate::{
    space::{
        Separation,
        dimension::{first_axis, from_horizontal, horizontal, spin_squared, spin_velocity},
    },
    state::{Position, PositionLow, State, Wall},
};
use glam::{DVec2, DVec3};

/// Gap and normal from a grain to a wall.
pub fn wall_separation(wall: &Wall, here: &Position, low: PositionLow) -> Separation {
    let d = here.x - wall.point;
    let rest = low.x - wall.low;
    if wall.radius == 0.0 {
        let normal = wall.normal + wall.normal_low;
        let gap = (d.dot(normal) - here.radius) + (rest.dot(normal) - low.radius);
        return Separation { gap, n: -wall.normal };
    }
    let arm = horizontal(d + rest);
    let radius = wall.radius + wall.radius_low;
    Separation { gap: ((radius - arm.length()) - here.radius) - low.radius, n: outward(arm) }
}

/// Whether the centre of a grain is further beyond a wall than any impact of the scene drives it.
#[inline(always)]
pub fn is_crossed(s: &State, gap: f64, radius: f64) -> bool {
    gap < -radius - s.params.wall_depth
}

/// The direction from the axis to the end of an arm.
fn outward(arm: DVec2) -> DVec3 {
    let distance = arm.length();
    if distance == 0.0 { first_axis() } else { from_horizontal(arm / distance) }
}

/// The contact normal when the grain was at `x_before`, a step ago, for the rotation Z of the spring.
pub fn wall_normal_before(s: &State, wall: &Wall, x_before: DVec3) -> DVec3 {
    if wall.radius == 0.0 {
        if spin_squared(wall.spin.0) == 0.0 {
            return -wall.normal;
        }
        let before = wall.normal - s.params.history_dt * spin_velocity(wall.spin.0, wall.normal);
        return -before / before.length();
    }
    outward(horizontal(x_before + s.params.history_dt * wall.velocity - wall.point))
}

/// Velocity of the wall's material at a point of its surface, m/s.
pub fn wall_velocity(wall: &Wall, point: DVec3) -> DVec3 {
    wall.velocity + spin_velocity(wall.spin.0, point - wall.point)
}

/// The spin of a grain relative to the wall, rad/s.
pub fn relative_to_wall(spin: DVec3, wall: &Wall) -> DVec3 {
    spin - wall.spin.0
}
