//! Twin of `shaders/sweep.wgsl`: all contacts of the next colour, each updated with a step of its own (of spheres that is
//! Algorithm 1, which solves it exactly) for the velocities that the colours before have left.

use crate::{
    laws::{
        answer::{Grip, Push, gripped, pushed, weight_of},
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
    let updates: Vec<_> = turns.clone().into_par_iter().with_min_len(LEAST).map(|k| Update::of(s, k)).collect();
    for (k, update) in turns.zip(updates).filter_map(|(k, update)| Some((k, update?))) {
        s.thrust_before[k] = Packed(update.next);
        s.miss[s.turn[k].first as usize] += update.miss;
        update.pushes.iter().flatten().for_each(|push| push.keep(s));
    }
}

/// What a contact's update changes.
struct Update {
    /// N s, on the first grain.
    next: DVec3,
    /// (m/s)²
    miss: f64,
    /// The grains; a wall has no second one.
    pushes: [Option<Push>; 2],
}

impl Update {
    fn of(s: &State, k: usize) -> Option<Update> {
        let Turn { first, second, slot, .. } = s.turn[k];
        if first == NONE {
            return None;
        }
        let (i, j) = (first as usize, second as usize);
        let (Meeting { n, closing }, lever) = (s.turn_meeting[k], s.turn_lever[k]);
        let here = gripped(s, i, lever.own * n);
        let there = (j < s.sizes.bodies).then(|| gripped(s, j, -lever.other * n));
        let velocity = |grip: &Grip| grip.motion.v + surface_velocity(grip.spin, grip.arm);
        let velocity_to = match &there {
            Some(there) => velocity(there),
            None => wall_velocity(&s.wall[j - s.sizes.bodies], s.place[i].x + lever.own * n),
        };
        let side = Side {
            turn: 1.0,
            share: 1.0,
            n,
            closing,
            normal: lever.normal,
            tangential: lever.tangential,
            friction: pair_of(s, i, j).friction,
            velocity: velocity(&here) - velocity_to,
        };
        let old = kept_spring(&s.thrust[k]);
        let start = old + s.relaxation[0].beta * (old - kept_spring(&s.thrust_before[k]));
        let next = relaxed(&side, start, 1.0);
        let change = next - start;
        Some(Update {
            next,
            miss: natural_map(&side, start, weight_of(s, slot as usize, side.tangential)).length_squared(),
            pushes: [Some(pushed(s, i, &here, change)), there.map(|there| pushed(s, j, &there, -change))],
        })
    }
}
