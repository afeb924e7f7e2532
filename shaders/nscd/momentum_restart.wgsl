// twin: src/nscd/momentum_restart.rs
// Contact dynamics 4: the momentum of the next pass, from what the groups of grains have summed up.
@compute @workgroup_size(SUM_LANES)
fn momentum_restart(@builtin(local_invocation_index) lane: u32) {
    let sum = total_sums(lane);
    if (lane == 0u) {
        let sums = PassSums(sum.residual_squared, sum.restart_criterion, sum.curvature, sum.step_squared);
        let limits = limits_of_scene(params.max_momentum, params.tolerance);
        solver_state = next_momentum(solver_state, sums, limits);
    }
}
