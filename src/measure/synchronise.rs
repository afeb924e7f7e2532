//! Twin of `shaders/measure/synchronise.wgsl`: velocities and spins at the time of the positions.

use crate::{
    contact::contacts::change_all_velocities,
    measure::contacts::{contact_of, velocity_change_now},
    state::State,
};

pub fn synchronise(s: &mut State) {
    change_all_velocities(s, contact_of, velocity_change_now);
}
