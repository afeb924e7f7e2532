//! Twin of `shaders/remember.wgsl`: the springs, before the lists that hold them are made anew.

use crate::{
    laws::friction::springs_kept,
    state::{INDEX, State},
};

pub fn remember(s: &mut State) {
    let (mut other, mut spring) = (std::mem::take(&mut s.history_other), std::mem::take(&mut s.history_spring));
    let room = other.len();
    for i in (0..s.sizes.bodies).take_while(|i| s.history_start[i + 1] as usize <= room) {
        for (at, slot) in (s.history_start[i] as usize..).zip(springs_kept(s, i)) {
            other[at] = s.neighbour[slot] & INDEX;
            spring[at] = s.spring[slot];
        }
    }
    (s.history_other, s.history_spring) = (other, spring);
}
