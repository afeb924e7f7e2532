//! Twin of `shaders/measure/energies/`: what a grain has by itself.

use super::{
    contacts::{clump_velocity_change_now, contact_of, velocity_change_now},
    sums::Energies,
};
use crate::{
    body::{
        Body, ForceTorque,
        bodies::body,
        grains::{Clump, arm_of, clump, global_spin, member_ids, own_spin, spins_over},
        rotation::{spin_energy, surface_velocity},
    },
    contact::contacts::{closed_contacts, contacts_of_clump},
    model::Grains,
    space::{
        boundary::past_flow,
        dimension::{outer_above, spin_dot},
    },
    state::State,
};
use glam::{DVec3, DVec4};

/// What a free body has by itself, with the force of its contacts and that of their dashpots; a member of a clump has
/// nothing.
#[inline(always)]
pub fn energies(s: &State, here: &Body, sum: &ForceTorque, drag: &ForceTorque) -> Energies {
    if s.model.grains == Grains::Clumps {
        return Energies::default();
    }
    let (p, mass) = (&s.params, 1.0 / here.velocity.inverse_mass);
    let (change, spin_change) = velocity_change_now(s, here, sum);
    let (v, w) = (here.velocity.v + change, here.spin + spin_change);
    let kinetic = 0.5 * mass * v.length_squared() + spin_energy(s, here, w);
    let late = drag.force.dot(change) + spin_dot(drag.torque, spin_change);
    Energies {
        kinetic,
        potential: -mass * p.gravity.dot(here.position.x + here.low.x),
        net_force: (sum.force + mass * p.gravity).length(),
        // Dashpots know the velocities of half a step ago, but it is those of now that they work against.
        dissipation: 2.0 * p.damping * kinetic - late,
        flux: mass * v * v,
        flux_above: outer_above(mass * v, v),
    }
}

/// J, of a free clump that spins so along its principal axes.
fn clump_spin_energy(here: &Clump, w: DVec3) -> f64 {
    0.5 * spin_dot(w, spins_over(w, here.inverse_moments))
}

/// By how much more power the dashpots of a clump would take, W, if the velocities of half a step ago, with which they
/// were computed, were those of now: v and, along the axes of the scene, w.
pub fn damping_correction(s: &State, c: usize, q: DVec4, v: DVec3, w: DVec3) -> f64 {
    let mut sum = 0.0;
    for member_id in member_ids(s, c) {
        let i = s.index_of_id[member_id] as usize;
        let here = body(s, i);
        let arm = arm_of(s, q, member_id);
        let change = past_flow(s, s.model.boundary, v + surface_velocity(w, arm), arm) - here.velocity.v;
        for (_, contact) in closed_contacts(s, i, &here, contact_of) {
            sum -= contact.damping.dot(change + surface_velocity(w - here.spin, contact.arm));
            sum -= spin_dot(contact.couple_damping, w - here.spin);
        }
    }
    sum
}

/// What a free clump has by itself, as [`energies`].
pub fn energies_of_clump(s: &State, c: usize) -> Energies {
    let (p, here) = (&s.params, clump(s, c));
    let inverse_mass = here.velocity.inverse_mass;
    if inverse_mass == 0.0 {
        return Energies::default();
    }
    let all = contacts_of_clump(s, c, here.orientation, contact_of);
    let (change, spin_change) = clump_velocity_change_now(s, c, &here, &all);
    let (v, w) = (here.velocity.v + change, here.spin + spin_change);
    let kinetic = 0.5 * v.length_squared() / inverse_mass + clump_spin_energy(&here, own_spin(s, &here, w));
    let spin = global_spin(s, here.inverse_moments, here.orientation, w);
    Energies {
        kinetic,
        potential: -p.gravity.dot(here.center.x + here.center.low) / inverse_mass,
        net_force: (all.force + p.gravity / inverse_mass).length(),
        dissipation: 2.0 * p.damping * kinetic + damping_correction(s, c, here.orientation, v, spin),
        flux: v * v / inverse_mass,
        flux_above: outer_above(v / inverse_mass, v),
    }
}
