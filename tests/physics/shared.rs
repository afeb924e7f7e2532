//! What the chapters share.

use crate::common::*;
use glam::DVec3;
use packstone::scene::{Pair, Wall};

pub const INF: f64 = f64::INFINITY;

pub fn up(dimension: usize) -> DVec3 {
    DVec3::AXES[dimension - 1]
}

pub fn floor(dimension: usize) -> Wall {
    plane(DVec3::ZERO, up(dimension))
}

/// ω₀ of a default grain on a wall, 1/s.
pub fn omega(dimension: usize) -> f64 {
    (KN / mass(dimension, R)).sqrt()
}

/// A law so stiff that a grain's weight makes an overlap of 1e-4 R in two and three dimensions.
pub fn bed_law(dimension: usize, friction: f64) -> Pair {
    let kn = mass(dimension, R) * G / (1e-4 * R);
    Pair { normal_stiffness: kn, tangential_stiffness: 2.0 / 7.0 * kn, friction, ..Pair::default() }
}

/// Frequency of the tangential spring of a grain that sticks to the floor, 1/s.
pub fn stick_frequency(dimension: usize) -> f64 {
    ((1.0 + 1.0 / gyration(dimension)) * 2.0 / 7.0 * G / (1e-4 * R)).sqrt()
}
