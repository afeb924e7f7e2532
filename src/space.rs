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
    state::{Cell, Element, Spin, State, Wall, array},
};

use glam::DVec3;

/// The periodic cell.
pub static DEFORM_CELL: Stage = Stage {
    check: Check { member_floors: &[(&array::CELL_NEXT, floors_of_cell)], ..Check::ROUNDING },
    ..Stage::new("space", "deform_cell", deform_cell::deform_cell, |_| 1)
};

/// Low parts are what is left of a step, m, when whole quanta are taken off; a tilt may be no more than that.
fn floors_of_cell(s: &State) -> Vec<f64> {
    let (p, cell) = (&s.params, &s.cell[0]);
    let step = (p.dt * cell.largest_rate * cell.length.max_element()).max(p.quantum);
    let parts = |floor: f64| DVec3::splat(floor);
    let floors = Cell {
        length_low: parts(step),
        tilt: Spin(parts(step)),
        tilt_low: Spin(parts(step)),
        stretch_tilt: Spin(parts(step / cell.length.max_element())),
        ..Cell::default()
    };
    floors.lanes(s.model.dims())
}

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
