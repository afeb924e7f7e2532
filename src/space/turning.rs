//! Twin of `shaders/space/turning/`: how walls that turn move, and others.

use crate::{
    model::Turning,
    space::{
        dimension::{horizontal, spin_squared, spin_velocity},
        walls::outward,
    },
    state::{State, Wall},
};
use glam::DVec3;

/// The contact normal when the grain was at `x_before`, a step ago, for the rotation Z of the spring.
pub fn wall_normal_before(s: &State, wall: &Wall, x_before: DVec3) -> DVec3 {
    if wall.radius == 0.0 {
        if s.model.turning == Turning::None || spin_squared(wall.spin.0) == 0.0 {
            return -wall.normal;
        }
        let before = wall.normal - s.params.history_dt * spin_velocity(wall.spin.0, wall.normal);
        return -before / before.length();
    }
    outward(horizontal(x_before + s.params.history_dt * wall.velocity - wall.point))
}

/// Velocity of the wall's material at a point of its surface, m/s.
pub fn wall_velocity(s: &State, wall: &Wall, point: DVec3) -> DVec3 {
    match s.model.turning {
        Turning::None => wall.velocity,
        Turning::Some => {
            let v = wall.velocity + spin_velocity(wall.spin.0, point - wall.point);
            if wall.growth == 0.0 { v } else { v + wall.growth * outward(horizontal(point - wall.point)) }
        }
    }
}

/// The spin of a grain relative to the wall, rad/s.
pub fn relative_to_wall(s: &State, spin: DVec3, wall: &Wall) -> DVec3 {
    match s.model.turning {
        Turning::None => spin,
        Turning::Some => spin - wall.spin.0,
    }
}
