//! Twin of `shaders/meet.wgsl`: the contacts of a step, and the velocities that the impulses of the last step would give it.

use crate::{
    laws::{
        contact::body,
        friction::{flag, keep_spring, spring_of},
        rigid::{by_group, closing_of, filled, freed, gathered, lever, meet as touch, pushed},
        walls::wall_velocity,
    },
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
                None => freed(s, &s.motion[j]).v,
                Some(w) => wall_velocity(&s.wall[w], here.place.x),
            };
            // Pairs that are not about to touch take no part in passes, unless the judgement finds that they should.
            let approach = (freed(s, &here.motion).v - velocity_to).dot(met.n);
            flag(&mut s.neighbour[slot], entry & SPRUNG != 0 || closing <= approach + slack);
            s.meeting[slot] = Meeting { n: met.n, closing };
            s.lever[slot] = lever(s, i, j, met.gap);
            let old = spring_of(entry, s.spring.get(slot));
            keep_spring(&mut s.spring[slot], old);
            keep_spring(&mut s.spring_before[slot], old);
            if j >= s.sizes.bodies && met.gap < -here.place.radius {
                bad = bad.max(s.params.bodies - s.number[i]);
            }
        }
    }
    let starts: Vec<_> = (0..s.sizes.bodies).into_par_iter().map(|i| pushed(s, i, &gathered(s, i))).collect();
    for (i, (motion, spin)) in starts.into_iter().enumerate() {
        (s.trial[i], s.trial_before[i], s.ahead[i]) = (motion, motion, motion);
        for spins in [&mut s.trial_spin, &mut s.trial_spin_before, &mut s.ahead_spin] {
            if let Some(kept) = spins.get_mut(i) {
                kept.0 = spin;
            }
        }
    }
    s.effort = by_group(s, |i| reference(s, i, slack));
    s.counters[0].bad_body = s.counters[0].bad_body.max(bad);
}

/// What residuals are relative to.
fn reference(s: &State, i: usize, slack: f64) -> Effort {
    let free = freed(s, &s.motion[i]);
    let mut effort = Effort::default();
    for slot in filled(s, i) {
        effort.crowd += 1.0;
        if s.neighbour[slot] & SPRUNG != 0 {
            let j = (s.neighbour[slot] & INDEX) as usize;
            let wall = j.checked_sub(s.sizes.bodies);
            let speed = wall.map_or(0.0, |w| wall_velocity(&s.wall[w], s.place[i].x).length());
            effort.imposed = effort.imposed.max(speed.max(-s.meeting[slot].closing));
        }
    }
    if free.inverse_mass != 0.0 {
        (effort.reference, effort.least) = (free.v.length_squared(), slack * slack);
    }
    effort
}
