//! Twin of `shaders/body/rotation/`: bodies with J1 = J2 = J3, in closed form.

use crate::{
    body::Body,
    space::dimension::{inverse_gyration, spin_squared, spin_velocity},
};
use crate::{
    model::{Dimension, Rotation},
    state::{Position, State},
};
use glam::DVec3;

/// 1/J, 1/(kg m²); zero where nothing turns.
#[inline(always)]
pub fn inverse_inertia(s: &State, position: &Position, inverse_mass: f64) -> f64 {
    if s.model.rotation == Rotation::None {
        return 0.0;
    }
    inverse_gyration(s.model.dimension) * inverse_mass / (position.radius * position.radius)
}

/// Inverse inertia about a point of the surface, 1/(kg m²): 1/(J + m R²); zero where nothing turns.
#[inline(always)]
pub fn inverse_rolling_inertia(rotation: Rotation, dimension: Dimension, radius: f64, inverse_mass: f64) -> f64 {
    if rotation == Rotation::None {
        return 0.0;
    }
    let c = inverse_gyration(dimension);
    c / (1.0 + c) * inverse_mass / (radius * radius)
}

/// rad/s; zero where nothing turns.
#[inline(always)]
pub fn spin_of(s: &State, i: usize) -> DVec3 {
    match s.model.rotation {
        Rotation::None => DVec3::ZERO,
        Rotation::Sphere => s.spin[i].0,
    }
}

/// Velocity of the surface point at the end of arm, relative to the centre, m/s.
#[inline(always)]
pub fn surface_velocity(spin: DVec3, arm: DVec3) -> DVec3 {
    spin_velocity(spin, arm)
}

/// Change of ω from n - 1/2 to n + 1/2: (2.19) with the acceleration that the moment gives.
#[inline(always)]
pub fn spin_change(s: &State, w: DVec3, acceleration: DVec3) -> DVec3 {
    let half = 0.5 * s.params.dt * s.params.damping;
    (s.params.dt * acceleration - 2.0 * half * w) * (1.0 / (1.0 + half))
}

/// From 0 to -1/2.
pub fn spin_change_back(s: &State, w: DVec3, acceleration: DVec3) -> DVec3 {
    -0.5 * s.params.dt * (acceleration - s.params.damping * w)
}

/// From n - 1/2 to n: the inverse of the kick.
#[inline(always)]
pub fn spin_change_to_step(s: &State, w: DVec3, acceleration: DVec3) -> DVec3 {
    let half = 0.5 * s.params.dt * s.params.damping;
    (0.5 * s.params.dt * acceleration - half * w) * (1.0 / (1.0 + half))
}

/// One of these changes of a sphere under a moment.
#[inline(always)]
pub fn sphere_spin_change(
    s: &State,
    here: &Body,
    torque: DVec3,
    change: impl Fn(&State, DVec3, DVec3) -> DVec3,
) -> DVec3 {
    if here.velocity.inverse_mass == 0.0 {
        return DVec3::ZERO;
    }
    change(s, here.spin, inverse_inertia(s, &here.position, here.velocity.inverse_mass) * torque)
}

/// Kinetic energy of a spin at step n, J.
#[inline(always)]
pub fn spin_energy(s: &State, here: &Body, w: DVec3) -> f64 {
    if s.model.rotation == Rotation::None || here.velocity.inverse_mass == 0.0 {
        return 0.0;
    }
    0.5 * spin_squared(w) / inverse_inertia(s, &here.position, here.velocity.inverse_mass)
}
