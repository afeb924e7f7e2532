//! Twin of `shaders/nscd/momentum_restart.wgsl`: the momentum of the next pass, from what the groups of grains have
//! summed up.

use crate::{
    nscd::contact::total_sums,
    solve::momentum::{MomentumLimits, PassSums, next_momentum},
    state::State,
};

pub fn momentum_restart(s: &mut State) {
    let sum = total_sums(s);
    let sums = PassSums {
        residual_squared: sum.residual_squared,
        restart_criterion: sum.restart_criterion,
        curvature: sum.curvature,
        step_squared: sum.step_squared,
    };
    let limits = MomentumLimits::of_scene(s.params.max_momentum, s.params.tolerance);
    s.solver_state[0] = next_momentum(&s.solver_state[0], &sums, &limits);
}
