//! Twin of `shaders/contact/rolling/`: rolling resistance. Grains roll freely.

use super::{
    law::{ContactState, Law},
    normal::Loading,
};
use crate::{
    scene::{self, Assembly},
    state::State,
};
use glam::DVec3;

/// Parameters of a pair of materials: none.
pub type Parameters = ();

/// Those of i and j; wall w is number `bodies + w`.
#[inline(always)]
pub fn parameters_of(_s: &State, _i: usize, _j: usize) -> Parameters {}

/// The parameters of a scene, into the arrays that this slot owns: none.
pub fn fill(_s: &mut State, _assembly: &Assembly) {}

/// What a contact remembers.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RollingHistory {
    /// N m
    pub torque: DVec3,
}

/// The rolling part of a contact, on the first of the two.
#[derive(Clone, Copy, Debug, Default)]
pub struct Rolling {
    /// N m
    pub couple: DVec3,
    pub history: RollingHistory,
    /// W
    pub dissipation: f64,
}

#[inline(always)]
pub fn rolling_contact(_law: Law, _c: &ContactState, _stiffness: f64, _pressing: f64, _old: RollingHistory) -> Rolling {
    Rolling::default()
}

/// The moment of a contact's force and its couple, N m.
#[inline(always)]
pub fn with_couple(_law: Law, torque: DVec3, _couple: DVec3) -> DVec3 {
    torque
}

/// Energy stored in the rolling spring, J.
#[inline(always)]
pub fn rolling_energy(_law: Law, _c: &ContactState, _stiffness: f64, _h: RollingHistory) -> f64 {
    0.0
}

/// The largest slope of the couple under this loading, N m.
pub fn largest_stiffness(_pair: &scene::Pair, _loading: &Loading) -> f64 {
    0.0
}
