//! Twin of `shaders/precision/`: in single precision a position is a multiple of a quantum and a residue.

use super::boundary::image;
use crate::state::{Params, State};
use glam::DVec3;

/// What the position of grain i has beyond `place.x`, m; zero in double precision.
pub fn residue_of(s: &State, i: usize) -> DVec3 {
    s.residue.get(i).copied().unwrap_or_default()
}

/// The multiple of the quantum nearest to d, m.
pub fn quantised(p: &Params, d: DVec3) -> DVec3 {
    p.quantum * (d * p.inverse_quantum + DVec3::splat(0.5)).floor()
}

/// x + step, brought into the domain; what is less than a quantum goes into the residue. Without a residue, plainly.
pub fn displace(s: &State, x: DVec3, residue: Option<&mut DVec3>, step: DVec3) -> DVec3 {
    let Some(residue) = residue else {
        let sum = x + step;
        return sum - s.params.period * image(s, sum);
    };
    let y = *residue + step;
    let whole = quantised(&s.params, y);
    let moved = x + whole;
    let k = image(s, moved);
    *residue = (y - whole) - s.params.period_rest * k;
    moved - s.params.period * k
}

/// The quantum for coordinates up to `extent`: four units in the last place of f32, so that grains may go four times as
/// far before the sums lose anything.
pub fn quantum(extent: f64) -> f64 {
    2.0_f64.powi(extent.max(1e-30).log2().ceil() as i32 - 22)
}
