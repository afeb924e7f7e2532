//! Twin of `shaders/contact/twist/`: whether springs follow the twist of their contact about its normal.

use super::state::{ContactState, Law};
use crate::{
    model::{Dimension, Twist},
    space::dimension::{transport, transport_spin},
};
use glam::DVec3;

/// By how much a contact has turned about its normal in this step, from the sum of the two spins: tan of half the angle.
#[inline(always)]
pub fn twist_of(law: Law, n: DVec3, spins: DVec3) -> f64 {
    match law.twist {
        Twist::Ignored => 0.0,
        Twist::Followed => 0.25 * law.history_dt * spins.dot(n),
    }
}

/// What a spring of a step ago changes by, N, where it turns into the contact plane of now.
#[inline(always)]
pub fn turning(law: Law, old: DVec3, c: &ContactState) -> DVec3 {
    let change = transport(old, c.n, c.n_before);
    change + twisting(law, old + change, c)
}

/// The same of a moment, N m, which in a plane is about the axis out of it.
#[inline(always)]
pub fn turning_spin(law: Law, old: DVec3, c: &ContactState) -> DVec3 {
    let change = transport_spin(law.dimension, old, c.n, c.n_before);
    match law.dimension {
        Dimension::Plane => change,
        Dimension::Space => change + twisting(law, old + change, c),
    }
}

/// What a vector of the contact plane changes by, where it turns with the contact. As with attitudes (2.40), the turn
/// has no sine or cosine, and leaves the length as it is.
#[inline(always)]
fn twisting(law: Law, v: DVec3, c: &ContactState) -> DVec3 {
    match law.twist {
        Twist::Ignored => DVec3::ZERO,
        Twist::Followed => (2.0 * c.twist / (1.0 + c.twist * c.twist)) * (c.n.cross(v) - c.twist * v),
    }
}
