//! Twin of `shaders/walls/`: planes and vertical cylinders.

use super::{
    Touch,
    dimension::{first_axis, from_horizontal, horizontal},
};
use crate::state::{State, Wall};
use glam::{DVec2, DVec3};

/// Unit vector from x + residue into the wall, and the distance, m.
pub fn wall_surface(wall: &Wall, x: DVec3, residue: DVec3) -> Touch {
    let d = (x - wall.point) + residue;
    if wall.radius == 0.0 {
        return Touch { gap: d.dot(wall.normal), n: -wall.normal };
    }
    let arm = horizontal(d);
    let distance = arm.length();
    if distance == 0.0 {
        return Touch { gap: wall.radius, n: first_axis() };
    }
    Touch { gap: wall.radius - distance, n: from_horizontal(arm / distance) }
}

/// Gap and normal from a grain to a wall.
pub fn touch_wall(wall: &Wall, x: DVec3, residue: DVec3, radius: f64) -> Touch {
    let surface = wall_surface(wall, x, residue);
    Touch { gap: surface.gap - radius, n: surface.n }
}

/// The contact normal one step ago, for the rotation Z of the spring.
pub fn wall_normal_before(s: &State, wall: &Wall, x_before: DVec3) -> DVec3 {
    wall_surface(wall, x_before + s.params.dt * wall.velocity, DVec3::ZERO).n
}

/// Velocity of the wall's material at a point of its surface, m/s.
pub fn wall_velocity(wall: &Wall, point: DVec3) -> DVec3 {
    let arm = horizontal(point) - horizontal(wall.point);
    wall.velocity + from_horizontal(wall.spin * DVec2::new(-arm.y, arm.x))
}
