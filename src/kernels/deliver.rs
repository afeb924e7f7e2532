//! Twin of `shaders/deliver.wgsl`: impulses back into the lists of both grains.

use crate::{
    laws::friction::{keep_spring, kept_spring},
    state::{NONE, State},
};

pub fn deliver(s: &mut State) {
    for k in 0..s.palette[0].contacts as usize {
        let turn = s.turn[k];
        if turn.first == NONE {
            continue;
        }
        let impulse = kept_spring(&s.thrust[k]);
        keep_spring(&mut s.spring[turn.slot as usize], impulse);
        if turn.back != NONE {
            keep_spring(&mut s.spring[turn.back as usize], -impulse);
        }
    }
}
