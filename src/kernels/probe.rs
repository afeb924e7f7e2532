//! Twin of `shaders/probe.wgsl`: a pass of the power iteration for the largest eigenvalue of W.

use crate::{
    laws::{
        answer::{ahead, hold, metric},
        contact::Gathered,
        rigid::{add_impulse, keep_efforts, side_of, taking_part},
        rotation::inverse_inertia,
        walls::wall_velocity,
    },
    model::Grains,
    state::{Effort, INDEX, Motion, Spin, State},
};
use rayon::prelude::*;

pub fn probe(s: &mut State) {
    let (sums, efforts): (Vec<Gathered>, Vec<Effort>) =
        (0..s.sizes.bodies).into_par_iter().map(|i| probed(s, i)).unzip();
    if s.model.grains == Grains::Clumps {
        keep_efforts(s, |_, i| efforts[i]);
        return hold(s, sums.into_iter());
    }
    keep_efforts(s, |s, i| {
        let (v, w) = ahead(s, i);
        Effort { work: metric(s, i, s.ahead[i].inverse_mass, v, w), ..efforts[i] }
    });
    for (i, sum) in sums.into_iter().enumerate() {
        let inverse_mass = s.ahead[i].inverse_mass;
        let inertia = inverse_inertia(s, &s.place[i], inverse_mass);
        s.trial[i] = Motion { v: inverse_mass * sum.force, inverse_mass };
        if let Some(kept) = s.trial_spin.get_mut(i) {
            *kept = Spin(inertia * sum.torque);
        }
    }
}

fn probed(s: &State, i: usize) -> (Gathered, Effort) {
    let scale = 1.0 / s.relaxation[0].stretch.max(1.0);
    let mut effort = Effort::default();
    let mut sum = Gathered::default();
    for slot in taking_part(s, i) {
        let side = side_of(s, i, slot, |i| ahead(s, i));
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
    (sum, effort)
}
