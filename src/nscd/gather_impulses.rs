//! Twin of `shaders/nscd/gather_impulses.wgsl`: velocities freed of the rounding that the updates in place have left in
//! them; members of clumps hold what `refresh_members` needs for that.

use crate::{
    body::ForceTorque,
    model::Grains,
    nscd::{
        contact::{active_entries, impulse_sum, remove_rounding},
        response::{largest_response, response, store_member_load},
    },
    state::State,
};
use rayon::prelude::*;

pub fn gather_impulses(s: &mut State) {
    let sums: Vec<ForceTorque> =
        (0..s.sizes.bodies).into_par_iter().map(|i| impulse_sum(s, active_entries(s, i))).collect();
    for i in 0..s.sizes.bodies {
        let load: f64 = active_entries(s, i).map(|entry| s.impulse[entry].0.length()).sum();
        s.load_speed[i] = load * largest_response(s, i).tangential;
    }
    match s.model.grains {
        Grains::Spheres => sums.iter().enumerate().for_each(|(i, sum)| {
            let (velocity, spin) = response(s, i, sum);
            remove_rounding(s, i, velocity, spin);
        }),
        Grains::Clumps => store_member_load(s, sums.into_iter()),
    }
}
