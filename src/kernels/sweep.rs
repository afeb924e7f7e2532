//! Twin of `shaders/sweep.wgsl`: all contacts of the next colour, each solved exactly (Algorithm 1) for the velocities that the
//! colours before have left.

use crate::{
    laws::{
        dimension::moment,
        friction::kept_spring,
        materials::pair_of,
        rigid::{Side, natural_map, relaxed},
        rotation::{inverse_inertia, surface_velocity},
        walls::wall_velocity,
    },
    state::{Brush, Meeting, NONE, Packed, Spin, State, Turn},
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
        let Turn { first, second, .. } = s.turn[k];
        if first == NONE {
            return Update { next: DVec3::ZERO, change: DVec3::ZERO, miss: 0.0 };
        }
        let (i, j) = (first as usize, second as usize);
        let (Meeting { n, closing }, lever) = (s.turn_meeting[k], s.turn_lever[k]);
        let spin = |i: usize| s.ahead_spin.get(i).map_or(DVec3::ZERO, |spin| spin.0);
        let surface = |i: usize, arm: f64| s.ahead[i].v + surface_velocity(spin(i), arm * n);
        let surface_to = match j.checked_sub(s.sizes.bodies) {
            None => surface(j, -lever.other),
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
            velocity: surface(i, lever.own) - surface_to,
        };
        let old = kept_spring(&s.thrust[k]);
        let start = old + s.relaxation[0].beta * (old - kept_spring(&s.thrust_before[k]));
        let next = relaxed(&side, start, 1.0);
        Update { next, change: next - start, miss: natural_map(&side, start, side.tangential).length_squared() }
    }

    fn apply(self, s: &mut State, k: usize) {
        let Turn { first, second, .. } = s.turn[k];
        if first == NONE {
            return;
        }
        s.thrust_before[k] = Packed(self.next);
        s.miss[first as usize] += self.miss;
        let (n, lever) = (s.turn_meeting[k].n, s.turn_lever[k]);
        push(s, first as usize, lever.own * n, self.change);
        if (second as usize) < s.sizes.bodies {
            push(s, second as usize, -lever.other * n, -self.change);
        }
    }
}

/// An impulse on grain i at the end of an arm.
fn push(s: &mut State, i: usize, arm: DVec3, impulse: DVec3) {
    let inertia = inverse_inertia(s, &s.place[i], s.ahead[i].inverse_mass);
    let motion = &mut s.ahead[i];
    motion.v += motion.inverse_mass * impulse;
    if let Some(Spin(spin)) = s.ahead_spin.get_mut(i) {
        *spin += inertia * moment(arm, impulse);
    }
}
