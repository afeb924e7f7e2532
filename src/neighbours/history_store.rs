//! Twin of `shaders/neighbours/history_store.wgsl`: what contacts remember, before the lists that hold it are made
//! anew.

use crate::{
    body::blocks::{BLOCK, by_history},
    contact::history::{active_contacts, store_lanes},
    state::{INDEX, State},
};
use rayon::prelude::*;

pub fn history_store(s: &mut State) {
    let mut history_other = std::mem::take(&mut s.history_other);
    let room = history_other.len();
    let moves: Vec<Vec<(usize, usize)>> = by_history(&mut history_other, &s.history_start, s.sizes.bodies)
        .enumerate()
        .map(|(k, history_other)| {
            let (mut moves, first) = (Vec::new(), s.history_start[k * BLOCK] as usize);
            let run = k * BLOCK..((k + 1) * BLOCK).min(s.sizes.bodies);
            for i in run.filter(|i| s.history_start[i + 1] as usize <= room) {
                for (entry, at) in active_contacts(s, i).zip(s.history_start[i] as usize - first..) {
                    history_other[at] = s.neighbour[entry] & INDEX;
                    moves.push((entry, at));
                }
            }
            moves
        })
        .collect();
    s.history_other = history_other;
    store_lanes(s, &moves);
}
