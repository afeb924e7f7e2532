//! Twin of `shaders/nscd/coloring/count_large_contacts.wgsl`: how many contacts that have no colour a grain takes part in.

use crate::{
    nscd::{contact::active_entries, relax_large::joins_large, response::standing_for},
    state::State,
};

pub fn count_large_contacts(s: &mut State) {
    for i in 0..s.sizes.bodies {
        let contacts = active_entries(s, i).filter(|&entry| joins_large(s, i, entry)).count();
        let body = standing_for(s, i);
        s.large_contacts[body] += contacts as u32;
    }
}
