//! Twin of `shaders/synchronise_clumps.wgsl`: velocities and spins of clumps and their members at the time of the positions.

use crate::{
    laws::grains::{clump_motion_now, set_motions},
    state::State,
};

pub fn synchronise_clumps(s: &mut State) {
    set_motions(s, clump_motion_now);
}
