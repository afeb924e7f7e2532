//! Twin of `shaders/space/precision/`: in single precision a position is a multiple of a quantum and a low part.

use crate::space::dimension::rotate;
use crate::{
    model::Precision,
    state::{Params, PositionLow, State},
};
use glam::{DVec3, DVec4};

/// A position: in single precision a multiple of the quantum and a low part, m.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Point {
    pub x: DVec3,
    pub low: DVec3,
}

/// What grain i has beyond its place; nothing in double precision.
#[inline(always)]
pub fn position_low_of(s: &State, i: usize) -> PositionLow {
    s.position_low.get(i).copied().unwrap_or_default()
}

/// The multiple of the quantum nearest to d, m.
#[inline(always)]
pub fn quantised(p: &Params, d: DVec3) -> DVec3 {
    p.quantum * (d * p.inverse_quantum + DVec3::splat(0.5)).floor()
}

/// x + low part + step, split anew.
#[inline(always)]
pub fn displaced(s: &State, x: DVec3, low: DVec3, step: DVec3) -> Point {
    match s.model.precision {
        Precision::Double => Point { x: x + step, low: DVec3::ZERO },
        Precision::Single => {
            let y = low + step;
            let whole = quantised(&s.params, y);
            Point { x: x + whole, low: y - whole }
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
    2.0_f64.powi(extent.log2().ceil() as i32 - 22)
}

/// The unit of the leading 15 bits of lengths up to `reach`.
pub fn split(reach: f64) -> f64 {
    2.0_f64.powi(reach.log2().ceil() as i32 - 15)
}

/// An attitude: in single precision a multiple of a quantum and a low part, quaternions (x, y, z, w).
#[derive(Clone, Copy, Debug)]
pub struct SplitOrientation {
    pub q: DVec4,
    pub low: DVec4,
}

/// What attitudes are kept as multiples of: the rest is their low part.
const ATTITUDE_QUANTUM: f64 = 1.0 / 2048.0;

/// 1 - |q|² of q + low part.
pub fn norm_defect(q: DVec4, low: DVec4) -> f64 {
    (1.0 - q.length_squared()) - (2.0 * q.dot(low) + low.length_squared())
}

/// The end of an arm that is turned by q + low part. (In single precision the device takes pains for its digits.)
#[inline(always)]
pub fn arm_end(s: &State, center: Point, q: DVec4, low: DVec4, arm: DVec3) -> Point {
    displaced(s, center.x, center.low, rotate(q + low, arm))
}

/// q + low part + step, split anew.
pub fn add_rotation(s: &State, q: DVec4, low: DVec4, step: DVec4) -> SplitOrientation {
    match s.model.precision {
        Precision::Double => SplitOrientation { q: q + step, low: DVec4::ZERO },
        Precision::Single => {
            let y = low + step;
            let whole = ATTITUDE_QUANTUM * (y * (1.0 / ATTITUDE_QUANTUM) + DVec4::splat(0.5)).floor();
            SplitOrientation { q: q + whole, low: y - whole }
        }
    }
}

/// Rounds of predictor and corrector end when they change Δω by less than this part of ω.
pub fn spin_tolerance(s: &State) -> f64 {
    match s.model.precision {
        Precision::Double => 1e-12,
        Precision::Single => 1e-6,
    }
}
