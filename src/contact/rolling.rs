//! Twin of `shaders/contact/rolling/`: rolling resistance, an elastic-plastic spring-dashpot with history (Iwashita &
//! Oda 1998; type C of Ai, Chen, Rotter & Ooi 2011, Powder Technol. 206, 269).

use super::{
    normal::{self, Loading, softening, stiffness_change},
    state::{ContactState, Law},
    twist::turning_spin,
};
use crate::{
    model::Rolling as Choice,
    scene::{self, Assembly},
    space::{dimension::across_spin, precision::accumulated},
    state::{RollingPair, State},
};
use glam::DVec3;

/// The parameters of a scene, into the arrays that this slot owns.
pub fn fill(s: &mut State, assembly: &Assembly) {
    if s.model.rolling == Choice::ElasticPlastic {
        let parameters = |pair: &scene::Pair| {
            pair.rolling.map_or(RollingPair::default(), |r| RollingPair {
                friction: r.friction,
                stiffness: r.stiffness,
                damping: r.damping,
            })
        };
        s.rolling_pair = assembly.pairs.iter().map(parameters).collect();
    }
}

/// What a contact remembers.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RollingHistory {
    /// N m, of the spring.
    pub torque: DVec3,
}

/// The rolling part of a contact, on the first of the two.
#[derive(Clone, Copy, Debug, Default)]
pub struct Rolling {
    /// N m
    pub couple: DVec3,
    /// N m, the part of the couple that is the dashpot's.
    pub damping: DVec3,
    pub history: RollingHistory,
    /// W, dissipation of the dashpot.
    pub dashpot: f64,
    /// W, that of plastic rolling.
    pub plastic: f64,
}

/// `stiffness` is the slope of the normal force, N/m, and `normal_force` that force, N.
#[inline(always)]
pub fn rolling_contact(law: Law, c: &ContactState, stiffness: f64, normal_force: f64, old: RollingHistory) -> Rolling {
    if law.rolling == Choice::None {
        return Rolling::default();
    }
    let pair = &law.state.rolling_pair[c.materials];
    let k = rolling_stiffness(pair, c, stiffness);
    let rate = across_spin(law.dimension, c.spin, c.n);
    let turn = turning_spin(law, old.torque, c);
    let change = turn - softening(law.normal, c) * (old.torque + turn);
    let held = old.torque + change;
    let rolled = change - k * law.history_dt * rate;
    let limit = pair.friction * c.radius * normal_force.max(0.0);
    let (mut torque, mut excess, mut dashpot) = (DVec3::ZERO, old.torque + rolled, 0.0);
    if limit > 0.0 {
        // In parts of the limit, because the squares of small grains' torques are beyond single precision.
        let (before, gain) = (old.torque / limit, rolled / limit);
        let part = before + gain;
        let beyond = (before.length_squared() - 1.0) + gain.dot(2.0 * before + gain);
        let length = (1.0 + beyond).sqrt();
        if beyond > 1.0 {
            torque = limit / length * part;
            excess -= torque;
        } else {
            excess = DVec3::ZERO;
            if beyond > 0.0 {
                excess = beyond / (length * (length + 1.0)) * limit * part;
            } else {
                dashpot = capped_dashpot(2.0 * pair.damping * rolling_dashpot(k, c), part, rate / limit);
            }
            torque = accumulated(old.torque, rolled - excess);
        }
    }
    let mut plastic = 0.0;
    if k > 0.0 && law.history_dt > 0.0 {
        let lost = (0.5 * (held + torque)).dot(excess) + 0.5 * held.length_squared() * stiffness_change(law.normal, c);
        plastic = lost / (k * law.history_dt);
    }
    let (damping, dashpot) = (-dashpot * rate, dashpot * rate.length_squared());
    Rolling { couple: torque + damping, damping, history: RollingHistory { torque }, dashpot, plastic }
}

/// As much of a dashpot, N m s, as keeps |part - dashpot rate| within 1, spring and rate being in parts of the limit.
#[inline(always)]
fn capped_dashpot(dashpot: f64, part: DVec3, rate: DVec3) -> f64 {
    let damping = dashpot * rate;
    let size = damping.length();
    if !(size > 0.0) {
        return dashpot;
    }
    let along = part.dot(damping / size);
    dashpot * ((along + (along * along + 1.0 - part.length_squared()).max(0.0).sqrt()) / size).min(1.0)
}

/// √(k I) with the inertia I about the contact point, N m s: half of what damps critically.
#[inline(always)]
fn rolling_dashpot(k: f64, c: &ContactState) -> f64 {
    if c.inverse_rolling_inertia > 0.0 { k.sqrt() / c.inverse_rolling_inertia.sqrt() } else { 0.0 }
}

/// N m per radian.
#[inline(always)]
fn rolling_stiffness(pair: &RollingPair, c: &ContactState, stiffness: f64) -> f64 {
    pair.stiffness * stiffness * (c.radius * c.radius)
}

/// The moment of a contact's force and its couple, N m.
#[inline(always)]
pub fn with_couple(law: Law, torque: DVec3, couple: DVec3) -> DVec3 {
    match law.rolling {
        Choice::None => torque,
        Choice::ElasticPlastic => torque + couple,
    }
}

/// Energy stored in the rolling spring, J; nothing where the surfaces have no stiffness any more.
#[inline(always)]
pub fn rolling_energy(law: Law, c: &ContactState, stiffness: f64, h: RollingHistory) -> f64 {
    if law.rolling == Choice::None {
        return 0.0;
    }
    let k = rolling_stiffness(&law.state.rolling_pair[c.materials], c, stiffness);
    if k > 0.0 { 0.5 * h.torque.length_squared() / k } else { 0.0 }
}

/// The largest slope of the spring's couple under this loading, N m.
pub fn largest_stiffness(pair: &scene::Pair, loading: &Loading) -> f64 {
    pair.rolling
        .map_or(0.0, |r| r.stiffness * normal::largest_stiffness(pair, loading) * loading.radius * loading.radius)
}

/// The largest coefficient of the dashpot, N m s, of a contact of this rolling stiffness, N m, and this inertia about
/// the contact point, kg m².
pub fn largest_damping(pair: &scene::Pair, stiffness: f64, inertia: f64) -> f64 {
    pair.rolling.map_or(0.0, |r| 2.0 * r.damping * stiffness.sqrt() * inertia.sqrt())
}
