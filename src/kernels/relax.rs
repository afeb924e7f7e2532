//! Twin of `shaders/relax.wgsl`: a pass. Every contact takes a step of Jacobi's kind from the impulses and velocities that
//! momentum has carried ahead, and every grain gathers what its contacts do to it.

use super::{BLOCK, by_slot};
use crate::{
    laws::{
        answer::{ahead, hold, metric, pushed},
        contact::Gathered,
        friction::{keep_spring, kept_spring},
        rigid::{add_impulse, keep_efforts, natural_map, relaxed, side_of, taking_part},
    },
    model::Grains,
    state::{Effort, Motion, Packed, Spin, State},
};
use glam::DVec3;
use rayon::prelude::*;

pub fn relax(s: &mut State) {
    let mut before = std::mem::take(&mut s.spring_before);
    let (sums, efforts): (Vec<Gathered>, Vec<Effort>) = by_slot(&mut before, s)
        .enumerate()
        .flat_map_iter(|(k, springs)| {
            let first = k * BLOCK;
            let begin = s.slot_start[first] as usize;
            (first..(first + BLOCK).min(s.sizes.bodies)).map(|i| pass_of(s, i, springs, begin)).collect::<Vec<_>>()
        })
        .unzip();
    s.spring_before = before;
    if s.model.grains == Grains::Clumps {
        keep_efforts(s, |_, i| efforts[i]);
        return hold(s, sums.into_iter());
    }
    let answers: Vec<(Motion, DVec3)> =
        sums.par_iter().enumerate().with_min_len(BLOCK).map(|(i, sum)| pushed(s, i, sum)).collect();
    keep_efforts(s, |s, i| {
        let ((motion, spin), (v, w)) = (answers[i], ahead(s, i));
        let work = metric(s, i, motion.inverse_mass, motion.v - v, spin - w);
        Effort { work, ..efforts[i] }
    });
    for (i, (motion, spin)) in answers.into_iter().enumerate() {
        s.trial_before[i] = motion;
        if let Some(kept) = s.trial_spin_before.get_mut(i) {
            *kept = Spin(spin);
        }
    }
}

/// Sum and moment of the impulses that grain i gets from a pass; `before` has those of the pass before from slot `begin` on, and
/// gets those of this one.
fn pass_of(s: &State, i: usize, before: &mut [Packed], begin: usize) -> (Gathered, Effort) {
    let (step, beta) = (1.0 / s.relaxation[0].stretch, s.relaxation[0].beta);
    let mut effort = Effort::default();
    let mut sum = Gathered::default();
    for slot in taking_part(s, i) {
        let side = side_of(s, i, slot, |i| ahead(s, i));
        let before = &mut before[slot - begin];
        let old = side.turn * kept_spring(&s.spring[slot]);
        let start = old + beta * (old - side.turn * kept_spring(before));
        let next = relaxed(&side, start, step);
        let mine = side.turn * next;
        keep_spring(before, mine);
        add_impulse(&mut sum, s, slot, mine);
        let (back, on) = (start - next, next - old);
        let (back_normal, on_normal) = (back.dot(side.n), on.dot(side.n));
        let back_across = back - back_normal * side.n;
        let (normal, across) = (side.normal * back_normal, side.tangential * back_across);
        effort.residual += side.share * natural_map(&side, start).length_squared();
        effort.turn += side.share * (normal * on_normal + across.dot(on - on_normal * side.n));
        effort.way += side.share * (normal * back_normal + across.dot(back_across));
    }
    (sum, effort)
}
