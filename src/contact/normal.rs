//! Twin of `shaders/contact/normal/`: the normal force of a contact.

use super::law::ContactState;
use crate::{model::Normal, scene, state::Pair};
use std::f64::consts::PI;

/// Pressing force, N, of an overlap.
#[inline(always)]
pub fn normal_force(law: Normal, pair: &Pair, c: &ContactState) -> f64 {
    match law {
        Normal::Hooke => -pair.stiffness * c.gap,
        Normal::Rigid => 0.0,
    }
}

/// Its slope, N/m.
#[inline(always)]
pub fn normal_stiffness(law: Normal, pair: &Pair, _c: &ContactState) -> f64 {
    match law {
        Normal::Hooke => pair.stiffness,
        Normal::Rigid => 0.0,
    }
}

/// Energy stored in the overlap, J.
#[inline(always)]
pub fn normal_energy(law: Normal, pair: &Pair, c: &ContactState) -> f64 {
    match law {
        Normal::Hooke => 0.5 * pair.stiffness * c.gap * c.gap,
        Normal::Rigid => 0.0,
    }
}

/// What a contact has to bear, for bounds of the time step.
#[derive(Clone, Copy, Debug)]
pub struct Loading {
    /// m, effective radius.
    pub radius: f64,
    /// kg, effective mass.
    pub mass: f64,
    /// m/s, of the fastest impact.
    pub speed: f64,
    /// N, the largest load at rest.
    pub force: f64,
}

/// Its parameter: k_N, N/m.
pub fn parameter(pair: &scene::Pair) -> f64 {
    pair.normal_stiffness
}

/// The largest slope of the normal force under this loading, N/m.
pub fn largest_stiffness(pair: &scene::Pair, _loading: &Loading) -> f64 {
    pair.normal_stiffness
}

/// The duration of a collision, s: π √(m*/k_N).
pub fn contact_duration(pair: &scene::Pair, loading: &Loading) -> f64 {
    PI * (loading.mass / pair.normal_stiffness).sqrt()
}
