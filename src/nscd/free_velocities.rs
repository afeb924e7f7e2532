//! Twin of `shaders/nscd/free_velocities.wgsl`: velocities of clumps and their members at the end of the step if
//! nothing touched.

use crate::{
    body::grains::{Clump, clump, count_iterations, set_clump_velocity},
    model::Gyroscopic,
    nscd::{contact::free_velocity, gyroscopic::free_spin_of_clump},
    state::State,
};
use rayon::prelude::*;

pub fn free_velocities(s: &mut State) {
    let free: Vec<_> = (0..s.sizes.clumps).into_par_iter().map(|c| free_spin_of_clump(s, &clump(s, c))).collect();
    for (c, free) in free.into_iter().enumerate() {
        let here = clump(s, c);
        let velocity = free_velocity(s, &here.velocity);
        set_clump_velocity(s, c, &Clump { velocity, ..here }, velocity.v, free.spin);
        if s.model.gyroscopic == Gyroscopic::Kept {
            count_iterations(s, free.rounds, free.settled);
        }
    }
}
