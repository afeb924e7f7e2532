//! Twin of `shaders/nscd/after_sweep.wgsl`: velocities after all colours, and what the momentum of the next pass
//! depends on; of clumps the residual alone, and `sync_members` does the rest.

use crate::{
    body::rotation::inverse_inertia,
    model::Grains,
    nscd::{contact::store_residual_sums, response::extrapolated_velocity_of},
    space::dimension::spin_dot,
    state::{ResidualSums, State, Velocity},
};
use glam::DVec3;

pub fn after_sweep(s: &mut State) {
    store_residual_sums(s, after_sweep_of);
    s.pass_residual.fill(0.0);
    if s.model.grains == Grains::Spheres {
        s.pass_velocity_before.clone_from(&s.extrapolated_velocity);
        s.pass_spin_before.clone_from(&s.extrapolated_spin);
    }
}

fn after_sweep_of(s: &State, i: usize) -> ResidualSums {
    let mut sums = ResidualSums { residual_squared: s.pass_residual[i], ..ResidualSums::default() };
    if s.model.grains == Grains::Clumps {
        return sums; // members will get the velocities of the first of them
    }
    let (_, spin) = extrapolated_velocity_of(s, i);
    sums.restart_criterion = restart_criterion(s, i, &s.extrapolated_velocity[i], spin);
    sums
}

/// From where the sweeps set out to where they have led body i, along the change from the pass before, J.
pub fn restart_criterion(s: &State, i: usize, now: &Velocity, spin: DVec3) -> f64 {
    let beta = s.solver_state[0].beta;
    let mut criterion = 0.0;
    if now.inverse_mass != 0.0 {
        let last = s.pass_velocity[i].v;
        let start = last + beta * (last - s.pass_velocity_before[i].v);
        criterion = (start - now.v).dot(now.v - last) / now.inverse_mass;
    }
    let inertia = inverse_inertia(s, &s.position[i], now.inverse_mass);
    if inertia != 0.0 {
        let last = s.pass_spin[i].0;
        let start = last + beta * (last - s.pass_spin_before[i].0);
        criterion += spin_dot(start - spin, spin - last) / inertia;
    }
    criterion
}
