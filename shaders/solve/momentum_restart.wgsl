// twin: src/solve/jacobi.rs
// A pass, 3 of 3: the momentum of the next one.
var<storage, read_write> residuals: array<Real>; // of the latest passes, by turns

@compute @workgroup_size(SUM_LANES)
fn momentum_restart(@builtin(local_invocation_index) lane: u32) {
    var sum = PassSums();
    let groups = (rule.contacts + WG - 1u) / WG;
    for (var group = lane; group < groups; group += SUM_LANES) {
        sum = combined(sum, pass_sums[group]);
    }
    sum = sum_of_lanes(lane, SUM_LANES, sum);
    if (lane == 0u && !paused()) {
        residuals[solver_state.passes % arrayLength(&residuals)] = sqrt(sum.residual_squared) / solver_state.scale;
        solver_state = next_momentum(solver_state, sum, MomentumLimits(rule.max_momentum, rule.rounding));
        best_pass.improved = u32(solver_state.residual_estimate < best_pass.residual);
        best_pass.residual = min(best_pass.residual, solver_state.residual_estimate);
    }
}
