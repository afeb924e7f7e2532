//! Twin of `shaders/contact/tangential/`: friction with history, capped by Coulomb's law (2.7)-(2.14), errata E4, E5.

use super::{
    geometry::transported,
    law::{ContactState, Law},
    normal::Loading,
};
use crate::{model::Tangential as Choice, scene, state::Pair};
use glam::DVec3;

/// What a contact remembers.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TangentialHistory {
    /// N
    pub force: DVec3,
}

/// The tangential part of a contact, on the first of the two.
#[derive(Clone, Copy, Debug, Default)]
pub struct Tangential {
    /// N
    pub force: DVec3,
    pub history: TangentialHistory,
    /// W, of sliding.
    pub dissipation: f64,
}

#[inline(always)]
pub fn tangential_contact(
    law: Law,
    pair: &Pair,
    c: &ContactState,
    pressing: f64,
    old: TangentialHistory,
) -> Tangential {
    if law.tangential == Choice::None {
        return Tangential::default();
    }
    let stretched = stretched_spring(law, old.force, pair, c);
    let force = slid_spring(stretched, pair, pressing);
    let dissipation = sliding_power(law, old.force, stretched, force, pair);
    Tangential { force, history: TangentialHistory { force }, dissipation }
}

/// The old force turned into the new contact plane (2.11) and stretched by the slip of this step (2.8), (2.9), N.
#[inline(always)]
fn stretched_spring(law: Law, old: DVec3, pair: &Pair, c: &ContactState) -> DVec3 {
    let turned = transported(old, c.n, c.n_before);
    let slip = law.history_dt * (c.v - c.v.dot(c.n) * c.n);
    turned - pair.tangential_stiffness * slip
}

/// Capped by sliding (2.13), N.
#[inline(always)]
fn slid_spring(stretched: DVec3, pair: &Pair, pressing: f64) -> DVec3 {
    let limit = pair.friction * pressing.abs();
    let length_squared = stretched.length_squared();
    let scale = limit / length_squared.sqrt();
    stretched * if length_squared > limit * limit { scale } else { 1.0 }
}

/// Work done by sliding per time, W: the mean force of the step times what the spring was shortened by.
#[inline(always)]
fn sliding_power(law: Law, old: DVec3, stretched: DVec3, slid: DVec3, pair: &Pair) -> f64 {
    if pair.tangential_stiffness == 0.0 || law.history_dt == 0.0 {
        return 0.0;
    }
    (0.5 * (old + slid)).dot(stretched - slid) / (pair.tangential_stiffness * law.history_dt)
}

/// Energy stored in the spring, J.
#[inline(always)]
pub fn tangential_energy(law: Law, pair: &Pair, _c: &ContactState, h: TangentialHistory) -> f64 {
    if law.tangential == Choice::None || pair.tangential_stiffness == 0.0 {
        return 0.0;
    }
    0.5 * h.force.length_squared() / pair.tangential_stiffness
}

/// Its parameter: k_T, N/m.
pub fn parameter(pair: &scene::Pair) -> f64 {
    pair.tangential_stiffness
}

/// The largest slope of the tangential force under this loading, N/m.
pub fn largest_stiffness(pair: &scene::Pair, _loading: &Loading) -> f64 {
    if pair.friction > 0.0 { pair.tangential_stiffness } else { 0.0 }
}
