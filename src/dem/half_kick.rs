//! Twin of `shaders/dem/half_kick.wgsl`: velocities from time 0 to -1/2.

use crate::contact::{contacts::velocities, law::contact_of};
use crate::{body::rotation::half_kick_sphere_spin, dem::leapfrog::half_kick_velocity, state::State};

pub fn half_kick(s: &mut State) {
    velocities(s, contact_of, |s, here, sum| {
        (half_kick_velocity(s, &here.velocity, sum.force), half_kick_sphere_spin(s, here, sum.torque))
    });
}
