//! Twin of `shaders/space/dimension/`. A plane is space with z = 0, so one formula serves both.

use crate::model::Dimension;
use glam::{DVec2, DVec3, DVec4, IVec3, Vec3Swizzles, Vec4Swizzles};

/// What two surfaces know of each other; `n` points from the grain of interest to the other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Separation {
    /// m, < 0 is overlap (erratum E1).
    pub gap: f64,
    pub n: DVec3,
}

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

/// The part of a spin across a direction: rolling without twist, in a plane all of it.
#[inline(always)]
pub fn across_spin(dimension: Dimension, w: DVec3, n: DVec3) -> DVec3 {
    match dimension {
        Dimension::Plane => w,
        Dimension::Space => w - w.dot(n) * n,
    }
}

/// What a vector of the contact plane with normal `n_before` changes by, in the smallest rotation to that with normal
/// `n` (2.11).
#[inline(always)]
pub fn transport(old: DVec3, n: DVec3, n_before: DVec3) -> DVec3 {
    -n.dot(old) / (1.0 + n.dot(n_before)).max(1e-6) * (n_before + n)
}

/// [`transport`] for a moment, which in a plane is about the axis out of it.
#[inline(always)]
pub fn transport_spin(dimension: Dimension, old: DVec3, n: DVec3, n_before: DVec3) -> DVec3 {
    match dimension {
        Dimension::Plane => DVec3::ZERO,
        Dimension::Space => transport(old, n, n_before),
    }
}

/// Whether x is outside of [lower, upper], or no number.
#[inline(always)]
pub fn outside(x: DVec3, lower: DVec3, upper: DVec3) -> bool {
    !(x.cmpge(lower).all() && x.cmple(upper).all())
}

/// Cell of the grid, before wrapping: floor of the scaled position.
#[inline(always)]
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

/// The vector v of a body, along the axes of the scene; q is a unit quaternion (x, y, z, w).
#[inline(always)]
pub fn rotate(q: DVec4, v: DVec3) -> DVec3 {
    let t = 2.0 * q.xyz().cross(v);
    v + (q.w * t + q.xyz().cross(t))
}

/// The way back.
pub fn conjugate(q: DVec4) -> DVec4 {
    (-q.xyz()).extend(q.w)
}

/// Hamilton's product.
pub fn quaternion_product(a: DVec4, b: DVec4) -> DVec4 {
    (a.w * b.xyz() + b.w * a.xyz() + a.xyz().cross(b.xyz())).extend(a.w * b.w - a.xyz().dot(b.xyz()))
}

/// The quaternion of (2.40) less 1, of β = ω Δt/4 (2.42).
pub fn rotation_increment(beta: DVec3) -> DVec4 {
    let square = beta.length_squared();
    beta.extend(-square) * (2.0 / (1.0 + square))
}

/// The products of angular velocities in (2.21)-(2.23), N m; none in the plane.
pub fn gyroscopic(dimension: Dimension, w: DVec3, inverse_moments: DVec3) -> DVec3 {
    if dimension == Dimension::Plane {
        return DVec3::ZERO;
    }
    let j = 1.0 / inverse_moments;
    w.yzx() * w.zxy() * (j.yzx() - j.zxy())
}

/// The largest component.
pub fn largest(w: DVec3) -> f64 {
    w.abs().max_element()
}

/// Whether all components are the same; in the plane there is one.
pub fn all_equal(dimension: Dimension, w: DVec3) -> bool {
    dimension == Dimension::Plane || (w.x == w.y && w.y == w.z)
}

/// By how much the turn 1 + gain moves the end of an arm, m.
pub fn arm_increment(gain: DVec4, arm: DVec3) -> DVec3 {
    let t = gain.xyz().cross(arm);
    2.0 * ((1.0 + gain.w) * t + gain.xyz().cross(t))
}

// Upper triangular matrices: numbers above the diagonal are those of rows and columns y z, x z and x y, the last of which
// is all that a plane has.

/// What is above the diagonal, next to it, times a vector.
#[inline(always)]
pub fn next_above(above: DVec3, v: DVec3) -> DVec3 {
    DVec3::new(above.z * v.y, above.x * v.z, 0.0)
}

/// The same of what is further above.
#[inline(always)]
pub fn last_above(above: DVec3, v: DVec3) -> DVec3 {
    DVec3::new(above.y * v.z, 0.0, 0.0)
}

/// Above the diagonal of the outer product of two vectors.
#[inline(always)]
pub fn outer_above(a: DVec3, b: DVec3) -> DVec3 {
    DVec3::new(a.y * b.z, a.x * b.z, a.x * b.y)
}

pub fn volume_of(dimension: Dimension, length: DVec3) -> f64 {
    match dimension {
        Dimension::Plane => length.x * length.y,
        Dimension::Space => length.x * length.y * length.z,
    }
}

/// Above the diagonal of a product.
pub fn product_above(a: DVec3, a_above: DVec3, b: DVec3, b_above: DVec3) -> DVec3 {
    DVec3::new(
        a.y * b_above.x + a_above.x * b.z,
        (a.x * b_above.y + a_above.z * b_above.x) + a_above.y * b.z,
        a.x * b_above.z + a_above.z * b.y,
    )
}

/// Above the diagonal of an inverse.
pub fn inverse_above(diagonal: DVec3, above: DVec3) -> DVec3 {
    let yz = above.x / (diagonal.y * diagonal.z);
    let xy = above.z / (diagonal.x * diagonal.y);
    DVec3::new(-yz, (above.z * yz - above.y / diagonal.z) / diagonal.x, -xy)
}

pub fn row_lengths(diagonal: DVec3, above: DVec3) -> DVec3 {
    let x = DVec3::new(diagonal.x, above.z, above.y);
    DVec3::new(x.length(), diagonal.y.hypot(above.x), diagonal.z)
}

/// How many edges of a cell with these tilts bring a point into the box of its lengths.
#[inline(always)]
pub fn whole_periods(d: DVec3, inverse_length: DVec3, tilt: DVec3) -> DVec3 {
    let z = (d.z * inverse_length.z).floor();
    let y = ((d.y - z * tilt.x) * inverse_length.y).floor();
    DVec3::new(((d.x - z * tilt.y - y * tilt.z) * inverse_length.x).floor(), y, z)
}

/// How many lengths come off the tilts of a cell, so that none is longer than half of them.
pub fn excess_tilts(length: DVec3, tilt: DVec3) -> DVec3 {
    let yz = (tilt.x / length.y).round_ties_even();
    let xz = ((tilt.y - yz * tilt.z) / length.x).round_ties_even();
    DVec3::new(yz, xz, (tilt.z / length.x).round_ties_even())
}

/// The tilts that so many of them are.
pub fn tilts_of(count: DVec3, length: DVec3, tilt: DVec3) -> DVec3 {
    DVec3::new(count.x * length.y, count.x * tilt.z + count.y * length.x, count.z * length.x)
}

/// Above the diagonal of the inverse of a matrix of ones with so many of them taken off.
pub fn turned_back_by(count: DVec3) -> DVec3 {
    DVec3::new(count.x, count.y + count.z * count.x, count.z)
}
