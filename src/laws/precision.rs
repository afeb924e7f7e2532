//! Twin of `shaders/precision/`: in single precision a position is a multiple of a quantum and a residue.

use crate::{
    model::Precision,
    state::{Params, Residue, State},
};
use glam::DVec3;

/// A position: in single precision a multiple of the quantum and a residue, m.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Point {
    pub x: DVec3,
    pub residue: DVec3,
}

/// What grain i has beyond its place; nothing in double precision.
#[inline(always)]
pub fn residue_of(s: &State, i: usize) -> Residue {
    s.residue.get(i).copied().unwrap_or_default()
}

/// The multiple of the quantum nearest to d, m.
#[inline(always)]
pub fn quantised(p: &Params, d: DVec3) -> DVec3 {
    p.quantum * (d * p.inverse_quantum + DVec3::splat(0.5)).floor()
}

/// x + residue + step, split anew.
#[inline(always)]
pub fn moved(s: &State, x: DVec3, residue: DVec3, step: DVec3) -> Point {
    match s.model.precision {
        Precision::Double => Point { x: x + step, residue: DVec3::ZERO },
        Precision::Single => {
            let y = residue + step;
            let whole = quantised(&s.params, y);
            Point { x: x + whole, residue: y - whole }
        }
    }
}

/// Distance less the radii, m. (In single precision the device takes pains for the digits that are lost in this.)
#[inline(always)]
pub fn gap_between(distance: f64, a: f64, b: f64, radii_rest: f64) -> f64 {
    distance - (a + b + radii_rest)
}

/// The quantum for coordinates up to `extent`: four units in the last place of f32, so that grains may go four times as
/// far before the sums lose anything.
pub fn quantum(extent: f64) -> f64 {
    2.0_f64.powi(extent.max(1e-30).log2().ceil() as i32 - 22)
}

/// The unit of the leading 15 bits of lengths up to `reach`.
pub fn split(reach: f64) -> f64 {
    2.0_f64.powi(reach.log2().ceil() as i32 - 15)
}
