//! Twin of `shaders/nscd/power_iteration_eigenvalue.wgsl`: Rayleigh's quotient, from below, with a margin.

use crate::{nscd::contact::total_sums, solve::momentum::LIPSCHITZ_MARGIN, state::State};

pub fn power_iteration_eigenvalue(s: &mut State) {
    let sum = total_sums(s);
    if sum.curvature > 0.0 {
        let lipschitz = &mut s.solver_state[0].lipschitz;
        *lipschitz = lipschitz.max(LIPSCHITZ_MARGIN * sum.step_squared / sum.curvature);
    }
}
