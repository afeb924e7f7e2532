// twin: src/nscd/init_solver.rs
// Contact dynamics 2: the relaxation of a step begins. What is known of the largest eigenvalue of W serves on.
@compute @workgroup_size(SUM_LANES)
fn init_solver(@builtin(local_invocation_index) lane: u32) {
    let sum = total_sums(lane);
    if (lane == 0u) {
        var next = SolverState();
        next.scale = max(sqrt(max(sum.reference, sum.gravity_speed_squared)), max(sum.imposed_speed, Real(1e-30)));
        next.lipschitz_bound = sum.lipschitz_bound;
        next.lipschitz = max(solver_state.lipschitz, Real(1));
        next.theta = 1;
        next.best = 1e30;
        next.lowest_residual = 1e30;
        next.step_divisor = 1;
        solver_state = next;
    }
}
