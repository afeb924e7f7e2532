//! Twin of `shaders/hand_over.wgsl`: members hand over the impulses that a step ends with.

use crate::{
    laws::{
        answer::hold,
        contact::Gathered,
        friction::{flag, kept_spring},
        rigid::{filled, gathered},
    },
    state::State,
};
use glam::DVec3;
use rayon::prelude::*;

pub fn hand_over(s: &mut State) {
    s.counters[0].done += 1;
    let sums: Vec<Gathered> = (0..s.sizes.bodies).into_par_iter().map(|i| gathered(s, i)).collect();
    hold(s, sums.into_iter());
    for i in 0..s.sizes.bodies {
        for slot in filled(s, i).collect::<Vec<_>>() {
            flag(&mut s.neighbour[slot], kept_spring(&s.spring[slot]) != DVec3::ZERO);
        }
    }
}
