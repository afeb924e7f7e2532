//! All contacts from the same iterate: projected gradients, plain or with momentum. Twin of
//! `shaders/solve/relaxation.wgsl`, `disc_pass.wgsl`, `apply_delassus.wgsl`, `sums.wgsl` and
//! `momentum_restart.wgsl`, which
//! [`super::device`] runs.
//!
//! Each contact is scaled by its [`UpdateScales`](super::natural_map::UpdateScales); for spheres the scaled blocks are
//! the identity. The step is 1/L with the largest eigenvalue L of the scaled operator, whatever the number of contacts
//! of a grain.

use crate::solve::{
    contact::Contact,
    momentum::{
        LIPSCHITZ_MARGIN, MomentumLimits, POWER_ITERATIONS, PassSums, ROUNDING_DOUBLE, SolverState, next_momentum,
    },
    natural_map::{disc_update, scaled_product},
    operator::{Operator, velocities},
    options::Options,
    residual::{contacts, relative},
    solution::{Monitor, Solution},
};
use glam::DVec3;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::time::Instant;

/// Jacobi relaxation from `start`.
pub fn solve<O: Operator>(operator: &O, start: Vec<DVec3>, accelerated: bool, options: &Options) -> Solution {
    let contacts = contacts(operator);
    let monitor = Monitor::new(operator, &contacts, options, Instant::now());
    relax(operator, &contacts, start, accelerated, options, monitor)
}

/// The same from where another solver has come to, with the passes that it has left.
pub fn relax<O: Operator>(
    operator: &O,
    contacts: &[Contact],
    start: Vec<DVec3>,
    accelerated: bool,
    options: &Options,
    mut monitor: Monitor<O>,
) -> Solution {
    let (n, passes) = (contacts.len(), monitor.passes());
    let (mut x, mut y, mut next) = (start.clone(), start, vec![DVec3::ZERO; n]);
    let (mut bodies, mut u_x) = (operator.free(), vec![DVec3::ZERO; n]);
    velocities(operator, &mut bodies, &x, &mut u_x);
    let (mut u_y, mut u_next) = (u_x.clone(), u_x.clone());
    monitor.other_passes += POWER_ITERATIONS as usize + 1;
    let mut state = initial_state(operator, contacts);
    let limits = MomentumLimits::of_problem(accelerated, options.tolerance, ROUNDING_DOUBLE);
    let mut stop = monitor.stop(passes, relative(contacts, &x, &u_x, operator.reference()), &x);
    while !stop {
        for k in 0..n {
            next[k] = disc_update(&contacts[k].at(u_y[k]), y[k], state.step());
        }
        velocities(operator, &mut bodies, &next, &mut u_next);
        let mut sums = PassSums::default();
        for k in 0..n {
            let side = contacts[k].at(u_next[k]);
            let (back, on) = (y[k] - next[k], next[k] - x[k]);
            sums.residual_squared += contacts[k].natural_map(next[k], u_next[k]).length_squared();
            sums.restart_criterion += scaled_product(&side, back, on);
            sums.curvature += back.dot(u_y[k] - u_next[k]);
            sums.step_squared += scaled_product(&side, back, back);
        }
        state = next_momentum(&state, &sums, &limits);
        stop = monitor.stop(passes + state.passes as usize, state.residual_estimate, &next);
        if state.step_too_long != 0 {
            y.copy_from_slice(&x);
            u_y.copy_from_slice(&u_x);
            continue;
        }
        for k in 0..n {
            // u is affine in r, so that of y costs no pass.
            y[k] = next[k] + state.beta * (next[k] - x[k]);
            u_y[k] = u_next[k] + state.beta * (u_next[k] - u_x[k]);
        }
        std::mem::swap(&mut x, &mut next);
        std::mem::swap(&mut u_x, &mut u_next);
    }
    monitor.finish()
}

/// The state before the first pass. No eigenvalue of the scaled operator exceeds twice the largest number of blocks in
/// a row, because none of a block on the diagonal exceeds 2: its parts along and across the normal are at most 1.
pub fn initial_state<O: Operator>(operator: &O, contacts: &[Contact]) -> SolverState {
    let blocks = (0..contacts.len()).map(|k| operator.neighbours(k).count()).max().unwrap_or(0);
    let lipschitz = LIPSCHITZ_MARGIN * largest_eigenvalue(operator, contacts, POWER_ITERATIONS);
    SolverState::new(operator.reference(), 2.0 * blocks as f64, lipschitz)
}

/// The largest eigenvalue of the scaled operator, from below, by power iteration from a start that hides from no mode.
pub fn largest_eigenvalue<O: Operator>(operator: &O, contacts: &[Contact], passes: u32) -> f64 {
    let n = contacts.len();
    let scale = |k: usize| {
        let c: &Contact = &contacts[k];
        DVec3::new(c.scales.normal, c.scales.tangential, c.scales.tangential).map(|w| 1.0 / w.sqrt())
    };
    let mut rng = ChaCha8Rng::seed_from_u64(0);
    let planar = if operator.dims() == 2 { DVec3::new(1.0, 1.0, 0.0) } else { DVec3::ONE };
    let mut v: Vec<DVec3> =
        (0..n).map(|_| planar * DVec3::from_array(std::array::from_fn(|_| rng.random_range(-1.0..1.0)))).collect();
    let (mut q, mut u) = (vec![DVec3::ZERO; n], vec![DVec3::ZERO; n]);
    let mut state = operator.free();
    velocities(operator, &mut state, &u, &mut q);
    let mut value = 0.0;
    for _ in 0..passes {
        let norm = v.iter().map(|v| v.length_squared()).sum::<f64>().sqrt();
        for (k, v) in v.iter_mut().enumerate() {
            *v = *v * scale(k) / norm;
        }
        velocities(operator, &mut state, &v, &mut u);
        for k in 0..n {
            v[k] = (u[k] - q[k]) * scale(k);
        }
        value = v.iter().map(|v| v.length_squared()).sum::<f64>().sqrt();
    }
    value
}
