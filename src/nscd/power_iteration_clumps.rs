//! Twin of `shaders/nscd/power_iteration_clumps.wgsl`: the impulses that their members hold alone give clumps
//! velocities.

use crate::nscd::clump_response::set_member_velocities;
use crate::{
    body::grains::clump,
    nscd::{
        contact::store_clump_residual_sums,
        response::{clump_kinetic_metric, clump_velocities, extrapolated_clump, impulse_response},
    },
    state::{ResidualSums, State},
};

pub fn power_iteration_clumps(s: &mut State) {
    store_clump_residual_sums(s, power_iteration_of_clump);
    set_member_velocities(s, &clump_velocities(s, impulse_response), |s| (&mut s.pass_velocity, &mut s.pass_spin));
}

fn power_iteration_of_clump(s: &State, c: usize) -> ResidualSums {
    let here = clump(s, c);
    let start = extrapolated_clump(s, c, &here);
    ResidualSums { curvature: clump_kinetic_metric(s, &here, &start, &start), ..ResidualSums::default() }
}
