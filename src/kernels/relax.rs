//! Twin of `shaders/relax.wgsl`: a pass. Every contact takes a step of Jacobi's kind from the impulses and velocities that
//! momentum has carried ahead, and every grain gathers what its contacts do to it.

use super::{BLOCK, by_slot};
use crate::{
    laws::{
        contact::Gathered,
        dimension::spin_squared,
        friction::{keep_spring, kept_spring},
        rigid::{add_impulse, by_group, natural_map, pushed, relaxed, side_of, taking_part},
        rotation::inverse_inertia,
    },
    state::{Effort, Motion, Packed, Spin, State},
};
use glam::DVec3;
use rayon::prelude::*;

pub fn relax(s: &mut State) {
    let mut before = std::mem::take(&mut s.spring_before);
    let grains: Vec<(Motion, DVec3, Effort)> = by_slot(&mut before, s)
        .enumerate()
        .flat_map_iter(|(k, springs)| {
            let first = k * BLOCK;
            let begin = s.slot_start[first] as usize;
            (first..(first + BLOCK).min(s.sizes.bodies)).map(|i| pass_of(s, i, springs, begin)).collect::<Vec<_>>()
        })
        .collect();
    s.spring_before = before;
    s.effort = by_group(s, |i| grains[i].2);
    for (i, (motion, spin, _)) in grains.into_iter().enumerate() {
        s.trial_before[i] = motion;
        if let Some(kept) = s.trial_spin_before.get_mut(i) {
            *kept = Spin(spin);
        }
    }
}

/// Velocity and spin that grain i gets from a pass; `before` has the impulses of the pass before from slot `begin` on, and
/// gets those of this one.
fn pass_of(s: &State, i: usize, before: &mut [Packed], begin: usize) -> (Motion, DVec3, Effort) {
    let at = |i: usize| (s.ahead[i].v, s.ahead_spin.get(i).map_or(DVec3::ZERO, |spin| spin.0));
    let (step, beta) = (1.0 / s.relaxation[0].stretch, s.relaxation[0].beta);
    let mut effort = Effort::default();
    let mut sum = Gathered::default();
    for slot in taking_part(s, i) {
        let side = side_of(s, i, slot, at);
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
    let (motion, spin) = pushed(s, i, &sum);
    let (v, w) = at(i);
    let inertia = inverse_inertia(s, &s.place[i], motion.inverse_mass);
    if motion.inverse_mass != 0.0 {
        effort.work = (motion.v - v).length_squared() / motion.inverse_mass;
    }
    if inertia != 0.0 {
        effort.work += spin_squared(spin - w) / inertia;
    }
    (motion, spin, effort)
}
