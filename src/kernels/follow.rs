//! Twin of `shaders/follow.wgsl`: velocities after all colours, and what the momentum of the next pass depends on; of
//! clumps the residual alone, and `fall_in` does the rest.

use crate::{
    laws::{dimension::spin_dot, rigid::keep_efforts, rotation::inverse_inertia},
    model::Grains,
    state::{Effort, State},
};

pub fn follow(s: &mut State) {
    keep_efforts(s, followed);
    s.miss.fill(0.0);
    if s.model.grains == Grains::Spheres {
        s.trial_before.clone_from(&s.ahead);
        s.trial_spin_before.clone_from(&s.ahead_spin);
    }
}

fn followed(s: &State, i: usize) -> Effort {
    let beta = s.relaxation[0].beta;
    let mut effort = Effort { residual: s.miss[i], ..Effort::default() };
    if s.model.grains == Grains::Clumps {
        return effort; // members will fall in with the first of them
    }
    // From where the sweeps set out to where they led, along the way from the pass before.
    let (now, last) = (s.ahead[i], s.trial[i].v);
    if now.inverse_mass != 0.0 {
        let start = last + beta * (last - s.trial_before[i].v);
        effort.turn = (start - now.v).dot(now.v - last) / now.inverse_mass;
    }
    let inertia = inverse_inertia(s, &s.place[i], now.inverse_mass);
    if inertia != 0.0 {
        let (spin, last) = (s.ahead_spin[i].0, s.trial_spin[i].0);
        let start = last + beta * (last - s.trial_spin_before[i].0);
        effort.turn += spin_dot(start - spin, spin - last) / inertia;
    }
    effort
}
