//! Twin of `shaders/contact/law.wgsl`: one contact, seen from one of its two sides.

use super::{
    damping::dashpot_force,
    geometry::{Separation, branch_vector, sphere_separation, unit_or},
    materials::pair_of,
    normal::normal_force,
    tangential::{slid_spring, sliding_power, stretched_spring},
};
use crate::{
    body::{Body, bodies::body, rotation::surface_velocity},
    model::{Damping, Tangential},
    space::walls::{wall_normal_before, wall_separation, wall_velocity},
    state::{Pair, State},
};
use glam::DVec3;

/// What acts on one side of a contact.
#[derive(Clone, Copy, Debug, Default)]
pub struct Contact {
    /// m
    pub gap: f64,
    /// If not, nothing below means anything.
    pub closed: bool,
    /// N, on the grain of interest.
    pub force: DVec3,
    /// m, from its centre to the contact point.
    pub arm: DVec3,
    /// N, the tangential part of the force.
    pub spring: DVec3,
    /// N, what the dashpot adds to the force.
    pub damping: DVec3,
    /// W, of dashpot and sliding.
    pub dissipation: f64,
}

/// All that the laws of contact know of the scene; what they know of two surfaces they are told.
#[derive(Clone, Copy, Debug)]
pub struct Law {
    pub damping: Damping,
    pub tangential: Tangential,
    /// s, since springs were stretched last.
    pub history_dt: f64,
}

impl Law {
    pub fn of(s: &State) -> Law {
        Law { damping: s.model.damping, tangential: s.model.tangential, history_dt: s.params.history_dt }
    }
}

/// What two surfaces in contact do to the one that n points away from, N and W.
pub struct ContactForce {
    pub force: DVec3,
    pub spring: DVec3,
    pub damping: DVec3,
    pub dissipation: f64,
}

#[expect(clippy::too_many_arguments, reason = "the same as on the device")]
#[inline(always)]
pub fn contact_force(
    law: Law,
    pair: &Pair,
    gap: f64,
    n: DVec3,
    n_before: DVec3,
    v_rel: DVec3,
    inverse_mass: f64,
    old: DVec3,
) -> ContactForce {
    let approach = v_rel.dot(n);
    let damping = dashpot_force(law.damping, pair, approach, inverse_mass);
    let pressing = normal_force(pair, gap) + damping;
    let stretched = stretched_spring(law, old, pair, n, n_before, v_rel);
    let spring = slid_spring(stretched, pair, pressing);
    let dissipation = damping * approach + sliding_power(law, old, stretched, spring, pair);
    ContactForce { force: spring - pressing * n, spring, damping: -damping * n, dissipation }
}

/// All that the contact of two grains depends on, seen from one of them.
#[derive(Clone, Copy, Debug, Default)]
pub struct GrainPair {
    /// m, to the centre of the other; never zero.
    pub branch: DVec3,
    /// m/s, relative to the other.
    pub v: DVec3,
    /// rad/s, its own and the other's.
    pub spin: DVec3,
    pub spin_to: DVec3,
    /// N, the spring a step ago.
    pub old: DVec3,
    /// m, its own and the other's, and what single precision leaves out of both.
    pub radius: f64,
    pub radius_to: f64,
    pub radii_rest: f64,
    /// 1/kg, of both.
    pub inverse_mass: f64,
    pub pair: Pair,
}

/// Grain j seen from grain i.
#[inline(always)]
pub fn grain_pair(s: &State, i: usize, here: &Body, j: usize, old: DVec3) -> GrainPair {
    let there = body(s, j);
    GrainPair {
        branch: branch_vector(s, i, j),
        v: here.velocity.v - there.velocity.v,
        spin: here.spin,
        spin_to: there.spin,
        old,
        radius: here.position.radius,
        radius_to: there.position.radius,
        radii_rest: here.low.radius + there.low.radius,
        inverse_mass: here.velocity.inverse_mass + there.velocity.inverse_mass,
        pair: pair_of(s, i, j),
    }
}

/// The contact of two grains. It has no branches, so that many can be computed at a time. (On a device both grains
/// compute it from the same side, so that the results are opposite to the last bit; here they are anyway, because f64 in
/// Rust is not reordered.)
#[inline(always)]
pub fn grain_contact(law: Law, m: &GrainPair) -> Contact {
    let Separation { gap, n } = sphere_separation(m.branch, m.radius, m.radius_to, m.radii_rest);
    let arm = (m.radius + 0.5 * gap) * n; // erratum E7: one shared point, mid-overlap
    let arm_to = -(m.radius_to + 0.5 * gap) * n;
    let v_rel = m.v + (surface_velocity(m.spin, arm) - surface_velocity(m.spin_to, arm_to));
    let n_before = unit_or(m.branch + law.history_dt * m.v, n);
    let p = contact_force(law, &m.pair, gap, n, n_before, v_rel, m.inverse_mass, m.old);
    let closed = gap < 0.0;
    Contact { gap, closed, force: p.force, arm, spring: p.spring, damping: p.damping, dissipation: p.dissipation }
}

/// The contact of grain i with wall w, whose spring was `old`.
#[inline(always)]
pub fn wall_contact(s: &State, i: usize, here: &Body, w: usize, old: DVec3) -> Contact {
    let wall = &s.wall[w];
    let Separation { gap, n } = wall_separation(wall, &here.position, here.low);
    if !(gap < 0.0) {
        return Contact { gap, ..Contact::default() };
    }
    let arm = (here.position.radius + 0.5 * gap) * n;
    let v_rel = (here.velocity.v - wall_velocity(wall, here.position.x + arm)) + surface_velocity(here.spin, arm);
    let n_before = wall_normal_before(s, wall, here.position.x - s.params.history_dt * here.velocity.v);
    let pair = pair_of(s, i, s.sizes.bodies + w);
    let p = contact_force(Law::of(s), &pair, gap, n, n_before, v_rel, here.velocity.inverse_mass, old);
    let closed = gap < 0.0;
    Contact { gap, closed, force: p.force, arm, spring: p.spring, damping: p.damping, dissipation: p.dissipation }
}

/// The contact of grain i with neighbour j, whose spring was `old`.
#[inline(always)]
pub fn contact_of(s: &State, i: usize, here: &Body, j: usize, old: DVec3) -> Contact {
    match j.checked_sub(s.sizes.bodies) {
        None => grain_contact(Law::of(s), &grain_pair(s, i, here, j, old)),
        Some(w) => wall_contact(s, i, here, w, old),
    }
}
