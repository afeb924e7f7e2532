//! Twin of `shaders/neighbours/history_store.wgsl`: the springs, before the lists that hold them are made anew.

use crate::{
    contact::history::active_contacts,
    state::{INDEX, State},
};

pub fn history_store(s: &mut State) {
    let (mut other, mut spring) = (std::mem::take(&mut s.history_other), std::mem::take(&mut s.history_spring));
    let room = other.len();
    for i in (0..s.sizes.bodies).take_while(|i| s.history_start[i + 1] as usize <= room) {
        for (at, entry) in (s.history_start[i] as usize..).zip(active_contacts(s, i)) {
            other[at] = s.neighbour[entry] & INDEX;
            spring[at] = s.spring[entry];
        }
    }
    (s.history_other, s.history_spring) = (other, spring);
}
