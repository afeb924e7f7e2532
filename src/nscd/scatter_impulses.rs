//! Twin of `shaders/nscd/scatter_impulses.wgsl`: impulses back into the lists of both grains.

use crate::state::{NONE, State};

pub fn scatter_impulses(s: &mut State) {
    for k in 0..s.coloring_state[0].contacts as usize {
        let turn = s.colored_contact[k];
        if turn.first == NONE {
            continue;
        }
        let impulse = s.colored_impulse[k].0;
        s.impulse[turn.entry as usize].0 = impulse;
        if turn.back != NONE {
            s.impulse[turn.back as usize].0 = -impulse;
        }
    }
}
