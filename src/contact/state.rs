//! What all laws of contact are told: the choices of the scene, and the state of the contact.

use crate::{
    model::{Cohesion, Damping, Dimension, Normal, Rolling, Rotation, Tangential, Twist},
    state::State,
};
use glam::DVec3;

/// The choices of a scene for its contacts, and where laws have tables of their own.
#[derive(Clone, Copy)]
pub struct Law<'a> {
    pub state: &'a State,
    pub normal: Normal,
    pub damping: Damping,
    pub tangential: Tangential,
    pub rolling: Rolling,
    pub twist: Twist,
    pub cohesion: Cohesion,
    pub dimension: Dimension,
    pub rotation: Rotation,
    /// s, since history was brought up to date: 0 in the first step.
    pub history_dt: f64,
}

impl Law<'_> {
    pub fn of(s: &State) -> Law<'_> {
        let m = &s.model;
        Law {
            state: s,
            normal: m.normal,
            damping: m.damping,
            tangential: m.tangential,
            rolling: m.rolling,
            twist: m.twist,
            cohesion: m.cohesion,
            dimension: m.dimension,
            rotation: m.rotation,
            history_dt: s.params.history_dt,
        }
    }
}

/// All that the laws of contact know of two surfaces, seen from the first of the two.
#[derive(Clone, Copy, Debug, Default)]
pub struct ContactState {
    /// m, < 0 is overlap.
    pub gap: f64,
    /// m, by what the gap has grown in this step.
    pub opening: f64,
    /// From the first to the second.
    pub n: DVec3,
    /// A step ago.
    pub n_before: DVec3,
    /// Of the contact about `n` in this step, see [`twist_of`](super::twist::twist_of).
    pub twist: f64,
    /// m/s, of the first past the second at the contact point.
    pub v: DVec3,
    /// rad/s, of the first relative to the second.
    pub spin: DVec3,
    /// 1/kg, 1/m_i + 1/m_j.
    pub inverse_mass: f64,
    /// m, effective: 1/R = 1/R_i + 1/R_j.
    pub radius: f64,
    /// 1/(kg m²), of both about the contact point.
    pub inverse_rolling_inertia: f64,
    /// Where their pair of materials is in tables of pairs.
    pub materials: usize,
}
