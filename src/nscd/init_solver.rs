//! Twin of `shaders/nscd/init_solver.wgsl`: the relaxation of a step begins.

use crate::{
    nscd::contact::total_sums,
    state::{SolverState, State},
};

pub fn init_solver(s: &mut State) {
    let sum = total_sums(s);
    let scale = sum.reference.max(sum.gravity_speed_squared).sqrt().max(sum.imposed_speed).max(1e-30);
    let lipschitz = s.solver_state[0].lipschitz.max(1.0);
    s.solver_state[0] = SolverState {
        scale,
        lipschitz_bound: sum.lipschitz_bound,
        lipschitz,
        theta: 1.0,
        best: 1e30,
        lowest_residual: 1e30,
        step_divisor: 1.0,
        ..SolverState::default()
    };
}
