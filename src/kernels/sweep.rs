//! Twin of `shaders/sweep.wgsl`: all contacts of the next colour, each updated with a step of its own (of spheres that is
//! Algorithm 1, which solves it exactly) for the velocities that the colours before have left.

use crate::{
    laws::{
        answer::{gripped, push, weight_of},
        friction::kept_spring,
        materials::pair_of,
        rigid::{Side, natural_map, relaxed},
        rotation::surface_velocity,
        walls::wall_velocity,
    },
    state::{Brush, Meeting, NONE, Packed, State, Turn},
};
use glam::DVec3;
use rayon::prelude::*;

/// Contacts that one task works on at least.
const LEAST: usize = 256;

pub fn sweep(s: &mut State) {
    let Brush { colours, contacts } = s.brush[0];
    let end = contacts + s.painted[colours as usize];
    s.brush_next[0] = Brush { colours: colours + 1, contacts: end };
    let turns = contacts as usize..end as usize;
    // Contacts of a colour share no grain, so that none sees what the others do.
    let updates: Vec<Update> = turns.clone().into_par_iter().with_min_len(LEAST).map(|k| Update::of(s, k)).collect();
    for (k, update) in turns.zip(updates) {
        update.apply(s, k);
    }
}

/// What a contact's update changes.
struct Update {
    /// N s, on the first grain, and the same less what it began with.
    next: DVec3,
    change: DVec3,
    /// (m/s)²
    miss: f64,
}

impl Update {
    fn of(s: &State, k: usize) -> Update {
        let Turn { first, second, slot, .. } = s.turn[k];
        if first == NONE {
            return Update { next: DVec3::ZERO, change: DVec3::ZERO, miss: 0.0 };
        }
        let (i, j) = (first as usize, second as usize);
        let (Meeting { n, closing }, lever) = (s.turn_meeting[k], s.turn_lever[k]);
        let velocity = |i: usize, arm: DVec3| {
            let grip = gripped(s, i, arm);
            grip.motion.v + surface_velocity(grip.spin, grip.arm)
        };
        let velocity_to = match j.checked_sub(s.sizes.bodies) {
            None => velocity(j, -lever.other * n),
            Some(w) => wall_velocity(&s.wall[w], s.place[i].x + lever.own * n),
        };
        let side = Side {
            turn: 1.0,
            share: 1.0,
            n,
            closing,
            normal: lever.normal,
            tangential: lever.tangential,
            friction: pair_of(s, i, j).friction,
            velocity: velocity(i, lever.own * n) - velocity_to,
        };
        let old = kept_spring(&s.thrust[k]);
        let start = old + s.relaxation[0].beta * (old - kept_spring(&s.thrust_before[k]));
        let next = relaxed(&side, start, 1.0);
        let weight = weight_of(s, slot as usize, side.tangential);
        Update { next, change: next - start, miss: natural_map(&side, start, weight).length_squared() }
    }

    fn apply(self, s: &mut State, k: usize) {
        let Turn { first, second, .. } = s.turn[k];
        if first == NONE {
            return;
        }
        s.thrust_before[k] = Packed(self.next);
        s.miss[first as usize] += self.miss;
        let (n, lever) = (s.turn_meeting[k].n, s.turn_lever[k]);
        let (i, j) = (first as usize, second as usize);
        push(s, i, &gripped(s, i, lever.own * n), self.change);
        if j < s.sizes.bodies {
            push(s, j, &gripped(s, j, -lever.other * n), -self.change);
        }
    }
}
