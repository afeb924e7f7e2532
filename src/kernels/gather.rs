//! Twin of `shaders/gather.wgsl`: velocities freed of the rounding that the updates in place have left in them.

use crate::{
    laws::{
        answer::answer,
        contact::Gathered,
        friction::kept_spring,
        rigid::{add_impulse, taking_part},
    },
    state::{Motion, State},
};
use glam::DVec3;
use rayon::prelude::*;

pub fn gather(s: &mut State) {
    let grains: Vec<(Motion, DVec3)> = (0..s.sizes.bodies).into_par_iter().map(|i| gathered(s, i)).collect();
    for (i, (motion, spin)) in grains.into_iter().enumerate() {
        let off = motion.v - s.trial[i].v;
        for motions in [&mut s.trial, &mut s.trial_before, &mut s.ahead] {
            motions[i] = Motion { v: motions[i].v + off, ..motion };
        }
        let spin_off = s.trial_spin.get(i).map_or(DVec3::ZERO, |last| spin - last.0);
        for spins in [&mut s.trial_spin, &mut s.trial_spin_before, &mut s.ahead_spin] {
            if let Some(kept) = spins.get_mut(i) {
                kept.0 += spin_off;
            }
        }
    }
}

/// Velocity and spin that its impulses give grain i.
fn gathered(s: &State, i: usize) -> (Motion, DVec3) {
    let mut sum = Gathered::default();
    for slot in taking_part(s, i) {
        add_impulse(&mut sum, s, slot, kept_spring(&s.spring[slot]));
    }
    answer(s, i, &sum)
}
