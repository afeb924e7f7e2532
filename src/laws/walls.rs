//! Twin of `shaders/walls/`: planes and vertical cylinders.

use super::{
    Touch,
    dimension::{first_axis, from_horizontal, horizontal},
};
use crate::state::{State, Wall};
use glam::{DVec2, DVec3};

/// Gap and normal from a grain to a wall.
pub fn touch_wall(wall: &Wall, x: DVec3, residue: DVec3, radius: f64) -> Touch {
    let d = x - wall.point;
    let rest = residue - wall.residue;
    if wall.radius == 0.0 {
        return Touch { gap: (d.dot(wall.normal) - radius) + rest.dot(wall.normal), n: -wall.normal };
    }
    let arm = horizontal(d + rest);
    let distance = arm.length();
    if distance == 0.0 {
        return Touch { gap: wall.radius - radius, n: first_axis() };
    }
    Touch { gap: (wall.radius - distance) - radius, n: from_horizontal(arm / distance) }
}

/// The contact normal when the grain was at `x_before`, a step ago, for the rotation Z of the spring.
pub fn wall_normal_before(s: &State, wall: &Wall, x_before: DVec3) -> DVec3 {
    touch_wall(wall, x_before + s.params.since * wall.velocity, DVec3::ZERO, 0.0).n
}

/// Velocity of the wall's material at a point of its surface, m/s.
pub fn wall_velocity(wall: &Wall, point: DVec3) -> DVec3 {
    let arm = horizontal(point) - horizontal(wall.point);
    wall.velocity + from_horizontal(wall.spin * DVec2::new(-arm.y, arm.x))
}
