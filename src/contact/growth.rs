//! Twin of `shaders/contact/growth/`: radii that change, and what contacts see of it.

use super::{materials::material_of, normal};
use crate::{
    model::{Growth, Normal},
    state::State,
};
use glam::DVec3;

/// How fast the radius of body i, or of a wall, which has none, grows over itself, 1/s.
#[inline(always)]
pub fn growth_rate_of(s: &State, i: usize) -> f64 {
    match s.model.growth {
        Growth::None => 0.0,
        Growth::Some => s.growth_rate[material_of(s, i)],
    }
}

/// The velocity of two surfaces past each other, if that of their centres is v; they move away from these at speeds that
/// add up to `speed`.
#[inline(always)]
pub fn past_growth(v: DVec3, branch: DVec3, speed: f64) -> DVec3 {
    v + branch * (speed / branch.length())
}

/// Work of growth on what a contact holds, per time, W, with this pressing force, N: on surfaces that move away from their
/// centres at this speed, and on normal energy that grows with the effective radius, which grows at this rate, over itself.
/// (What tangential and rolling springs hold changes with it, too, by less than a thousandth of all this; it is left out.)
#[inline(always)]
pub fn growth_power(law: Normal, pressing: f64, gap: f64, speed: f64, bending: f64) -> f64 {
    pressing * (speed - normal::energy_of_radius(law) * gap * bending)
}

/// The same on the energies of body i, W: mass comes with the velocity, the spin and the place of the body.
#[inline(always)]
pub fn growth_power_of_mass(s: &State, i: usize, translation: f64, spin: f64, potential: f64) -> f64 {
    let dims = s.model.dims() as f64;
    growth_rate_of(s, i) * (dims * (translation + potential) + (dims + 2.0) * spin)
}
