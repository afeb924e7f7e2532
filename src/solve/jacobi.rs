//! All contacts from the same iterate: projected gradients, plain or with momentum. Twin of `shaders/solve/`, which
//! [`super::device`] runs.
//!
//! Each contact is scaled by W_nn in the normal and λmax(W_tt) in the tangent; for spheres the scaled blocks are the
//! identity. The step is 1/L with the largest eigenvalue L of the scaled operator, whatever the number of contacts of a
//! grain.

use crate::solve::{
    contact::Contact,
    momentum::Momentum,
    operator::{Operator, velocities},
    residual::{contacts, relative},
    solver::{Options, Solution, Watch},
};
use glam::DVec3;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::time::Instant;

/// Passes of the power iteration, and what is added to its result, which comes from below.
pub(super) const POWER: usize = 40;
pub(super) const MARGIN: f64 = 1.02;

/// Jacobi relaxation from `start`.
pub fn solve<O: Operator>(operator: &O, start: Vec<DVec3>, accelerated: bool, options: &Options) -> Solution {
    let started = Instant::now();
    let contacts = contacts(operator);
    let mut watch = Watch::new(operator, &contacts, options, started);
    let n = contacts.len();
    let (mut x, mut y, mut next) = (start.clone(), start, vec![DVec3::ZERO; n]);
    let (mut state, mut u_x) = (operator.free(), vec![DVec3::ZERO; n]);
    velocities(operator, &mut state, &x, &mut u_x);
    let (mut u_y, mut u_next) = (u_x.clone(), u_x.clone());
    watch.other_passes = POWER + 1;
    let mut largest = MARGIN * largest_eigenvalue(operator, &contacts, POWER);
    let mut momentum = Momentum::default();
    let mut pass = 0;
    let mut stop = watch.stop(0, relative(&contacts, &x, &u_x, operator.reference()), &x);
    while !stop {
        pass += 1;
        for k in 0..n {
            next[k] = contacts[k].disc(y[k], u_y[k], 1.0 / largest);
        }
        velocities(operator, &mut state, &next, &mut u_next);
        let residual = relative(&contacts, &next, &u_next, operator.reference());
        stop = watch.stop(pass, residual, &next);

        // Along the step W may be no larger than L, or the estimate was low: raise it and go back. Steps so short that
        // round-off decides are let through.
        let sum = |f: &dyn Fn(usize) -> f64| (0..n).map(f).sum::<f64>();
        let length = sum(&|k| contacts[k].dot(next[k] - y[k], next[k] - y[k]));
        let curvature = sum(&|k| (next[k] - y[k]).dot(u_next[k] - u_y[k]));
        let size = sum(&|k| contacts[k].dot(next[k], next[k]));
        if curvature > largest * length && length > 1e-20 * size {
            largest = MARGIN * curvature / length;
            y.copy_from_slice(&x);
            u_y.copy_from_slice(&u_x);
            momentum.reset();
            continue;
        }
        let uphill = sum(&|k| contacts[k].dot(y[k] - next[k], next[k] - x[k]));
        let beta = if accelerated { momentum.next(uphill, residual) } else { 0.0 };
        for k in 0..n {
            // u is affine in r, so that of y costs no pass.
            y[k] = next[k] + beta * (next[k] - x[k]);
            u_y[k] = u_next[k] + beta * (u_next[k] - u_x[k]);
        }
        std::mem::swap(&mut x, &mut next);
        std::mem::swap(&mut u_x, &mut u_next);
    }
    watch.finish()
}

/// The largest eigenvalue of the scaled operator, from below, by power iteration from a start that hides from no mode.
pub fn largest_eigenvalue<O: Operator>(operator: &O, contacts: &[Contact], passes: usize) -> f64 {
    let n = contacts.len();
    let scale = |k: usize| {
        let c: &Contact = &contacts[k];
        DVec3::new(c.normal, c.tangent, c.tangent).map(|w| 1.0 / w.sqrt())
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
