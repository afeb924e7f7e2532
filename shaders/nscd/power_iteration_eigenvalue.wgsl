// twin: src/nscd/power_iteration_eigenvalue.rs
// Contact dynamics, the step's length 3: Rayleigh's quotient, from below, with a margin.
@compute @workgroup_size(SUM_LANES)
fn power_iteration_eigenvalue(@builtin(local_invocation_index) lane: u32) {
    let sum = total_sums(lane);
    if (lane == 0u && sum.curvature > 0) {
        solver_state.lipschitz = max(solver_state.lipschitz, LIPSCHITZ_MARGIN * sum.step_squared / sum.curvature);
    }
}
