//! Twin of `shaders/steer.wgsl`: momentum of the next pass. It is Nesterov's, dropped when it carries the wrong way, when the
//! residual has risen, or when the pass shows that its step was too long. Steps that are not too long for W may be for friction:
//! passes then go in circles, and come no nearer in as many as it took to get there. (By colours there are no such steps, and no sums of
//! `work` and `way`.)

use crate::{laws::rigid::total, state::State};

/// Passes that may always go by without a smaller residual.
const PATIENCE: u32 = 100;

pub fn steer(s: &mut State) {
    let sum = total(s);
    let next = &mut s.relaxation[0];
    next.passes += 1;
    next.estimate = sum.residual.sqrt() / next.scale;
    let theta = next.theta;
    let squared = theta * theta;
    next.theta = 0.5 * (theta * (squared + 4.0).sqrt() - squared);
    next.beta = (theta * (1.0 - theta) / (squared + next.theta)).min(s.params.momentum);
    // Below the tolerance, velocities may change by rounding alone, and by less the shorter the step.
    let beyond_rounding = next.estimate > 0.1 * s.params.tolerance * next.shorter;
    let short = sum.work > next.stretch * sum.way && beyond_rounding;
    let risen = next.estimate > 1.5 * next.best;
    if short {
        next.stretch = (1.02 * sum.work / sum.way).min(next.crowd.max(next.stretch));
    }
    if next.estimate < next.lowest {
        (next.lowest, next.lowest_at) = (next.estimate, next.passes);
    }
    let circling = sum.way > 0.0 && next.passes > 2 * next.lowest_at + PATIENCE;
    if circling {
        next.shorter *= 2.0;
        (next.lowest, next.lowest_at) = (next.estimate, next.passes);
    }
    if short || circling || risen || sum.turn > 0.0 {
        (next.theta, next.beta) = (1.0, 0.0);
    }
    next.best = if short || risen { next.estimate } else { next.best.min(next.estimate) };
}
