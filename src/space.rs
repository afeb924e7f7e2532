//! Space: dimension, boundaries, walls, and how single precision keeps positions.

pub mod boundary;
pub mod deform_cell;
pub mod dimension;
mod guide_walls;
mod move_walls;
pub mod precision;
pub mod turning;
pub mod walls;

use crate::{
    model::Model,
    plan::{Plan, plan, run},
    stage::*,
    state::{State, Wall, array},
};

/// The periodic cell.
pub static DEFORM_CELL: Stage = Stage::new("space", "deform_cell", deform_cell::deform_cell, |_| 1);

/// Moving walls.
pub static MOVE_WALLS: Stage = Stage {
    check: Check { floors: &[(&[&array::WALL], largest_wall_displacement)], ..Check::ROUNDING },
    ..Stage::new("space", "move_walls", move_walls::move_walls, |sizes| sizes.walls)
};

/// Walls that move as the host says.
pub static GUIDE_WALLS: Stage = Stage {
    check: Check { floors: &[(&[&array::WALL], largest_wall_displacement)], ..Check::ROUNDING },
    ..Stage::new("space", "guide_walls", guide_walls::guide_walls, |sizes| sizes.walls)
};

/// Walls to the end of the step.
pub fn motion(model: &Model) -> Plan {
    plan([run(&MOVE_WALLS).when(model.moving_walls && !model.guided_walls), run(&GUIDE_WALLS).when(model.guided_walls)])
}

/// A low part is what is left of a step, m, when whole quanta are taken off.
fn largest_wall_displacement(s: &State) -> f64 {
    let step = |wall: &Wall| s.params.dt * wall.velocity.length().max(wall.growth.abs());
    s.wall.iter().map(step).fold(s.params.quantum, f64::max)
}
