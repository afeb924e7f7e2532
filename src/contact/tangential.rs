//! Twin of `shaders/contact/tangential/`. Entries and springs of a grain's slots are passed in, because the kernel's grain owns them.

use crate::contact::law::Law;
use crate::{model::Tangential, state::Pair};
use glam::DVec3;

/// The old spring turned into the new contact plane by the smallest rotation Z from `n_before` to `n` (2.11) and
/// stretched by the slip of this step (2.8), (2.9), N.
#[inline(always)]
pub fn stretched_spring(law: Law, old: DVec3, pair: &Pair, n: DVec3, n_before: DVec3, v_rel: DVec3) -> DVec3 {
    if law.tangential == Tangential::None {
        return DVec3::ZERO;
    }
    let turned = old - n.dot(old) / (1.0 + n.dot(n_before)).max(1e-6) * (n_before + n);
    let slip = law.history_dt * (v_rel - v_rel.dot(n) * n);
    turned - pair.tangential_stiffness * slip
}

/// Capped by sliding (2.13), N.
#[inline(always)]
pub fn slid_spring(stretched: DVec3, pair: &Pair, pressing: f64) -> DVec3 {
    let limit = pair.friction * pressing.abs();
    let length_squared = stretched.length_squared();
    let scale = limit / length_squared.sqrt();
    stretched * if length_squared > limit * limit { scale } else { 1.0 }
}

/// Work done by sliding per time, W: the mean force of the step times what the spring was shortened by.
#[inline(always)]
pub fn sliding_power(law: Law, old: DVec3, stretched: DVec3, slid: DVec3, pair: &Pair) -> f64 {
    if pair.tangential_stiffness == 0.0 || law.history_dt == 0.0 {
        return 0.0;
    }
    (0.5 * (old + slid)).dot(stretched - slid) / (pair.tangential_stiffness * law.history_dt)
}

/// Energy stored in a spring, J.
pub fn spring_energy(f: DVec3, pair: &Pair) -> f64 {
    if pair.tangential_stiffness == 0.0 { 0.0 } else { 0.5 * f.length_squared() / pair.tangential_stiffness }
}
