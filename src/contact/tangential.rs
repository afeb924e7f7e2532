//! Twin of `shaders/contact/tangential/`: friction with history, capped by Coulomb's law (2.7)-(2.14), errata E4, E5.

use super::{
    normal::{Loading, contact_radius, largest_contact_radius, softening, stiffness_change},
    state::{ContactState, Law},
    twist::turning,
};
use crate::{model::Tangential as Choice, scene, space::precision::accumulated, state::Pair};
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
    normal_force: f64,
    old: TangentialHistory,
) -> Tangential {
    match law.tangential {
        Choice::None => return Tangential::default(),
        Choice::Mindlin => return mindlin_contact(law, pair, c, normal_force, old),
        Choice::Coulomb => {}
    }
    // Turned into the new contact plane (2.11) and stretched by the slip of this step (2.8), (2.9).
    let slip = law.history_dt * (c.v - c.v.dot(c.n) * c.n);
    let change = turning(law, old.force, c) - pair.tangential_stiffness * slip;
    let slid = coulomb_capped(old.force, change, pair, normal_force);
    let dissipation = sliding_power(law, old.force, &slid, pair);
    Tangential { force: slid.force, history: TangentialHistory { force: slid.force }, dissipation }
}

/// A spring after a step, N, and what sliding takes of it, capped by Coulomb's law.
struct Slid {
    force: DVec3,
    excess: DVec3,
}

/// old + change, capped by sliding (2.13). A small excess is found from the change, beside which, in single precision, the
/// rounding of the sum may be large.
#[inline(always)]
fn coulomb_capped(old: DVec3, change: DVec3, pair: &Pair, normal_force: f64) -> Slid {
    let limit = pair.friction * normal_force.abs();
    let beyond = (old.length_squared() - limit * limit) + change.dot(2.0 * old + change);
    let (stretched, length) = (old + change, (limit * limit + beyond).sqrt());
    if beyond > limit * limit {
        let force = limit / length * stretched;
        return Slid { force, excess: stretched - force };
    }
    let factor = if beyond > 0.0 { beyond / (length * (length + limit)) } else { 0.0 };
    let excess = factor * stretched;
    Slid { force: accumulated(old, change - excess), excess }
}

/// Work done by sliding per time, W: the mean force of the step times what the spring was shortened by.
#[inline(always)]
fn sliding_power(law: Law, old: DVec3, slid: &Slid, pair: &Pair) -> f64 {
    if pair.tangential_stiffness == 0.0 || law.history_dt == 0.0 {
        return 0.0;
    }
    (0.5 * (old + slid.force)).dot(slid.excess) / (pair.tangential_stiffness * law.history_dt)
}

/// Mindlin's contact of elastic spheres without micro-slip, `shaders/contact/tangential/mindlin.wgsl`.
#[inline(always)]
fn mindlin_contact(law: Law, pair: &Pair, c: &ContactState, normal_force: f64, old: TangentialHistory) -> Tangential {
    let stiffness = mindlin_stiffness(pair, c);
    let turn = turning(law, old.force, c);
    let change = turn - softening(law.normal, c) * (old.force + turn);
    let held = old.force + change;
    let slip = law.history_dt * (c.v - c.v.dot(c.n) * c.n);
    let slid = coulomb_capped(old.force, change - stiffness * slip, pair, normal_force);
    let mut dissipation = 0.0;
    if stiffness > 0.0 && law.history_dt > 0.0 {
        let lost = (0.5 * (held + slid.force)).dot(slid.excess)
            + 0.5 * held.length_squared() * stiffness_change(law.normal, c);
        dissipation = lost / (stiffness * law.history_dt);
    }
    Tangential { force: slid.force, history: TangentialHistory { force: slid.force }, dissipation }
}

/// 8 G* √(R* δ), N/m.
#[inline(always)]
fn mindlin_stiffness(pair: &Pair, c: &ContactState) -> f64 {
    8.0 * pair.tangential_stiffness * contact_radius(c)
}

/// Energy stored in the spring, J.
#[inline(always)]
pub fn tangential_energy(law: Law, pair: &Pair, c: &ContactState, h: TangentialHistory) -> f64 {
    if law.tangential == Choice::Mindlin {
        let stiffness = mindlin_stiffness(pair, c);
        return if stiffness > 0.0 { 0.5 * h.force.length_squared() / stiffness } else { 0.0 };
    }
    if law.tangential == Choice::None || pair.tangential_stiffness == 0.0 {
        return 0.0;
    }
    0.5 * h.force.length_squared() / pair.tangential_stiffness
}

/// The law's parameter: k_T, N/m, or G*, Pa.
pub fn parameter(pair: &scene::Pair) -> f64 {
    pair.hertz.map_or(pair.tangential_stiffness, |h| h.shear_modulus)
}

/// The largest slope of the tangential force under this loading, N/m.
pub fn largest_stiffness(pair: &scene::Pair, loading: &Loading) -> f64 {
    if pair.friction == 0.0 {
        return 0.0;
    }
    pair.hertz.map_or(pair.tangential_stiffness, |h| 8.0 * h.shear_modulus * largest_contact_radius(&h, loading))
}
