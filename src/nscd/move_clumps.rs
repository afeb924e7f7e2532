//! Twin of `shaders/nscd/move_clumps.wgsl`: centres and attitudes n to n + 1 with the velocities n + 1.

use crate::{
    body::grains::{Moved, clump},
    nscd::response::clump_response_of,
    state::State,
};
use rayon::prelude::*;

pub fn move_clumps(s: &mut State) {
    let of = |c| {
        let here = clump(s, c);
        let velocity = clump_response_of(s, c, &here);
        Moved::of(s, c, &here, velocity.v, velocity.spin)
    };
    let next: Vec<Moved> = (0..s.sizes.clumps).into_par_iter().with_min_len(64).map(of).collect();
    next.into_iter().enumerate().for_each(|(c, moved)| moved.store(s, c));
}
