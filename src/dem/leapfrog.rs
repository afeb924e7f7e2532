//! Twin of `shaders/dem/leapfrog.wgsl`: explicit integration of a grain's translation with global damping, implicit at
//! the half step.

use crate::state::{State, Velocity};
use glam::DVec3;

/// Velocity from n - 1/2 to n + 1/2 (2.19), m/s.
#[inline(always)]
pub fn integrate_velocity(s: &State, velocity: &Velocity, force: DVec3) -> DVec3 {
    if velocity.inverse_mass == 0.0 {
        return velocity.v;
    }
    let half = 0.5 * s.params.dt * s.params.damping;
    let acceleration = velocity.inverse_mass * force + s.params.gravity;
    velocity.v + (s.params.dt * acceleration - 2.0 * half * velocity.v) / (1.0 + half)
}

/// Velocity from 0 to -1/2, m/s: without it the leapfrog loses an order of accuracy.
pub fn half_kick_velocity(s: &State, velocity: &Velocity, force: DVec3) -> DVec3 {
    if velocity.inverse_mass == 0.0 {
        return velocity.v;
    }
    let acceleration = velocity.inverse_mass * force + s.params.gravity - s.params.damping * velocity.v;
    velocity.v - 0.5 * s.params.dt * acceleration
}

/// Velocity from n - 1/2 to n, m/s: the inverse of the kick.
pub fn velocity_at_step(s: &State, velocity: &Velocity, force: DVec3) -> DVec3 {
    if velocity.inverse_mass == 0.0 {
        return velocity.v;
    }
    let acceleration = velocity.inverse_mass * force + s.params.gravity;
    (velocity.v + 0.5 * s.params.dt * acceleration) / (1.0 + 0.5 * s.params.dt * s.params.damping)
}
