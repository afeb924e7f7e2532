//! Twin of `shaders/contact/twist/`: whether springs follow the twist of their contact about its normal.

use super::state::{ContactState, Law};
use crate::{
    model::{Dimension, Twist},
    space::dimension::{transported, transported_spin},
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

/// A spring of a step ago, N, in the contact plane of now.
#[inline(always)]
pub fn carried(law: Law, old: DVec3, c: &ContactState) -> DVec3 {
    twisted(law, transported(old, c.n, c.n_before), c)
}

/// The same of a moment, N m, which in a plane is about the axis out of it.
#[inline(always)]
pub fn carried_spin(law: Law, old: DVec3, c: &ContactState) -> DVec3 {
    let turned = transported_spin(law.dimension, old, c.n, c.n_before);
    match law.dimension {
        Dimension::Plane => turned,
        Dimension::Space => twisted(law, turned, c),
    }
}

/// A vector of the contact plane, turned with the contact. As with attitudes (2.40), the turn has no sine or cosine, and
/// leaves the length as it is.
#[inline(always)]
fn twisted(law: Law, v: DVec3, c: &ContactState) -> DVec3 {
    match law.twist {
        Twist::Ignored => v,
        Twist::Followed => v + (2.0 * c.twist / (1.0 + c.twist * c.twist)) * (c.n.cross(v) - c.twist * v),
    }
}
