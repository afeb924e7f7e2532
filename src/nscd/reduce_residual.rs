//! Twin of `shaders/nscd/reduce_residual.wgsl`: the residual, for the host.

use crate::{
    nscd::contact::{NO_SPEED, total_sums},
    solve::momentum::NONE_YET,
    state::State,
};

pub fn reduce_residual(s: &mut State) {
    let sum = total_sums(s);
    let solver_state = &mut s.solver_state[0];
    solver_state.residual = sum.largest_residual;
    solver_state.resolved_residual = sum.resolved_residual;
    solver_state.residual_norm = sum.residual_squared.sqrt() / sum.reference.sqrt().max(NO_SPEED);
    solver_state.late_contacts = sum.late_contacts;
    if sum.late_contacts > 0 {
        // With more contacts the residual begins anew.
        (solver_state.lowest_residual, solver_state.lowest_pass) = (NONE_YET, solver_state.passes);
    }
    solver_state.coulomb_excess = sum.coulomb_excess.max(0.0) / sum.max_normal_impulse.max(1e-36);
}
