//! Twin of `shaders/contact/growth/`: radii that change, and what contacts see of it.

use super::{
    geometry::{Separation, sphere_separation},
    law::{Contact, GrainPair},
    materials::material_of,
    normal,
};
use crate::{
    body::Body,
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

impl GrainPair {
    /// How fast the surfaces move away from the centres, both together, m/s.
    #[inline(always)]
    pub fn surface_growth(&self) -> f64 {
        self.growth * self.radius + self.growth_to * self.radius_to
    }
}

/// Work of growth on what a contact of two grains holds, with this force on the first, per time, W: that of the pressing
/// force on surfaces that move, and of normal energy that grows with the effective radius. (What tangential and rolling springs
/// hold changes with it, too, by less than a thousandth of all this; it is left out.)
#[inline(always)]
pub fn growth_power(law: Normal, pair: &GrainPair, force: DVec3) -> f64 {
    let GrainPair { growth, growth_to, radius, radius_to, branch, .. } = *pair;
    let Separation { gap, .. } = sphere_separation(branch, radius, radius_to, pair.radii_rest);
    let bending = (growth * radius_to + growth_to * radius) / (radius + radius_to);
    let pressing = -force.dot(branch) / branch.length();
    pressing * (pair.surface_growth() - normal::energy_of_radius(law) * gap * bending)
}

/// The same of a contact of grain i with a wall.
pub fn growth_power_at_wall(s: &State, i: usize, here: &Body, contact: &Contact) -> f64 {
    let (rate, radius) = (growth_rate_of(s, i), here.position.radius);
    let pressing = -contact.force.dot(contact.arm) / (radius + 0.5 * contact.gap);
    pressing * (rate * radius - normal::energy_of_radius(s.model.normal) * contact.gap * rate)
}

/// The same on the energies of body i, J, W: mass comes with the velocity, the spin and the place of the body.
#[inline(always)]
pub fn growth_power_of_mass(s: &State, i: usize, translation: f64, spin: f64, potential: f64) -> f64 {
    let dims = s.model.dims() as f64;
    growth_rate_of(s, i) * (dims * (translation + potential) + (dims + 2.0) * spin)
}
