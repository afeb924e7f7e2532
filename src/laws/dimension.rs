//! Twin of `shaders/dimension/`. A plane is space with z = 0, so one formula serves both.

use crate::model::Dimension;
use glam::{DVec2, DVec3, IVec3};

/// ω × R, the second term of (2.6), m/s.
#[inline(always)]
pub fn spin_velocity(spin: DVec3, arm: DVec3) -> DVec3 {
    spin.cross(arm)
}

/// R × f, (2.3) and (2.16), N m.
#[inline(always)]
pub fn moment(arm: DVec3, force: DVec3) -> DVec3 {
    arm.cross(force)
}

/// 1 / (J / m R²): J = 1/2 m R² for a disk, 2/5 m R² for a sphere.
#[inline(always)]
pub fn inverse_gyration(dimension: Dimension) -> f64 {
    match dimension {
        Dimension::Plane => 2.0,
        Dimension::Space => 2.5,
    }
}

/// The axis that stands in where geometry gives none.
pub fn first_axis() -> DVec3 {
    DVec3::X
}

/// The two components around the vertical axis.
pub fn horizontal(x: DVec3) -> DVec2 {
    x.truncate()
}

/// The vector with these two components.
pub fn from_horizontal(x: DVec2) -> DVec3 {
    x.extend(0.0)
}

/// Whether x is outside of [lower, upper], or no number.
#[inline(always)]
pub fn outside(x: DVec3, lower: DVec3, upper: DVec3) -> bool {
    !(x.cmpge(lower).all() && x.cmple(upper).all())
}

/// Cell of the grid, before wrapping: floor of the scaled position.
pub fn cell_coordinates(scaled: DVec3) -> IVec3 {
    scaled.floor().as_ivec3()
}

/// a·b of spins, (rad/s)².
pub fn spin_dot(a: DVec3, b: DVec3) -> f64 {
    a.dot(b)
}

/// |ω|², (rad/s)².
pub fn spin_squared(spin: DVec3) -> f64 {
    spin.length_squared()
}
