//! What the chapters share.

use crate::common::*;

pub const INF: f64 = f64::INFINITY;

/// ω₀ of a default grain on a wall, 1/s.
pub fn omega(dimension: usize) -> f64 {
    (KN / mass(dimension, R)).sqrt()
}

/// Frequency of the tangential spring of a grain that sticks to the floor, 1/s.
pub fn stick_frequency(dimension: usize) -> f64 {
    ((1.0 + 1.0 / gyration(dimension)) * 2.0 / 7.0 * G / (1e-4 * R)).sqrt()
}
