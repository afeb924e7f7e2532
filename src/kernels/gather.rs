//! Twin of `shaders/gather.wgsl`: velocities freed of the rounding that the updates in place have left in them; members of clumps
//! hold what `recover` needs for that.

use crate::{
    laws::{
        answer::{answer, hold},
        contact::Gathered,
        friction::kept_spring,
        rigid::{add_impulse, settle, taking_part},
    },
    model::Grains,
    state::State,
};
use rayon::prelude::*;

pub fn gather(s: &mut State) {
    let sums: Vec<Gathered> = (0..s.sizes.bodies).into_par_iter().map(|i| gathered(s, i)).collect();
    match s.model.grains {
        Grains::Spheres => sums.iter().enumerate().for_each(|(i, sum)| {
            let (motion, spin) = answer(s, i, sum);
            settle(s, i, motion, spin);
        }),
        Grains::Clumps => hold(s, sums.into_iter()),
    }
}

/// Its impulses on body i.
fn gathered(s: &State, i: usize) -> Gathered {
    let mut sum = Gathered::default();
    for slot in taking_part(s, i) {
        add_impulse(&mut sum, s, slot, kept_spring(&s.spring[slot]));
    }
    sum
}
