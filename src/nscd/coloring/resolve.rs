//! Twin of `shaders/nscd/coloring/resolve.wgsl`: of the contacts that its members have named a clump keeps one, because
//! contacts of a colour share no clump.

use crate::{
    body::grains::member_ids,
    nscd::coloring::priority::priority,
    state::{NONE, State},
};
use rayon::prelude::*;

pub fn resolve(s: &mut State) {
    let rank = |member_id: usize| {
        let j = s.proposal[s.index_of_id[member_id] as usize];
        let (member_id, other) = (member_id as u32, s.id.get(j as usize).copied().unwrap_or(j));
        // Of equal ranks the last, as in `propose`, which goes through numbers: both clumps have to agree.
        (priority(member_id, other), member_id.max(other), member_id.min(other))
    };
    let rejected = |c: usize| {
        let named = || member_ids(s, c).filter(|&member_id| s.proposal[s.index_of_id[member_id] as usize] != NONE);
        let selected = named().max_by_key(|&member_id| rank(member_id));
        named().filter(move |&member_id| Some(member_id) != selected).collect::<Vec<_>>()
    };
    let rejected: Vec<usize> = (0..s.sizes.clumps).into_par_iter().flat_map_iter(rejected).collect();
    for member_id in rejected {
        s.proposal[s.index_of_id[member_id] as usize] = NONE;
    }
}
