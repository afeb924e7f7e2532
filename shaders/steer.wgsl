// twin: src/kernels/steer.rs
// Contact dynamics 4: momentum of the next pass. It is Nesterov's, dropped when it carries the wrong way, when the residual has
// risen, or when the pass shows that its step was too long. Steps that are not too long for W may be for friction: passes then go
// in circles, and come no nearer in as many as it took to get there. (By colours there are no such steps, and no sums of `work` and `way`.)

/// Passes that may always go by without a smaller residual.
const PATIENCE = 100u;

@compute @workgroup_size(SUM_LANES)
fn steer(@builtin(local_invocation_index) lane: u32) {
    let sum = total(lane);
    if (lane == 0u) {
        var next = relaxation;
        next.passes++;
        next.estimate = sqrt(sum.residual) / next.scale;
        let theta = next.theta;
        let squared = theta * theta;
        next.theta = 0.5 * (theta * sqrt(squared + 4) - squared);
        next.beta = min(theta * (1 - theta) / (squared + next.theta), params.momentum);
        // Below the tolerance, velocities may change by rounding alone, and by less the shorter the step.
        let beyond_rounding = next.estimate > 0.1 * params.tolerance * next.shorter;
        let short = sum.work > next.stretch * sum.way && beyond_rounding;
        let risen = next.estimate > 1.5 * next.best;
        if (short) {
            next.stretch = min(1.02 * sum.work / sum.way, max(next.crowd, next.stretch));
        }
        if (next.estimate < next.lowest) {
            next.lowest = next.estimate;
            next.lowest_at = next.passes;
        }
        let circling = sum.way > 0 && next.passes > 2 * next.lowest_at + PATIENCE;
        if (circling) {
            next.shorter *= 2;
            next.lowest = next.estimate;
            next.lowest_at = next.passes;
        }
        if (short || circling || risen || sum.turn > 0) {
            next.theta = 1;
            next.beta = 0;
        }
        next.best = select(min(next.best, next.estimate), next.estimate, short || risen);
        relaxation = next;
    }
}
