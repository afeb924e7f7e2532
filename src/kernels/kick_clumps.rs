//! Twin of `shaders/kick_clumps.wgsl`: velocities of clumps and their members from time 0 to -1/2.

use crate::{
    laws::{
        grains::{clump, contacts_of_clump, is_round, own_torque, set_motion, spin_acceleration},
        leapfrog::kicked,
        rotation::spun_back,
    },
    state::{Spin, State},
};

pub fn kick_clumps(s: &mut State) {
    for c in 0..s.sizes.clumps {
        let here = clump(s, c);
        let sum = contacts_of_clump(s, c, here.attitude);
        let mut w = here.spin;
        if !is_round(s, &here) {
            let acceleration = spin_acceleration(s, &here, w, own_torque(&here, sum.torque));
            w -= 0.5 * s.params.dt * acceleration;
            s.spin_gain[c] = Spin(s.params.dt * acceleration);
        } else if here.motion.inverse_mass != 0.0 {
            w = spun_back(s, w, here.inverse_moments * sum.torque);
        }
        let v = kicked(s, &here.motion, sum.force);
        set_motion(s, c, &here, v, w);
    }
}
