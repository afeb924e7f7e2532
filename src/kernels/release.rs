//! Twin of `shaders/release.wgsl`: velocities of clumps and their members at the end of the step if nothing touched.

use crate::{
    laws::{
        grains::{Clump, clump, count_rounds, set_motion},
        gyration::free_spin_of_clump,
        rigid::freed,
    },
    model::Gyration,
    state::State,
};
use rayon::prelude::*;

pub fn release(s: &mut State) {
    let free: Vec<_> = (0..s.sizes.clumps).into_par_iter().map(|c| free_spin_of_clump(s, &clump(s, c))).collect();
    for (c, free) in free.into_iter().enumerate() {
        let here = clump(s, c);
        let motion = freed(s, &here.motion);
        set_motion(s, c, &Clump { motion, ..here }, motion.v, free.spin);
        if s.model.gyration == Gyration::Kept {
            count_rounds(s, free.rounds, free.settled);
        }
    }
}
