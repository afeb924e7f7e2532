//! Twin of `shaders/contact/normal/`: the normal force of a contact.

use super::law::ContactState;
use crate::{model::Normal, state::Pair};

/// Pressing force, N, of an overlap.
#[inline(always)]
pub fn normal_force(law: Normal, pair: &Pair, c: &ContactState) -> f64 {
    match law {
        Normal::Hooke => -pair.stiffness * c.gap,
        Normal::Rigid => 0.0,
    }
}

/// Its slope, N/m.
#[inline(always)]
pub fn normal_stiffness(law: Normal, pair: &Pair, _c: &ContactState) -> f64 {
    match law {
        Normal::Hooke => pair.stiffness,
        Normal::Rigid => 0.0,
    }
}

/// Energy stored in the overlap, J.
#[inline(always)]
pub fn normal_energy(law: Normal, pair: &Pair, c: &ContactState) -> f64 {
    match law {
        Normal::Hooke => 0.5 * pair.stiffness * c.gap * c.gap,
        Normal::Rigid => 0.0,
    }
}
