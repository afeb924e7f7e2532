//! Twin of `shaders/contact/cohesion/`: attraction of surfaces. No law of a scene has any yet; one that acts beyond touching says so in
//! [`is_active`] and [`reach`].

use super::state::ContactState;
use crate::state::Pair;

/// Whether a contact acts: it does while the surfaces overlap.
#[inline(always)]
pub fn is_active(gap: f64, _was_active: bool) -> bool {
    gap < 0.0
}

/// How far beyond touching contacts may act, m: lists reach as far.
pub fn reach() -> f64 {
    0.0
}

/// Attraction, N, >= 0.
#[inline(always)]
pub fn cohesive_force(_pair: &Pair, _c: &ContactState) -> f64 {
    0.0
}
