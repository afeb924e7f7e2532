//! Twin of `shaders/nscd/momentum_restart.wgsl`: momentum of the next pass. It is Nesterov's, dropped when it carries the wrong way, when the
//! residual has risen, or when the pass shows that its step was too long. Steps that are not too long for W may be for friction:
//! passes then go in circles, and come no nearer in as many as it took to get there. (By colours there are no such steps, and no sums of
//! `work` and `way`.)

use crate::{nscd::contact::total_sums, state::State};

/// Passes that may always go by without a smaller residual.
const PATIENCE: u32 = 100;

pub fn momentum_restart(s: &mut State) {
    let sum = total_sums(s);
    let next = &mut s.solver_state[0];
    next.passes += 1;
    next.residual_estimate = sum.residual.sqrt() / next.scale;
    let theta = next.theta;
    let squared = theta * theta;
    next.theta = 0.5 * (theta * (squared + 4.0).sqrt() - squared);
    next.beta = (theta * (1.0 - theta) / (squared + next.theta)).min(s.params.max_momentum);
    // Below the tolerance, velocities may change by rounding alone, and by less the shorter the step.
    let beyond_rounding = next.residual_estimate > 0.1 * s.params.tolerance * next.step_divisor;
    let short = sum.curvature > next.lipschitz * sum.step_squared && beyond_rounding;
    let risen = next.residual_estimate > 1.5 * next.best;
    if short {
        next.lipschitz = (1.02 * sum.curvature / sum.step_squared).min(next.lipschitz_bound.max(next.lipschitz));
    }
    if next.residual_estimate < next.lowest_residual {
        (next.lowest_residual, next.lowest_pass) = (next.residual_estimate, next.passes);
    }
    let circling = sum.step_squared > 0.0 && next.passes > 2 * next.lowest_pass + PATIENCE;
    if circling {
        next.step_divisor *= 2.0;
        (next.lowest_residual, next.lowest_pass) = (next.residual_estimate, next.passes);
    }
    if short || circling || risen || sum.restart_criterion > 0.0 {
        (next.theta, next.beta) = (1.0, 0.0);
    }
    next.best = if short || risen { next.residual_estimate } else { next.best.min(next.residual_estimate) };
}
