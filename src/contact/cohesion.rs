//! Twin of `shaders/contact/cohesion/`: attraction of surfaces. No law of a scene has any yet. One that acts beyond
//! touching says so in [`is_active`] and [`reach`]; its parameters are its own, a table by pair of materials.

use super::{
    normal::Loading,
    state::{ContactState, Law},
};
use crate::{
    model::Cohesion,
    scene::{Assembly, Pair},
};

/// Whether a contact of this pair of materials acts.
#[inline(always)]
pub fn is_active(law: Law, _materials: usize, gap: f64, _was_active: bool) -> bool {
    match law.cohesion {
        Cohesion::None => gap < 0.0,
    }
}

/// Whether surfaces that act on each other overlap. Those that do not only attract.
#[inline(always)]
pub fn overlaps(law: Law, _gap: f64) -> bool {
    match law.cohesion {
        Cohesion::None => true,
    }
}

/// Attraction, N, >= 0.
#[inline(always)]
pub fn cohesive_force(law: Law, _c: &ContactState) -> f64 {
    match law.cohesion {
        Cohesion::None => 0.0,
    }
}

/// Its energy, J, <= 0, and 0 where it ends.
#[inline(always)]
pub fn cohesive_energy(law: Law, _c: &ContactState) -> f64 {
    match law.cohesion {
        Cohesion::None => 0.0,
    }
}

/// How far beyond touching contacts of a scene may act, m: lists reach as far.
pub fn reach(_assembly: &Assembly) -> f64 {
    0.0
}

/// The largest slope of the attraction, N/m.
pub fn largest_stiffness(_pair: &Pair, _loading: &Loading) -> f64 {
    0.0
}
