// twin: src/nscd/momentum_restart.rs
// Contact dynamics 4: momentum of the next pass. It is Nesterov's, dropped when it carries the wrong way, when the residual has
// risen, or when the pass shows that its step was too long. Steps that are not too long for W may be for friction: passes then go
// in circles, and come no nearer in as many as it took to get there. (By colours there are no such steps, and no sums of `work` and `way`.)

/// Passes that may always go by without a smaller residual.
const PATIENCE = 100u;

@compute @workgroup_size(SUM_LANES)
fn momentum_restart(@builtin(local_invocation_index) lane: u32) {
    let sum = total_sums(lane);
    if (lane == 0u) {
        var next = relaxation;
        next.passes++;
        next.residual_estimate = sqrt(sum.residual) / next.scale;
        let theta = next.theta;
        let squared = theta * theta;
        next.theta = 0.5 * (theta * sqrt(squared + 4) - squared);
        next.beta = min(theta * (1 - theta) / (squared + next.theta), params.max_momentum);
        // Below the tolerance, velocities may change by rounding alone, and by less the shorter the step.
        let beyond_rounding = next.residual_estimate > 0.1 * params.tolerance * next.step_divisor;
        let short = sum.curvature > next.lipschitz * sum.step_squared && beyond_rounding;
        let risen = next.residual_estimate > 1.5 * next.best;
        if (short) {
            next.lipschitz = min(1.02 * sum.curvature / sum.step_squared, max(next.lipschitz_bound, next.lipschitz));
        }
        if (next.residual_estimate < next.lowest_residual) {
            next.lowest_residual = next.residual_estimate;
            next.lowest_pass = next.passes;
        }
        let circling = sum.step_squared > 0 && next.passes > 2 * next.lowest_pass + PATIENCE;
        if (circling) {
            next.step_divisor *= 2;
            next.lowest_residual = next.residual_estimate;
            next.lowest_pass = next.passes;
        }
        if (short || circling || risen || sum.restart_criterion > 0) {
            next.theta = 1;
            next.beta = 0;
        }
        next.best = select(min(next.best, next.residual_estimate), next.residual_estimate, short || risen);
        solver_state = next;
    }
}
