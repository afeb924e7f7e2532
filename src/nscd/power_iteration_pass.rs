//! Twin of `shaders/nscd/power_iteration_pass.wgsl`: a pass of the power iteration for the largest eigenvalue of W.

use crate::{
    body::ForceTorque,
    model::Grains,
    nscd::{
        compliance::{compliance_at, compliant},
        contact::{active_entries, add_impulse, pushed_contact, store_residual_sums},
        response::{extrapolated_velocity_of, kinetic_metric, response, store_member_load},
    },
    state::{ResidualSums, Spin, State},
};
use glam::DVec3;
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
        let (velocity, spin) = response(s, i, &sum);
        s.pass_velocity[i] = velocity;
        if let Some(kept) = s.pass_spin.get_mut(i) {
            *kept = Spin(spin);
        }
    }
}

fn power_iteration_of(s: &State, i: usize) -> (ForceTorque, ResidualSums) {
    let scale = 1.0 / s.solver_state[0].lipschitz.max(1.0);
    let mut sums = ResidualSums::default();
    let mut sum = ForceTorque::default();
    for entry in active_entries(s, i) {
        let rigid = pushed_contact(s, i, entry, |i| extrapolated_velocity_of(s, i));
        let side = compliant(s, &rigid, &compliance_at(s, i, entry), DVec3::ZERO);
        let approach = side.velocity.dot(side.n);
        let slip = side.velocity - approach * side.n;
        let mine = (side.sign * scale) * (approach / side.normal * side.n + slip * (1.0 / side.tangential));
        add_impulse(&mut sum, s, entry, mine);
        sums.step_squared += side.share * (approach * approach / side.normal + slip.length_squared() / side.tangential);
    }
    (sum, sums)
}
