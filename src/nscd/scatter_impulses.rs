//! Twin of `shaders/nscd/scatter_impulses.wgsl`: impulses back into the lists of both grains.

use crate::state::{NONE, State};

pub fn scatter_impulses(s: &mut State) {
    for k in 0..s.coloring_state[0].contacts as usize {
        let contact = s.colored_contact[k];
        if contact.first == NONE {
            continue;
        }
        let impulse = s.colored_impulse[k].0;
        s.impulse[contact.entry as usize].0 = impulse;
        if contact.back != NONE {
            s.impulse[contact.back as usize].0 = -impulse;
        }
    }
}
