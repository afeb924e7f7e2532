//! Twin of `shaders/leapfrog.wgsl`: explicit integration of a grain's translation with global damping, implicit at the
//! half step.

use crate::state::{Motion, State};
use glam::DVec3;

/// Velocity from n - 1/2 to n + 1/2 (2.19), m/s.
#[inline(always)]
pub fn advanced(s: &State, motion: &Motion, force: DVec3) -> DVec3 {
    if motion.inverse_mass == 0.0 {
        return motion.v;
    }
    let half = 0.5 * s.params.dt * s.params.damping;
    let acceleration = motion.inverse_mass * force + s.params.gravity;
    motion.v + (s.params.dt * acceleration - 2.0 * half * motion.v) / (1.0 + half)
}

/// Velocity from 0 to -1/2, m/s: without it the leapfrog loses an order of accuracy.
pub fn kicked(s: &State, motion: &Motion, force: DVec3) -> DVec3 {
    if motion.inverse_mass == 0.0 {
        return motion.v;
    }
    let acceleration = motion.inverse_mass * force + s.params.gravity - s.params.damping * motion.v;
    motion.v - 0.5 * s.params.dt * acceleration
}

/// Velocity from n - 1/2 to n, m/s: the inverse of the kick.
pub fn at_step(s: &State, motion: &Motion, force: DVec3) -> DVec3 {
    if motion.inverse_mass == 0.0 {
        return motion.v;
    }
    let acceleration = motion.inverse_mass * force + s.params.gravity;
    (motion.v + 0.5 * s.params.dt * acceleration) / (1.0 + 0.5 * s.params.dt * s.params.damping)
}
