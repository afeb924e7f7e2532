//! Twin of `shaders/rotation/`: bodies with J1 = J2 = J3, in closed form. Spin and torque are passed as values.

use super::dimension::{inverse_gyration, spin_squared, spin_velocity};
use crate::{
    model::Rotation,
    state::{Place, State},
};
use glam::DVec3;

/// 1/J, 1/(kg m²).
pub fn inverse_inertia(s: &State, place: &Place, inverse_mass: f64) -> f64 {
    inverse_gyration(s.model.dimension) * inverse_mass / (place.radius * place.radius)
}

/// rad/s; zero where nothing turns.
pub fn spin_of(s: &State, i: usize) -> DVec3 {
    match s.model.rotation {
        Rotation::None => DVec3::ZERO,
        Rotation::Sphere => s.spin[i].0,
    }
}

/// Velocity of the surface point at the end of arm, relative to the centre, m/s.
pub fn surface_velocity(spin: DVec3, arm: DVec3) -> DVec3 {
    spin_velocity(spin, arm)
}

/// Spin from n - 1/2 to n + 1/2: (2.19) with the moment in place of the force.
pub fn integrate_spin(s: &State, spin: DVec3, torque: DVec3, place: &Place, inverse_mass: f64) -> DVec3 {
    if inverse_mass == 0.0 {
        return spin;
    }
    let half = 0.5 * s.params.dt * s.params.damping;
    ((1.0 - half) * spin + s.params.dt * inverse_inertia(s, place, inverse_mass) * torque) / (1.0 + half)
}

/// Spin from 0 to -1/2.
pub fn half_kick_spin(s: &State, spin: DVec3, torque: DVec3, place: &Place, inverse_mass: f64) -> DVec3 {
    if inverse_mass == 0.0 {
        return spin;
    }
    let acceleration = inverse_inertia(s, place, inverse_mass) * torque - s.params.damping * spin;
    spin - 0.5 * s.params.dt * acceleration
}

/// Spin at step n from n - 1/2 and the moment at n: the inverse of the half kick.
pub fn spin_at_step(s: &State, spin: DVec3, torque: DVec3, place: &Place, inverse_mass: f64) -> DVec3 {
    if inverse_mass == 0.0 {
        return spin;
    }
    let j = inverse_inertia(s, place, inverse_mass);
    (spin + 0.5 * s.params.dt * j * torque) / (1.0 + 0.5 * s.params.dt * s.params.damping)
}

/// Kinetic energy of the spin at step n, J.
pub fn spin_energy(s: &State, i: usize, place: &Place, inverse_mass: f64) -> f64 {
    if s.model.rotation == Rotation::None || inverse_mass == 0.0 {
        return 0.0;
    }
    let w = spin_at_step(s, s.spin[i].0, s.torque[i].0, place, inverse_mass);
    0.5 * spin_squared(w) / inverse_inertia(s, place, inverse_mass)
}
