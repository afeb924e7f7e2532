//! Twin of `shaders/contact/normal/`.

use crate::state::Pair;

/// Pressing force of the linear spring (2.1), N, for a gap < 0.
#[inline(always)]
pub fn normal_force(pair: &Pair, gap: f64) -> f64 {
    -pair.stiffness * gap
}

/// Energy stored in the overlap, J.
pub fn normal_energy(pair: &Pair, gap: f64) -> f64 {
    0.5 * pair.stiffness * gap * gap
}
