//! Twin of `shaders/dem/half_kick_clumps.wgsl`: velocities of clumps and their members from time 0 to -1/2.

use crate::{
    body::{grains::spins_in_scene, rotation::half_kick_spin},
    contact::{contacts::set_clump_velocities, law::contact_of},
    dem::{
        leapfrog::half_kick_velocity,
        predictor_corrector::{own_torque, spin_acceleration},
    },
    state::{Spin, State},
};

pub fn half_kick_clumps(s: &mut State) {
    let before = s.clump_spin.clone();
    set_clump_velocities(s, contact_of, |s, _, here, sum| {
        let mut w = here.spin;
        if !spins_in_scene(&s.model, here.inverse_moments) {
            w = half_kick_spin(s, w, spin_acceleration(s, here, w, own_torque(here, sum.torque)));
        } else if here.velocity.inverse_mass != 0.0 {
            w = half_kick_spin(s, w, here.inverse_moments * sum.torque);
        }
        (half_kick_velocity(s, &here.velocity, sum.force), w)
    });
    for (gain, (before, now)) in s.spin_increment.iter_mut().zip(before.iter().zip(&s.clump_spin_next)) {
        *gain = Spin(2.0 * (before.0 - now.0)); // the step that the half step back is half of
    }
}
