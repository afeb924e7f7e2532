//! What is looked at between two steps.

use super::*;
use crate::{
    model::{Grains, Model, Walls},
    plan::*,
    state::array::WORKS,
};

/// Sums for a row of the history.
pub fn sums(model: &Model) -> Plan {
    plan([run(&MEASURE), run(&MEASURE_CLUMPS).when(model.grains == Grains::Clumps)])
}

/// What grains do to walls, for the same.
pub fn wall_loads(model: &Model) -> Plan {
    plan([run(&WALL_LOADS), run(&ADD_WALL_LOADS)]).when(model.walls == Walls::Some)
}

/// Dissipation and works of a step, before it.
pub fn works(model: &Model) -> Plan {
    plan([run(&ADD_WORKS), run(&ADD_WORKS_OF_CLUMPS).when(model.grains == Grains::Clumps)]).when(model.works)
}

/// The servos of the cell and of walls, before a step.
pub fn servo(model: &Model) -> Plan {
    plan([
        plan([run(&MEASURE_FOR_SERVO), run(&SERVO)]).when(model.servo),
        plan([run(&WALL_LOADS_FOR_SERVO), run(&SERVO_WALLS)]).when(model.driven_walls),
    ])
}

/// Their sums, once the host has them.
pub fn forget_works(model: &Model) -> Plan {
    clear([&WORKS]).when(model.works)
}

/// Velocities at step n, in `velocity_next` and `spin_next`.
pub fn velocities(model: &Model) -> Plan {
    run(if model.grains == Grains::Clumps { &SYNCHRONISE_CLUMPS } else { &SYNCHRONISE })
}

/// Contact forces and moments.
pub fn forces() -> Plan {
    run(&CONTACT_FORCES)
}
