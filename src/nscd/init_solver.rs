//! Twin of `shaders/nscd/init_solver.wgsl`: the relaxation of a step begins. What is known of the largest eigenvalue of
//! W serves on.

use crate::{
    nscd::contact::total_sums,
    state::{SolverState, State},
};

pub fn init_solver(s: &mut State) {
    let sum = total_sums(s);
    let scale = sum.reference.max(sum.gravity_speed_squared).sqrt().max(sum.imposed_speed).max(1e-30);
    s.solver_state[0] = SolverState::new(scale, sum.lipschitz_bound, s.solver_state[0].lipschitz);
}
