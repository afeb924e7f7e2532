//! Twin of `shaders/measure/synchronise_clumps.wgsl`: velocities and spins of clumps and their members at the time of
//! the positions.

use crate::{
    contact::contacts::change_clump_velocities,
    measure::contacts::{clump_velocity_change_now, contact_of},
    state::State,
};

pub fn synchronise_clumps(s: &mut State) {
    change_clump_velocities(s, contact_of, clump_velocity_change_now);
}
