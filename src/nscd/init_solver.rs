//! Twin of `shaders/nscd/init_solver.wgsl`: the relaxation of a step begins. What is known of the largest eigenvalue of
//! W serves on.

use crate::{
    nscd::contact::{NO_SPEED, total_sums},
    state::{SolverState, State},
};

pub fn init_solver(s: &mut State) {
    let sum = total_sums(s);
    s.solver_state[0] =
        SolverState::new(sum.reference.sqrt().max(NO_SPEED), sum.lipschitz_bound, s.solver_state[0].lipschitz);
}
