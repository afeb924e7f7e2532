//! Twin of `shaders/displace.wgsl`: the end of a step of contact dynamics, positions n to n + 1 with the velocities n + 1.

use crate::{
    laws::{
        boundary::wrapped,
        dimension::outside,
        friction::{flag, kept_spring},
        precision::{moved, residue_of},
        rigid::filled,
    },
    state::{Motion, Place, Residue, State},
};
use glam::DVec3;

pub fn displace(s: &mut State) {
    s.counters[0].done += 1;
    for i in 0..s.sizes.bodies {
        for slot in filled(s, i).collect::<Vec<_>>() {
            flag(&mut s.neighbour[slot], kept_spring(&s.spring[slot]) != DVec3::ZERO);
        }
        let (here, residue, v) = (s.place[i], residue_of(s, i), s.trial[i].v);
        let point = wrapped(s, moved(s, here.x, residue.x, s.params.dt * v));
        s.place_next[i] = Place { x: point.x, radius: here.radius };
        if let Some(next) = s.residue_next.get_mut(i) {
            *next = Residue { x: point.residue, radius: residue.radius };
        }
        s.motion_next[i] = Motion { v, inverse_mass: s.motion[i].inverse_mass };
        if let Some(next) = s.spin_next.get_mut(i) {
            *next = s.trial_spin[i];
        }
        let stride = s.params.dt * v.length();
        s.travel[i] += stride;
        let lost = outside(point.x, s.params.lower, s.params.upper) || !(stride <= s.params.step_limit);
        if lost || !(s.travel[i] <= s.params.drift_limit) {
            s.halt[0] = 1; // the host will take the step back, and walls must not have moved
        }
        if lost {
            s.counters[0].bad_body = s.counters[0].bad_body.max(s.params.bodies - s.number[i]);
        }
    }
}
