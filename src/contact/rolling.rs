//! Twin of `shaders/contact/rolling/`: rolling resistance, an elastic-plastic spring-dashpot with history (Iwashita & Oda 1998; type C of
//! Ai, Chen, Rotter & Ooi 2011, Powder Technol. 206, 269).

use super::{
    normal::{self, Loading},
    state::{ContactState, Law},
};
use crate::{
    contact::materials::pair_index,
    model::Rolling as Choice,
    scene::{self, Assembly},
    space::dimension::{across_spin, transported_spin},
    state::{RollingPair, State},
};
use glam::DVec3;

/// Parameters of a pair of materials.
pub type Parameters = RollingPair;

/// Those of i and j; wall w is number `bodies + w`.
#[inline(always)]
pub fn parameters_of(s: &State, i: usize, j: usize) -> Parameters {
    match s.model.rolling {
        Choice::None => Parameters::default(),
        Choice::ElasticPlastic => s.rolling_pair[pair_index(s, i, j)],
    }
}

/// The parameters of a scene, into the arrays that this slot owns.
pub fn fill(s: &mut State, assembly: &Assembly) {
    if s.model.rolling == Choice::ElasticPlastic {
        let parameters = |pair: &scene::Pair| {
            pair.rolling.map_or(Parameters::default(), |r| Parameters {
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
    pub history: RollingHistory,
    /// W, of dashpot and plastic rolling.
    pub dissipation: f64,
}

/// `stiffness` is the slope of the normal force, N/m, and `normal_force` that force, N.
#[inline(always)]
pub fn rolling_contact(law: Law, c: &ContactState, stiffness: f64, normal_force: f64, old: RollingHistory) -> Rolling {
    if law.rolling == Choice::None {
        return Rolling::default();
    }
    let pair = &c.rolling;
    let k = rolling_stiffness(pair, c, stiffness);
    let rate = across_spin(law.dimension, c.spin, c.n);
    let held = transported_spin(law.dimension, old.torque, c.n, c.n_before);
    let turned = held - k * law.history_dt * rate;
    let limit = pair.friction * c.radius * normal_force.max(0.0);
    let length_squared = turned.length_squared();
    let (mut torque, mut dashpot) = (turned, 0.0);
    if length_squared > limit * limit {
        torque = turned * (limit / length_squared.sqrt());
    } else if c.rolling_inertia > 0.0 {
        dashpot = 2.0 * pair.damping * (k / c.rolling_inertia).sqrt();
    }
    let mut dissipation = dashpot * rate.length_squared();
    if k > 0.0 && law.history_dt > 0.0 {
        dissipation += (0.5 * (held + torque)).dot(turned - torque) / (k * law.history_dt);
    }
    Rolling { couple: torque - dashpot * rate, history: RollingHistory { torque }, dissipation }
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
    let k = rolling_stiffness(&c.rolling, c, stiffness);
    if k > 0.0 { 0.5 * h.torque.length_squared() / k } else { 0.0 }
}

/// The largest slope of the couple under this loading, N m: of the spring, and what the dashpot adds, whose rate half a step old makes the
/// scheme as much stiffer.
pub fn largest_stiffness(pair: &scene::Pair, loading: &Loading) -> f64 {
    pair.rolling.map_or(0.0, |r| {
        let spring = r.stiffness * normal::largest_stiffness(pair, loading) * loading.radius * loading.radius;
        spring * (r.damping + (1.0 + r.damping * r.damping).sqrt()).powi(2)
    })
}
