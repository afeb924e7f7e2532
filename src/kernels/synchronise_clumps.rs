//! Twin of `shaders/synchronise_clumps.wgsl`: velocities and spins of clumps and their members at the time of the positions.

use crate::{
    laws::{
        grains::{clump, contacts_of_clump, set_motion, spin_of_clump_now},
        leapfrog::at_step,
    },
    state::State,
};

pub fn synchronise_clumps(s: &mut State) {
    for c in 0..s.sizes.clumps {
        let here = clump(s, c);
        let sum = contacts_of_clump(s, c, here.attitude);
        let (v, w) = (at_step(s, &here.motion, sum.force), spin_of_clump_now(s, c, &here, sum.torque));
        set_motion(s, c, &here, v, w);
    }
}
