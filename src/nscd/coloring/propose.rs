//! Twin of `shaders/nscd/coloring/propose.wgsl`: every body names the neighbour with which it would have a contact
//! coloured next. Contacts of large grains get no colour.

use crate::{
    nscd::coloring::priority::priority,
    nscd::contact::active_entries,
    nscd::relax_large::joins_large,
    state::{INDEX, NONE, State},
};
use rayon::prelude::*;

pub fn propose(s: &mut State) {
    let choice = |i: usize| {
        let uncolored =
            active_entries(s, i).filter(|&entry| s.contact_color[entry].color == 0 && !joins_large(s, i, entry));
        let other = |j: u32| s.id.get(j as usize).copied().unwrap_or(j);
        // Of equal ranks the last: lists ascend, so there always is a pair that agrees.
        let neighbours = uncolored.map(|entry| s.neighbour[entry] & INDEX);
        neighbours.max_by_key(|&j| priority(s.id[i], other(j))).unwrap_or(NONE)
    };
    let proposal: Vec<u32> = (0..s.sizes.bodies).into_par_iter().map(choice).collect();
    if proposal.iter().any(|&j| j != NONE) {
        s.coloring_state[0].uncolored = 1;
    }
    s.proposal = proposal;
}
