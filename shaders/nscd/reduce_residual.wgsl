// twin: src/nscd/reduce_residual.rs
// Contact dynamics 7: the residual, for the host. Passes may go on.
@compute @workgroup_size(SUM_LANES)
fn reduce_residual(@builtin(local_invocation_index) lane: u32) {
    let sum = total_sums(lane);
    if (lane == 0u) {
        solver_state.residual = sum.largest_residual;
        solver_state.resolved_residual = sum.resolved_residual;
        solver_state.residual_norm = sqrt(sum.residual_squared) / max(sqrt(sum.reference), NO_SPEED);
        solver_state.late_contacts = sum.late_contacts;
        if (sum.late_contacts > 0u) {
            // With more contacts the residual begins anew.
            solver_state.lowest_residual = NONE_YET;
            solver_state.lowest_pass = solver_state.passes;
        }
        solver_state.coulomb_excess = max(sum.coulomb_excess, Real(0)) / max(sum.max_normal_impulse, Real(1e-36));
    }
}
