//! Twin of `shaders/dem/half_kick.wgsl`: velocities from time 0 to -1/2.

use crate::{
    body::rotation::{sphere_spin_change, spin_change_back},
    contact::{contacts::change_all_velocities, law::contact_of},
    dem::leapfrog::velocity_change_back,
    state::State,
};

pub fn half_kick(s: &mut State) {
    change_all_velocities(s, contact_of, |s, here, sum| {
        let spin_change = sphere_spin_change(s, here, sum.torque, spin_change_back);
        (velocity_change_back(s, &here.velocity, sum.force), spin_change)
    });
}
