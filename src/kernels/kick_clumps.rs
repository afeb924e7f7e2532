//! Twin of `shaders/kick_clumps.wgsl`: velocities of clumps and their members from time 0 to -1/2.

use crate::{
    laws::{
        grains::{set_motions, spins_in_scene},
        leapfrog::kicked,
        predictor_corrector::{own_torque, spin_acceleration},
        rotation::spun_back,
    },
    state::{Spin, State},
};

pub fn kick_clumps(s: &mut State) {
    let before = s.clump_spin.clone();
    set_motions(s, |s, _, here, sum| {
        let mut w = here.spin;
        if !spins_in_scene(&s.model, here.inverse_moments) {
            w = spun_back(s, w, spin_acceleration(s, here, w, own_torque(here, sum.torque)));
        } else if here.motion.inverse_mass != 0.0 {
            w = spun_back(s, w, here.inverse_moments * sum.torque);
        }
        (kicked(s, &here.motion, sum.force), w)
    });
    for (gain, (before, now)) in s.spin_gain.iter_mut().zip(before.iter().zip(&s.clump_spin_next)) {
        *gain = Spin(2.0 * (before.0 - now.0)); // the step that the half step back is half of
    }
}
