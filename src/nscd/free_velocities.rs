//! Twin of `shaders/nscd/free_velocities.wgsl`: by how much the velocities of clumps would change in the step if nothing
//! touched.

use crate::{
    body::grains::{clump, count_iterations},
    nscd::{
        contact::{damping_factor, free_velocity_change},
        gyroscopic::free_spin_change_of_clump,
    },
    state::{Spin, State, Velocity},
};
use rayon::prelude::*;

pub fn free_velocities(s: &mut State) {
    let changes: Vec<_> =
        (0..s.sizes.clumps).into_par_iter().map(|c| free_spin_change_of_clump(s, &clump(s, c))).collect();
    for (c, change) in changes.into_iter().enumerate() {
        let now = s.clump_velocity[c];
        s.clump_velocity_next[c] =
            Velocity { v: free_velocity_change(s, &now), inverse_mass: damping_factor(s) * now.inverse_mass };
        s.clump_spin_next[c] = Spin(change.spin);
        count_iterations(s, change.rounds, change.settled);
    }
}
