//! Twin of `shaders/elect.wgsl`: of the contacts that its members have named a clump keeps one, because contacts of a colour share
//! no clump.

use crate::{
    laws::{colours::lot, grains::labels},
    state::{NONE, State},
};
use rayon::prelude::*;

pub fn elect(s: &mut State) {
    let rank = |label: usize| {
        let j = s.proposal[s.whereabouts[label] as usize];
        let (label, other) = (label as u32, s.number.get(j as usize).copied().unwrap_or(j));
        // Of equal ranks the last, as in `propose`, which goes through numbers: both clumps have to agree.
        (lot(label, other), label.max(other), label.min(other))
    };
    let losers = |c: usize| {
        let named = || labels(s, c).filter(|&label| s.proposal[s.whereabouts[label] as usize] != NONE);
        let elected = named().max_by_key(|&label| rank(label));
        named().filter(move |&label| Some(label) != elected).collect::<Vec<_>>()
    };
    let losers: Vec<usize> = (0..s.sizes.clumps).into_par_iter().flat_map_iter(losers).collect();
    for label in losers {
        s.proposal[s.whereabouts[label] as usize] = NONE;
    }
}
