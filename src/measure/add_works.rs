//! Twin of `shaders/measure/add_works.wgsl`: a step's dissipation and works, before grains move.

use crate::{
    measure::body_sums::{add_to_works, sums_of_bodies},
    space::boundary::flow_power,
    state::{HALTED, PartialSums, State, Works},
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
    works[..s.sizes.bodies].par_iter_mut().with_min_len(64).enumerate().for_each(|(number, works)| {
        let sum = &of_bodies[s.index_of_id[number] as usize];
        let powers = Works {
            dissipated: sum.dissipation,
            walls: sum.wall_power,
            fixed: sum.fixed_power,
            growth: sum.growth_power,
            cell: flow_power(s, sum.virial - sum.flux, sum.virial_above.0 - sum.flux_above.0),
        };
        add_to_works(works, s.params.dt, &powers);
    });
    s.works = works;
}
