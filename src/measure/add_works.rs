//! Twin of `shaders/measure/add_works.wgsl`: a step's dissipation and works, before grains move.

use crate::{
    measure::body_sums::{add_to_works, sums_of_bodies},
    state::{HALTED, State},
};
use rayon::prelude::*;

pub fn add_works(s: &mut State) {
    if s.halt[0] >= HALTED {
        return;
    }
    let of_bodies = sums_of_bodies(s);
    let mut works = std::mem::take(&mut s.works);
    works.par_iter_mut().with_min_len(64).enumerate().for_each(|(number, works)| {
        let sum = &of_bodies[s.index_of_id[number] as usize];
        add_to_works(works, s.params.dt, sum.dissipation, sum.wall_power, sum.fixed_power);
    });
    s.works = works;
}
