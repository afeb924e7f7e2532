//! Twin of `shaders/nscd/power_iteration_pass.wgsl`: a pass of the power iteration for the largest eigenvalue of W.

use crate::{
    body::{ForceTorque, rotation::inverse_inertia},
    model::Grains,
    nscd::{
        contact::{active_entries, add_impulse, oriented_contact, store_residual_sums},
        response::{extrapolated_velocity_of, kinetic_metric, store_member_load},
    },
    space::walls::wall_velocity,
    state::{INDEX, ResidualSums, Spin, State, Velocity},
};
use rayon::prelude::*;

pub fn power_iteration_pass(s: &mut State) {
    let (impulses, sums): (Vec<ForceTorque>, Vec<ResidualSums>) =
        (0..s.sizes.bodies).into_par_iter().map(|i| power_iteration_of(s, i)).unzip();
    if s.model.grains == Grains::Clumps {
        store_residual_sums(s, |_, i| sums[i]);
        return store_member_load(s, impulses.into_iter());
    }
    store_residual_sums(s, |s, i| {
        let (v, w) = extrapolated_velocity_of(s, i);
        ResidualSums { curvature: kinetic_metric(s, i, s.extrapolated_velocity[i].inverse_mass, v, w), ..sums[i] }
    });
    for (i, sum) in impulses.into_iter().enumerate() {
        let inverse_mass = s.extrapolated_velocity[i].inverse_mass;
        let inertia = inverse_inertia(s, &s.position[i], inverse_mass);
        s.pass_velocity[i] = Velocity { v: inverse_mass * sum.force, inverse_mass };
        if let Some(kept) = s.pass_spin.get_mut(i) {
            *kept = Spin(inertia * sum.torque);
        }
    }
}

fn power_iteration_of(s: &State, i: usize) -> (ForceTorque, ResidualSums) {
    let scale = 1.0 / s.solver_state[0].lipschitz.max(1.0);
    let mut sums = ResidualSums::default();
    let mut sum = ForceTorque::default();
    for entry in active_entries(s, i) {
        let side = oriented_contact(s, i, entry, |i| extrapolated_velocity_of(s, i));
        let j = (s.neighbour[entry] & INDEX) as usize;
        let mut velocity = side.velocity;
        if let Some(w) = j.checked_sub(s.sizes.bodies) {
            // As if it stood.
            velocity += wall_velocity(&s.wall[w], s.position[i].x + s.inverse_effective_mass[entry].arm * side.n);
        }
        let approach = velocity.dot(side.n);
        let slip = velocity - approach * side.n;
        let mine = (side.sign * scale) * (approach / side.normal * side.n + slip * (1.0 / side.tangential));
        add_impulse(&mut sum, s, entry, mine);
        sums.step_squared += side.share * (approach * approach / side.normal + slip.length_squared() / side.tangential);
    }
    (sum, sums)
}
