// twin: src/nscd/init_solver.rs
// Contact dynamics 2: the relaxation of a step begins. What is known of the largest eigenvalue of W serves on.
@compute @workgroup_size(SUM_LANES)
fn init_solver(@builtin(local_invocation_index) lane: u32) {
    let sum = total_sums(lane);
    if (lane == 0u) {
        solver_state = initial_state(max(sqrt(sum.reference), NO_SPEED), sum.lipschitz_bound, solver_state.lipschitz);
    }
}
