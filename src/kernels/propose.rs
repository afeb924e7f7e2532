//! Twin of `shaders/propose.wgsl`: every body names the neighbour with which it would have a contact coloured next.

use crate::{
    laws::{colours::lot, rigid::taking_part},
    state::{INDEX, NONE, State},
};
use rayon::prelude::*;

pub fn propose(s: &mut State) {
    let choice = |i: usize| {
        let uncoloured = taking_part(s, i).filter(|&slot| s.hue[slot].colour == 0);
        let other = |j: u32| s.number.get(j as usize).copied().unwrap_or(j);
        // Of equal ranks the last: lists ascend, so there always is a pair that agrees.
        let neighbours = uncoloured.map(|slot| s.neighbour[slot] & INDEX);
        neighbours.max_by_key(|&j| lot(s.number[i], other(j))).unwrap_or(NONE)
    };
    let proposal: Vec<u32> = (0..s.sizes.bodies).into_par_iter().map(choice).collect();
    if proposal.iter().any(|&j| j != NONE) {
        s.palette[0].uncoloured = 1;
    }
    s.proposal = proposal;
}
