//! A step of the discrete element method, section 2.1. Before it positions are at n, velocities at n - 1/2, springs at
//! n - 1.

use super::*;
use crate::{
    body::plan::{exchange, exchange_velocities},
    model::{Boundary, Grains, Growth, Model},
    plan::*,
    space::{self, DEFORM_CELL},
};

/// Contact forces and leapfrog.
pub fn step(model: &Model) -> Plan {
    let clumps = model.grains == Grains::Clumps;
    plan([
        run(&DEFORM_CELL).when(model.boundary == Boundary::Deforming),
        plan([run(&ADVANCE), run(&ADVANCE_LARGE).when(model.large_grains)]).when(!clumps),
        plan([run(&MEMBER_FORCES), run(&INTEGRATE_CLUMPS), run(&PLACE_MEMBERS)]).when(clumps),
        plan([run(&MEASURE_GAIN), run(&RESTART), run(&DAMP)]).when(model.adaptive_damping),
        run(&GROW).when(model.growth == Growth::Some),
        space::motion(model),
        exchange(model),
    ])
}

/// Once, at time 0: velocities half a step back.
pub fn start(model: &Model) -> Plan {
    let clumps = model.grains == Grains::Clumps;
    plan([run(if clumps { &HALF_KICK_CLUMPS } else { &HALF_KICK }), exchange_velocities(model)])
}
