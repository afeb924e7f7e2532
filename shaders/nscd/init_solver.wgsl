// twin: src/nscd/init_solver.rs
// Contact dynamics 2: the relaxation of a step begins. What is known of the largest eigenvalue of W serves on.
@compute @workgroup_size(SUM_LANES)
fn init_solver(@builtin(local_invocation_index) lane: u32) {
    let sum = total_sums(lane);
    if (lane == 0u) {
        let scale = max(sqrt(max(sum.reference, sum.gravity_speed_squared)), max(sum.imposed_speed, Real(1e-30)));
        solver_state = initial_state(scale, sum.lipschitz_bound, solver_state.lipschitz);
    }
}
