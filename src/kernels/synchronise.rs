//! Twin of `shaders/synchronise.wgsl`: velocities and spins at the time of the positions.

use super::velocities;
use crate::{
    laws::{leapfrog::at_step, rotation::spin_at_step},
    state::State,
};

pub fn synchronise(s: &mut State) {
    velocities(s, |s, here, sum| (at_step(s, &here.motion, sum.force), spin_at_step(s, here, sum.torque)));
}
