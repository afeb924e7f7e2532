//! Twin of `shaders/nscd/scatter_impulses.wgsl`: impulses back into the lists of both grains.

use crate::{
    contact::history::{keep_spring, kept_spring},
    state::{NONE, State},
};

pub fn scatter_impulses(s: &mut State) {
    for k in 0..s.coloring_state[0].contacts as usize {
        let turn = s.colored_contact[k];
        if turn.first == NONE {
            continue;
        }
        let impulse = kept_spring(&s.colored_impulse[k]);
        keep_spring(&mut s.spring[turn.entry as usize], impulse);
        if turn.back != NONE {
            keep_spring(&mut s.spring[turn.back as usize], -impulse);
        }
    }
}
