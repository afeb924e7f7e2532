//! Twin of `shaders/measure/add_works.wgsl`: a step's dissipation and works, before grains move.

use crate::{
    measure::body_sums::{add_body, add_to_works},
    state::{HALTED, PartialSums, State},
};
use rayon::prelude::*;

pub fn add_works(s: &mut State) {
    if s.halt[0] >= HALTED {
        return;
    }
    let mut works = std::mem::take(&mut s.works);
    works.par_iter_mut().with_min_len(64).enumerate().for_each(|(number, works)| {
        let mut sum = PartialSums::default();
        add_body(s, s.index_of_id[number] as usize, &mut sum);
        add_to_works(works, s.params.dt, sum.dissipation, sum.wall_power, sum.fixed_power);
    });
    s.works = works;
}
