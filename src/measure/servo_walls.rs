//! Twin of `shaders/measure/servo_walls.wgsl`: the servo of walls, which brings what presses on them to a target.

use super::measure_for_servo::is_due;
use crate::{
    model::Dimension,
    state::{NONE, State, WallLoad, WallServo},
};

pub fn servo_walls(s: &mut State) {
    if !is_due(s) {
        return;
    }
    for w in (0..s.sizes.walls).filter(|w| s.wall[*w].driven != 0).collect::<Vec<_>>() {
        drive(s, w);
    }
}

fn drive(s: &mut State, w: usize) {
    let now = pressing(s, w);
    let servo = s.wall_servo[w];
    let missing = target(s, w) - now.normal_force;
    let speed = (missing / resistance(s, w, &now)).clamp(-servo.most_speed, servo.most_speed);
    let wall = &mut s.wall[w];
    if wall.radius == 0.0 {
        wall.velocity_next = servo.along + speed * wall.normal;
        return;
    }
    let least = if wall.radius <= servo.least_radius { 0.0 } else { -servo.most_speed };
    wall.growth_next = (-speed).max(least);
}

/// What presses on a wall.
pub fn pressing(s: &State, w: usize) -> WallLoad {
    let rows = s.wall_load_sums.iter().skip(w).step_by(s.sizes.walls);
    let add = |sum: WallLoad, row: &WallLoad| WallLoad {
        normal_force: sum.normal_force + row.normal_force,
        stiffness: sum.stiffness + row.stiffness,
        ..sum
    };
    rows.fold(WallLoad::default(), add)
}

/// Force over speed, N s/m.
pub fn resistance(s: &State, w: usize, now: &WallLoad) -> f64 {
    s.wall_servo[w].time * now.stiffness.max(s.wall_servo[w].least_stiffness)
}

/// N
pub fn target(s: &State, w: usize) -> f64 {
    let servo = &s.wall_servo[w];
    servo.force + servo.pressure * area_of(s, servo)
}

fn area_of(s: &State, servo: &WallServo) -> f64 {
    let breadth = servo.factor * wall_distance(s, servo.breadth, servo.breadth_from, servo.breadth_to);
    match s.model.dimension {
        Dimension::Plane => breadth,
        Dimension::Space => breadth * wall_distance(s, servo.depth, servo.depth_from, servo.depth_to),
    }
}

/// A length, or how far it is from one wall to another.
fn wall_distance(s: &State, length: f64, begin: u32, end: u32) -> f64 {
    if begin == NONE {
        return length;
    }
    let (a, b) = (&s.wall[begin as usize], &s.wall[end as usize]);
    match begin == end {
        true => a.radius + a.radius_low,
        false => ((b.point - a.point) + (b.low - a.low)).dot(a.normal),
    }
}
