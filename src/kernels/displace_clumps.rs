//! Twin of `shaders/displace_clumps.wgsl`: centres and attitudes n to n + 1 with the velocities n + 1.

use crate::{
    laws::{
        answer::pushed_on,
        grains::{Moved, clump, gathered_by_clump},
    },
    state::State,
};
use rayon::prelude::*;

pub fn displace_clumps(s: &mut State) {
    let of = |c| {
        let here = clump(s, c);
        let push = pushed_on(s, &here, &gathered_by_clump(s, c, here.attitude));
        Moved::of(s, c, &here, s.clump_motion_next[c].v + push.0, s.clump_spin_next[c].0 + push.1)
    };
    let next: Vec<Moved> = (0..s.sizes.clumps).into_par_iter().with_min_len(64).map(of).collect();
    next.into_iter().enumerate().for_each(|(c, moved)| moved.keep(s, c));
}
