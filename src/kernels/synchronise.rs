//! Twin of `shaders/synchronise.wgsl`: velocities and spins at the time of the positions.

use super::velocities;
use crate::{laws::contact::motion_now, state::State};

pub fn synchronise(s: &mut State) {
    velocities(s, motion_now);
}
