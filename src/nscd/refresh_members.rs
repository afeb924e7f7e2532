//! Twin of `shaders/nscd/refresh_members.wgsl`: the velocities of members freed of the rounding that the updates in
//! place have left in them.

use crate::{
    body::grains::{clump, member_ids},
    nscd::{
        contact::remove_rounding,
        response::{clump_response_of, clump_velocities, member_velocity},
    },
    state::State,
};

pub fn refresh_members(s: &mut State) {
    for (c, of_clump) in clump_velocities(s, clump_response_of).iter().enumerate() {
        let here = clump(s, c);
        for member_id in member_ids(s, c) {
            let velocity = member_velocity(s, &here, of_clump, member_id);
            remove_rounding(s, s.index_of_id[member_id] as usize, velocity, of_clump.spin);
        }
    }
}
