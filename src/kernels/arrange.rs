//! Twin of `shaders/arrange.wgsl`: contacts with the impulses they have now, in the order of the colours. Momentum begins anew.

use crate::{
    laws::{friction::kept_spring, rigid::filled},
    state::{Hue, INDEX, NONE, Packed, SPRUNG, State, Turn},
};
use rayon::prelude::*;

pub fn arrange(s: &mut State) {
    let begins: Vec<usize> = s
        .painted
        .iter()
        .scan(0, |end, &contacts| {
            *end += contacts as usize;
            Some(*end - contacts as usize)
        })
        .collect();
    let turns: Vec<_> = (0..s.sizes.bodies).into_par_iter().flat_map_iter(|i| turns_of(s, i)).collect();
    for (hue, turn) in turns {
        let at = begins[hue.colour as usize - 1] + hue.rank as usize;
        let slot = turn.slot as usize;
        let impulse = Packed(kept_spring(&s.spring[slot]));
        (s.turn[at], s.thrust[at], s.thrust_before[at]) = (turn, impulse, impulse);
        (s.turn_meeting[at], s.turn_lever[at]) = (s.meeting[slot], s.lever[slot]);
    }
    s.trial_before.clone_from(&s.trial);
    s.ahead.clone_from(&s.trial);
    s.trial_spin_before.clone_from(&s.trial_spin);
    s.ahead_spin.clone_from(&s.trial_spin);
    (s.relaxation[0].theta, s.relaxation[0].beta) = (1.0, 0.0);
}

/// Coloured contacts of which grain i is the first.
fn turns_of(s: &State, i: usize) -> impl Iterator<Item = (Hue, Turn)> + '_ {
    let own = move |&slot: &usize| s.hue[slot].colour > 0 && (s.neighbour[slot] & INDEX) as usize > i;
    filled(s, i).filter(own).map(move |slot| (s.hue[slot], turn_of(s, i, slot)))
}

fn turn_of(s: &State, i: usize, slot: usize) -> Turn {
    let second = s.neighbour[slot] & INDEX;
    let j = second as usize;
    let back = |j: usize| filled(s, j).find(|&back| (s.neighbour[back] & INDEX) as usize == i);
    Turn {
        first: if s.neighbour[slot] & SPRUNG != 0 { i as u32 } else { NONE },
        second,
        slot: slot as u32,
        back: if j < s.sizes.bodies {
            back(j).expect("contacts stand in the lists of both grains") as u32
        } else {
            NONE
        },
    }
}
