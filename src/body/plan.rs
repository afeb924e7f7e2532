//! What comes next becomes what is.

use crate::{
    model::Model,
    plan::{Plan, plan, swap},
    state::array::*,
};

/// For bodies; a sort moves them alone.
pub fn exchange_bodies(model: &Model) -> Plan {
    swap(
        model,
        [
            (&POSITION, &POSITION_NEXT),
            (&POSITION_LOW, &POSITION_LOW_NEXT),
            (&VELOCITY, &VELOCITY_NEXT),
            (&SPIN, &SPIN_NEXT),
            (&VELOCITY_LOW, &VELOCITY_LOW_NEXT),
        ],
    )
}

/// For bodies, clumps and the cell, at the end of a step; and whether later steps are halted.
pub fn exchange(model: &Model) -> Plan {
    let clumps = [
        (&CENTER, &CENTER_NEXT),
        (&CENTER_LOW, &CENTER_LOW_NEXT),
        (&ORIENTATION, &ORIENTATION_NEXT),
        (&ORIENTATION_LOW, &ORIENTATION_LOW_NEXT),
        (&ORIENTATION_REST, &ORIENTATION_REST_NEXT),
        (&CLUMP_VELOCITY, &CLUMP_VELOCITY_NEXT),
        (&CLUMP_SPIN, &CLUMP_SPIN_NEXT),
        (&CLUMP_VELOCITY_LOW, &CLUMP_VELOCITY_LOW_NEXT),
    ];
    let rest = [(&CELL, &CELL_NEXT), (&GROWTH_RATE, &GROWTH_RATE_NEXT), (&HALT, &HALT_NEXT)];
    plan([exchange_bodies(model), swap(model, clumps), swap(model, rest)])
}

/// Velocities alone.
pub fn exchange_velocities(model: &Model) -> Plan {
    swap(
        model,
        [
            (&VELOCITY, &VELOCITY_NEXT),
            (&SPIN, &SPIN_NEXT),
            (&VELOCITY_LOW, &VELOCITY_LOW_NEXT),
            (&CLUMP_VELOCITY, &CLUMP_VELOCITY_NEXT),
            (&CLUMP_SPIN, &CLUMP_SPIN_NEXT),
            (&CLUMP_VELOCITY_LOW, &CLUMP_VELOCITY_LOW_NEXT),
        ],
    )
}
