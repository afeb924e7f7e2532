//! Twin of `shaders/nscd/member_impulses.wgsl`: members hand over the impulses that a step ends with.

use crate::{
    body::ForceTorque,
    contact::history::set_active,
    nscd::{
        compliance::remember_spring,
        contact::{impulse_sum, list_entries},
        response::store_member_load,
    },
    state::State,
};
use glam::DVec3;
use rayon::prelude::*;

pub fn member_impulses(s: &mut State) {
    s.counters[0].steps_done += 1;
    let sums: Vec<ForceTorque> =
        (0..s.sizes.bodies).into_par_iter().map(|i| impulse_sum(s, list_entries(s, i))).collect();
    store_member_load(s, sums.into_iter());
    for i in 0..s.sizes.bodies {
        for entry in list_entries(s, i).collect::<Vec<_>>() {
            set_active(&mut s.neighbour[entry], s.impulse[entry].0 != DVec3::ZERO);
            remember_spring(s, entry);
        }
    }
}
