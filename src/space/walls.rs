//! Twin of `shaders/space/walls/`: planes and vertical cylinders.

use crate::{
    space::{
        dimension::{Separation, first_axis, from_horizontal, horizontal},
        precision::{Point, displaced, requantised},
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
pub fn outward(arm: DVec2) -> DVec3 {
    let distance = arm.length();
    if distance == 0.0 { first_axis() } else { from_horizontal(arm / distance) }
}

/// A wall after a step with its velocity, of a cylinder also that of its radius. Those of a servo are taken over here, not
/// before, because contacts in the step see how the wall has come to where it is.
pub fn moved(s: &State, before: &Wall) -> Wall {
    let mut next = *before;
    if before.driven != 0 {
        (next.velocity, next.growth) = (before.velocity_next, before.growth_next);
    }
    let start = requantised(s, Point { x: before.point, low: before.low });
    let point = displaced(s, start.x, start.low, s.params.dt * next.velocity);
    (next.point, next.low) = (point.x, point.low);
    if before.driven != 0 && before.radius != 0.0 {
        let radius = requantised(s, Point { x: DVec3::splat(before.radius), low: DVec3::splat(before.radius_low) });
        let grown = displaced(s, radius.x, radius.low, DVec3::splat(s.params.dt * next.growth));
        (next.radius, next.radius_low) = (grown.x.x, grown.low.x);
    }
    next
}
