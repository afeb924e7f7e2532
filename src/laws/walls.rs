//! Twin of `shaders/walls/`: planes and vertical cylinders.

use super::{
    Touch,
    dimension::{first_axis, from_horizontal, horizontal},
};
use crate::state::{Place, Residue, State, Wall};
use glam::{DVec2, DVec3};

/// Gap and normal from a grain to a wall.
pub fn touch_wall(wall: &Wall, here: &Place, residue: Residue) -> Touch {
    let d = here.x - wall.point;
    let rest = residue.x - wall.residue;
    if wall.radius == 0.0 {
        return Touch {
            gap: (d.dot(wall.normal) - here.radius) + (rest.dot(wall.normal) - residue.radius),
            n: -wall.normal,
        };
    }
    let arm = horizontal(d + rest);
    let distance = arm.length();
    if distance == 0.0 {
        return Touch { gap: wall.radius - here.radius, n: first_axis() };
    }
    Touch { gap: ((wall.radius - distance) - here.radius) - residue.radius, n: from_horizontal(arm / distance) }
}

/// The contact normal when the grain was at `x_before`, a step ago, for the rotation Z of the spring.
pub fn wall_normal_before(s: &State, wall: &Wall, x_before: DVec3) -> DVec3 {
    let place = Place { x: x_before + s.params.since * wall.velocity, radius: 0.0 };
    touch_wall(wall, &place, Residue::default()).n
}

/// Velocity of the wall's material at a point of its surface, m/s.
pub fn wall_velocity(wall: &Wall, point: DVec3) -> DVec3 {
    let arm = horizontal(point) - horizontal(wall.point);
    wall.velocity + from_horizontal(wall.spin * DVec2::new(-arm.y, arm.x))
}
