//! Twin of `shaders/nscd/free_velocities.wgsl`: velocities of clumps and their members at the end of the step if
//! nothing touched.

use crate::{
    body::{
        bodies::Velocities,
        grains::{clump, count_iterations, set_clump_velocity},
    },
    nscd::{contact::free_velocity, gyroscopic::free_spin_change_of_clump},
    state::{Spin, State, VelocityLow},
};
use rayon::prelude::*;

pub fn free_velocities(s: &mut State) {
    let changes: Vec<_> =
        (0..s.sizes.clumps).into_par_iter().map(|c| free_spin_change_of_clump(s, &clump(s, c))).collect();
    for (c, change) in changes.into_iter().enumerate() {
        let here = clump(s, c);
        let free = Velocities {
            velocity: free_velocity(s, &here.velocity),
            spin: Spin(here.spin + change.spin),
            low: VelocityLow::default(),
        };
        set_clump_velocity(s, c, &here, free);
        count_iterations(s, change.rounds, change.settled);
    }
}
