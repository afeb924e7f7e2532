//! Twin of `shaders/nscd/move_clumps.wgsl`: centres and attitudes n to n + 1 with the velocities n + 1.

use crate::{
    body::grains::{Moved, clump},
    nscd::response::impulse_response,
    state::State,
};
use rayon::prelude::*;

pub fn move_clumps(s: &mut State) {
    let of = |c| {
        let here = clump(s, c);
        let pushed = impulse_response(s, c, &here);
        let free = (s.clump_velocity_next[c].v, s.clump_spin_next[c].0); // since `free_velocities`
        Moved::of(s, c, &here, free.0 + pushed.v, free.1 + pushed.spin)
    };
    let next: Vec<Moved> = (0..s.sizes.clumps).into_par_iter().with_min_len(64).map(of).collect();
    next.into_iter().enumerate().for_each(|(c, moved)| moved.store(s, c));
}
