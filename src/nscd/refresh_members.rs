//! Twin of `shaders/nscd/refresh_members.wgsl`: the velocities of members freed of the rounding that passes
//! have left in them, and the loads of the whole clump.

use crate::{
    body::grains::{clump, member_ids},
    nscd::{
        contact::remove_rounding,
        response::{clump_velocities, impulse_response, member_velocity},
    },
    state::State,
};

pub fn refresh_members(s: &mut State) {
    for (c, of_clump) in clump_velocities(s, impulse_response).iter().enumerate() {
        let here = clump(s, c);
        let loads = member_ids(s, c).map(|member_id| s.load_speed[s.index_of_id[member_id] as usize]).sum();
        for member_id in member_ids(s, c) {
            let velocity = member_velocity(s, &here, of_clump, member_id);
            let i = s.index_of_id[member_id] as usize;
            remove_rounding(s, i, velocity, of_clump.spin);
            s.load_speed[i] = loads;
        }
    }
}
