//! Twin of `shaders/measure/add_works.wgsl`: a step's dissipation and works, before grains move.

use crate::{
    measure::body_sums::{add_to_works, sums_of_bodies},
    state::{HALTED, PartialSums, State},
};
use rayon::prelude::*;

pub fn add_works(s: &mut State) {
    if s.halt[0] < HALTED {
        let of_bodies = sums_of_bodies(s);
        add_up(s, &of_bodies);
    }
}

/// What the bodies have, in the order in which they lie in memory.
pub fn add_up(s: &mut State, of_bodies: &[PartialSums]) {
    let mut works = std::mem::take(&mut s.works);
    works.par_iter_mut().with_min_len(64).enumerate().for_each(|(number, works)| {
        let sum = &of_bodies[s.index_of_id[number] as usize];
        add_to_works(works, s.params.dt, sum.dissipation, sum.wall_power, sum.fixed_power);
    });
    s.works = works;
}
