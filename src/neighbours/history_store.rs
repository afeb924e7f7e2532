//! Twin of `shaders/neighbours/history_store.wgsl`: what contacts remember, before the lists that hold it are made
//! anew.

use crate::{
    contact::history::{active_contacts, store_lanes},
    state::{INDEX, State},
};

pub fn history_store(s: &mut State) {
    let room = s.history_other.len();
    let fits = |i: &usize| s.history_start[i + 1] as usize <= room;
    let of_body = |i: usize| active_contacts(s, i).zip(s.history_start[i] as usize..).collect::<Vec<_>>();
    let moves: Vec<(usize, usize)> = (0..s.sizes.bodies).take_while(fits).flat_map(of_body).collect();
    for &(entry, at) in &moves {
        s.history_other[at] = s.neighbour[entry] & INDEX;
    }
    store_lanes(s, &moves);
}
