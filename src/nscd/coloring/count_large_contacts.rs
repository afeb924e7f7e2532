//! Twin of `shaders/nscd/coloring/count_large_contacts.wgsl`: how many contacts that have no colour a grain takes part in.

use crate::{
    nscd::{coloring::priority::is_heavy, contact::active_entries, relax_large::joins_large, response::standing_for},
    state::{INDEX, State},
};

pub fn count_large_contacts(s: &mut State) {
    for i in 0..s.sizes.bodies {
        let without_color = active_entries(s, i).filter(|&entry| joins_large(s, i, entry));
        let (heavy, small): (Vec<usize>, Vec<usize>) =
            without_color.partition(|&entry| is_heavy(s, (s.neighbour[entry] & INDEX) as usize));
        let grain = standing_for(s, i);
        s.large_contacts[grain].small += small.len() as u32;
        s.large_contacts[grain].heavy += heavy.len() as u32;
    }
}
