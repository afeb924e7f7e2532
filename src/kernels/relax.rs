//! Twin of `shaders/relax.wgsl`: a pass. Every contact takes a step of Jacobi's kind from the impulses and velocities that
//! momentum has carried ahead, and every grain gathers what its contacts do to it.

use super::{BLOCK, by_slot};
use crate::{
    laws::{
        answer::{ahead, answer, hold, metric, weight_of},
        contact::Gathered,
        friction::{keep_spring, kept_spring},
        rigid::{add_impulse, keep_efforts, natural_map, relaxed, side_of, taking_part},
    },
    model::Grains,
    state::{Effort, Packed, Spin, State},
};
use rayon::prelude::*;

pub fn relax(s: &mut State) {
    if s.model.grains == Grains::Clumps {
        let (sums, efforts): (Vec<Gathered>, Vec<Effort>) =
            passes(s, |_, _, sum, effort| (sum, effort)).into_iter().unzip();
        keep_efforts(s, |_, i| efforts[i]);
        return hold(s, sums.into_iter());
    }
    let answers = passes(s, |s, i, sum, effort| {
        let ((motion, spin), (v, w)) = (answer(s, i, &sum), ahead(s, i));
        let work = metric(s, i, motion.inverse_mass, motion.v - v, spin - w);
        (motion, spin, Effort { work, ..effort })
    });
    keep_efforts(s, |_, i| answers[i].2);
    for (i, (motion, spin, _)) in answers.into_iter().enumerate() {
        s.trial_before[i] = motion;
        if let Some(kept) = s.trial_spin_before.get_mut(i) {
            *kept = Spin(spin);
        }
    }
}

/// A pass over the contacts of all bodies, and what becomes of each body's impulses and sums.
fn passes<T: Send>(s: &mut State, then: impl Fn(&State, usize, Gathered, Effort) -> T + Sync) -> Vec<T> {
    let mut before = std::mem::take(&mut s.spring_before);
    let answers = by_slot(&mut before, s)
        .enumerate()
        .flat_map_iter(|(k, springs)| {
            let first = k * BLOCK;
            let begin = s.slot_start[first] as usize;
            let bodies = first..(first + BLOCK).min(s.sizes.bodies);
            let of_body = |i| {
                let (sum, effort) = pass_of(s, i, springs, begin);
                then(s, i, sum, effort)
            };
            bodies.map(of_body).collect::<Vec<_>>()
        })
        .collect();
    s.spring_before = before;
    answers
}

/// Sum and moment of the impulses that grain i gets from a pass; `before` has those of the pass before from slot `begin` on, and
/// gets those of this one.
fn pass_of(s: &State, i: usize, before: &mut [Packed], begin: usize) -> (Gathered, Effort) {
    let (step, beta) = (1.0 / (s.relaxation[0].shorter * s.relaxation[0].stretch), s.relaxation[0].beta);
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
        effort.residual += side.share * natural_map(&side, start, weight_of(s, slot, side.tangential)).length_squared();
        effort.turn += side.share * (normal * on_normal + across.dot(on - on_normal * side.n));
        effort.way += side.share * (normal * back_normal + across.dot(back_across));
    }
    (sum, effort)
}
