//! Twin of `shaders/probe.wgsl`: a pass of the power iteration for the largest eigenvalue of W.

use crate::{
    laws::{
        contact::Gathered,
        dimension::spin_squared,
        rigid::{add_impulse, by_group, side_of, taking_part},
        rotation::inverse_inertia,
        walls::wall_velocity,
    },
    state::{Effort, INDEX, Motion, Spin, State},
};
use glam::DVec3;
use rayon::prelude::*;

pub fn probe(s: &mut State) {
    let grains: Vec<_> = (0..s.sizes.bodies).into_par_iter().map(|i| probed(s, i)).collect();
    s.effort = by_group(s, |i| grains[i].2);
    for (i, (v, spin, _)) in grains.into_iter().enumerate() {
        s.trial[i] = Motion { v, ..s.ahead[i] };
        if let Some(kept) = s.trial_spin.get_mut(i) {
            *kept = Spin(spin);
        }
    }
}

fn probed(s: &State, i: usize) -> (DVec3, DVec3, Effort) {
    let at = |i: usize| (s.ahead[i].v, s.ahead_spin.get(i).map_or(DVec3::ZERO, |spin| spin.0));
    let scale = 1.0 / s.relaxation[0].stretch.max(1.0);
    let mut effort = Effort::default();
    let mut sum = Gathered::default();
    for slot in taking_part(s, i) {
        let side = side_of(s, i, slot, at);
        let j = (s.neighbour[slot] & INDEX) as usize;
        let mut velocity = side.velocity;
        if let Some(w) = j.checked_sub(s.sizes.bodies) {
            velocity += wall_velocity(&s.wall[w], s.place[i].x + s.lever[slot].own * side.n); // as if it stood
        }
        let approach = velocity.dot(side.n);
        let slip = velocity - approach * side.n;
        let mine = (side.turn * scale) * (approach / side.normal * side.n + slip * (1.0 / side.tangential));
        add_impulse(&mut sum, s, slot, mine);
        effort.way += side.share * (approach * approach / side.normal + slip.length_squared() / side.tangential);
    }
    let (v, spin) = at(i);
    let inverse_mass = s.ahead[i].inverse_mass;
    let inertia = inverse_inertia(s, &s.place[i], inverse_mass);
    if inverse_mass != 0.0 {
        effort.work = v.length_squared() / inverse_mass;
    }
    if inertia != 0.0 {
        effort.work += spin_squared(spin) / inertia;
    }
    (inverse_mass * sum.force, inertia * sum.torque, effort)
}
