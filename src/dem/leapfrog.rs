//! Twin of `shaders/dem/leapfrog.wgsl`: explicit integration of a grain's translation with global damping, implicit at
//! the half step.

use crate::{
    model::Boundary,
    space::boundary::{past_flow, past_next_flow},
    state::{State, Velocity},
};
use glam::DVec3;

/// Change of the velocity from n - 1/2 to n + 1/2 (2.19), m/s.
#[inline(always)]
pub fn velocity_change(s: &State, boundary: Boundary, velocity: &Velocity, force: DVec3) -> DVec3 {
    if velocity.inverse_mass == 0.0 {
        return DVec3::ZERO;
    }
    let half = 0.5 * s.params.dt * s.params.damping;
    let acceleration = velocity.inverse_mass * force + s.params.gravity;
    with_flow(s, boundary, velocity.v, (s.params.dt * acceleration - 2.0 * half * velocity.v) * (1.0 / (1.0 + half)))
}

/// A change of a velocity past the flow of the cell with what the way from faster to slower flow does to it: half of it at
/// the velocity before, half after.
#[inline(always)]
fn with_flow(s: &State, boundary: Boundary, v: DVec3, change: DVec3) -> DVec3 {
    past_next_flow(s, boundary, change, s.params.dt * (v + 0.5 * change))
}

/// From 0 to -1/2, m/s: without it the leapfrog loses an order of accuracy.
pub fn velocity_change_back(s: &State, velocity: &Velocity, force: DVec3) -> DVec3 {
    if velocity.inverse_mass == 0.0 {
        return DVec3::ZERO;
    }
    let acceleration = velocity.inverse_mass * force + s.params.gravity - s.params.damping * velocity.v;
    -0.5 * s.params.dt * past_flow(s, s.model.boundary, acceleration, velocity.v)
}

/// From n - 1/2 to n, m/s: the inverse of the kick.
#[inline(always)]
pub fn velocity_change_to_step(s: &State, velocity: &Velocity, force: DVec3) -> DVec3 {
    if velocity.inverse_mass == 0.0 {
        return DVec3::ZERO;
    }
    let half = 0.5 * s.params.dt * s.params.damping;
    let acceleration = velocity.inverse_mass * force + s.params.gravity;
    let change = (0.5 * s.params.dt * acceleration - half * velocity.v) * (1.0 / (1.0 + half));
    past_flow(s, s.model.boundary, change, 0.5 * s.params.dt * (velocity.v + change))
}
