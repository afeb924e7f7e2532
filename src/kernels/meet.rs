//! Twin of `shaders/meet.wgsl`: the contacts of a step, and the velocities that the impulses of the last step would give it.

use crate::{
    laws::{
        answer::{answer, free_motion, hold, lever_of},
        contact::{Gathered, body},
        friction::{flag, keep_spring, spring_of},
        rigid::{closing_of, combined, filled, gathered, keep_efforts, meet as touch, reference, taking_part},
        rotation::spin_of,
        walls::wall_velocity,
    },
    model::Grains,
    state::{Effort, INDEX, Meeting, SPRUNG, State},
};
use rayon::prelude::*;

pub fn meet(s: &mut State) {
    let mut bad = 0;
    let slack = s.params.dt * s.params.gravity.length();
    for i in 0..s.sizes.bodies {
        let here = body(s, i);
        for slot in filled(s, i).collect::<Vec<_>>() {
            let entry = s.neighbour[slot];
            let j = (entry & INDEX) as usize;
            let met = touch(s, i, &here, j);
            let closing = closing_of(s, met.gap);
            let velocity_to = match j.checked_sub(s.sizes.bodies) {
                None => free_motion(s, j).v,
                Some(w) => wall_velocity(&s.wall[w], here.place.x),
            };
            // Pairs that are not about to touch take no part in passes, unless the judgement finds that they should.
            let approach = (free_motion(s, i).v - velocity_to).dot(met.n);
            flag(&mut s.neighbour[slot], entry & SPRUNG != 0 || closing <= approach + slack);
            s.meeting[slot] = Meeting { n: met.n, closing };
            let (lever, mobility) = lever_of(s, i, j, met.gap, met.n);
            s.lever[slot] = lever;
            if let Some(kept) = s.mobility.get_mut(slot) {
                *kept = mobility;
            }
            let old = spring_of(entry, s.spring.get(slot));
            keep_spring(&mut s.spring[slot], old);
            keep_spring(&mut s.spring_before[slot], old);
            if j >= s.sizes.bodies && met.gap < -here.place.radius {
                bad = bad.max(s.params.bodies - s.number[i]);
            }
        }
    }
    keep_efforts(s, |s, i| combined(imposed(s, i), first(s, i)));
    s.counters[0].bad_body = s.counters[0].bad_body.max(bad);
    let sums: Vec<Gathered> = (0..s.sizes.bodies).into_par_iter().map(|i| gathered(s, i)).collect();
    if s.model.grains == Grains::Clumps {
        return hold(s, sums.into_iter());
    }
    for (i, sum) in sums.into_iter().enumerate() {
        let (motion, spin) = answer(s, i, &sum);
        (s.trial[i], s.trial_before[i], s.ahead[i]) = (motion, motion, motion);
        for spins in [&mut s.trial_spin, &mut s.trial_spin_before, &mut s.ahead_spin] {
            if let Some(kept) = spins.get_mut(i) {
                kept.0 = spin;
            }
        }
    }
}

/// The largest velocity that a wall, a fixed grain, a spin or an overlap asks for.
fn imposed(s: &State, i: usize) -> Effort {
    let mut effort = Effort::default();
    let rim = s.place[i].radius * spin_of(s, i).length();
    for slot in taking_part(s, i) {
        let j = (s.neighbour[slot] & INDEX) as usize;
        let speed = match j.checked_sub(s.sizes.bodies) {
            Some(w) => wall_velocity(&s.wall[w], s.place[i].x).length(),
            None if s.motion[j].inverse_mass == 0.0 => free_motion(s, j).v.length(),
            None => 0.0,
        };
        effort.imposed = effort.imposed.max(speed.max(rim).max(-s.meeting[slot].closing));
    }
    effort
}

/// What a sphere adds; for members, clumps do.
fn first(s: &State, i: usize) -> Effort {
    if s.model.grains == Grains::Clumps {
        return Effort::default();
    }
    let free = free_motion(s, i);
    reference(s, filled(s, i).count(), free.v.length_squared(), free.inverse_mass)
}
