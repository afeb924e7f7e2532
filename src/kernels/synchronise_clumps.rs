//! Twin of `shaders/synchronise_clumps.wgsl`: velocities and spins of clumps and their members at the time of the positions.

use crate::{
    laws::{
        grains::{set_motions, spin_of_clump_now},
        leapfrog::at_step,
    },
    state::State,
};

pub fn synchronise_clumps(s: &mut State) {
    set_motions(s, |s, c, here, sum| (at_step(s, &here.motion, sum.force), spin_of_clump_now(s, c, here, sum.torque)));
}
