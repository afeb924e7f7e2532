//! Twin of `shaders/half_kick.wgsl`: velocities from time 0 to -1/2.

use super::velocities;
use crate::{
    laws::{leapfrog::kicked, rotation::kicked_spin},
    state::State,
};

pub fn half_kick(s: &mut State) {
    velocities(s, |s, here, sum| (kicked(s, &here.motion, sum.force), kicked_spin(s, here, sum.torque)));
}
