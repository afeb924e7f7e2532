//! Twin of `shaders/measure/synchronise.wgsl`: velocities and spins at the time of the positions.

use crate::contact::contacts::velocities;
use crate::measure::contacts::contact_of;
use crate::{measure::contacts::velocity_now, state::State};

pub fn synchronise(s: &mut State) {
    velocities(s, contact_of, velocity_now);
}
