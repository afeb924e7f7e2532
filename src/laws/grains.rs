//! Twin of `shaders/grains/`: what a grain is, a body or a clump of bodies that moves and turns as one.

use super::{
    contact::{Body, Gathered, body, closed_contacts, contacts_of, motion_now},
    dimension::{all_equal, attitude_gain, conjugate, gyroscopic, largest, moment, product, spin_dot, turned},
    leapfrog::at_step,
    precision::{Point, attitude_defect, spin_tolerance},
    rotation::{half_spun, spin_energy, spin_gained, surface_velocity},
};
use crate::{
    model::Grains,
    state::{Motion, State},
};
use glam::{DVec3, DVec4};
use rayon::prelude::*;
use std::ops::Range;

/// Whether bodies i and j belong to one grain.
#[inline(always)]
pub fn same_grain(s: &State, i: usize, j: usize) -> bool {
    match s.model.grains {
        Grains::Spheres => i == j,
        Grains::Clumps => s.owner[s.number[i] as usize] == s.owner[s.number[j] as usize],
    }
}

/// What a grain has by itself at step n: J, J, N and W. Twin of `Energies`.
#[derive(Clone, Copy, Debug, Default)]
pub struct Energies {
    pub kinetic: f64,
    pub potential: f64,
    pub net_force: f64,
    /// Of global damping, and what dashpots take less because velocities have changed since the half step.
    pub dissipation: f64,
}

/// What a free body has by itself, with the force of its contacts and that of their dashpots; a member of a clump has nothing.
pub fn energies(s: &State, here: &Body, sum: &Gathered, drag: DVec3) -> Energies {
    if s.model.grains == Grains::Clumps {
        return Energies::default();
    }
    let (p, inverse_mass) = (&s.params, here.motion.inverse_mass);
    let (v, w) = motion_now(s, here, sum);
    let kinetic = 0.5 * v.length_squared() / inverse_mass + spin_energy(s, here, w);
    Energies {
        kinetic,
        potential: -p.gravity.dot(here.place.x + here.residue.x) / inverse_mass,
        net_force: (sum.force + p.gravity / inverse_mass).length(),
        // Dashpots know the velocities of half a step ago, but it is those of now that they work against.
        dissipation: 2.0 * p.damping * kinetic - drag.dot(v - here.motion.v),
    }
}

/// All there is to know of a clump.
#[derive(Clone, Copy, Debug)]
pub struct Clump {
    pub center: Point,
    /// Unit quaternion (x, y, z, w).
    pub attitude: DVec4,
    pub motion: Motion,
    /// rad/s, along the principal axes; of a round one along those of the scene.
    pub spin: DVec3,
    /// 1/(kg m²)
    pub inverse_moments: DVec3,
}

/// A position that one array has the leading digits of, and another the rest; the rest is there in single precision only.
pub fn clump(s: &State, c: usize) -> Clump {
    let residue = s.center_residue.get(c).copied().unwrap_or_default();
    let rest = s.attitude_residue.get(c).map_or(DVec4::ZERO, |r| r.0);
    Clump {
        center: Point { x: s.center[c], residue },
        attitude: s.attitude[c].0 + rest,
        motion: s.clump_motion[c],
        spin: s.clump_spin[c].0,
        inverse_moments: s.inverse_moments[c].0,
    }
}

/// Numbers of the members of clump c.
pub fn labels(s: &State, c: usize) -> Range<usize> {
    s.first_member[c] as usize..s.first_member[c + 1] as usize
}

/// Whether no product of angular velocities turns up in (2.21)-(2.23).
pub fn is_round(s: &State, inverse_moments: DVec3) -> bool {
    all_equal(s.model.dimension, inverse_moments)
}

/// Spin along the axes of the scene, rad/s.
pub fn global_spin(s: &State, inverse_moments: DVec3, q: DVec4, w: DVec3) -> DVec3 {
    if is_round(s, inverse_moments) { w } else { turned(q, w) }
}

/// From the centre of the clump to a member, m.
#[inline(always)]
pub fn arm_of(s: &State, q: DVec4, label: usize) -> DVec3 {
    turned(q, s.offset[label].0)
}

/// Force and moment, about the clump's centre, of all contacts of all its members. The springs stay as they are.
pub fn contacts_of_clump(s: &State, c: usize, q: DVec4) -> Gathered {
    let mut sum = Gathered::default();
    for label in labels(s, c) {
        let i = s.whereabouts[label] as usize;
        let member = contacts_of(s, i, &body(s, i));
        sum.force += member.force;
        sum.torque += member.torque + moment(arm_of(s, q, label), member.force);
    }
    sum
}

/// By how much more power the dashpots of a clump would take, W, if the velocities of half a step ago, with which they were
/// computed, were those of now: v and, along the axes of the scene, w.
pub fn dashpots_late(s: &State, c: usize, q: DVec4, v: DVec3, w: DVec3) -> f64 {
    let mut sum = 0.0;
    for label in labels(s, c) {
        let i = s.whereabouts[label] as usize;
        let here = body(s, i);
        let change = v + surface_velocity(w, arm_of(s, q, label)) - here.motion.v;
        for (_, contact) in closed_contacts(s, i, &here) {
            sum -= contact.damping.dot(change + surface_velocity(w - here.spin, contact.arm));
        }
    }
    sum
}

/// Angular acceleration (2.21)-(2.23) without damping, rad/s².
pub fn spin_acceleration(s: &State, here: &Clump, w: DVec3, torque: DVec3) -> DVec3 {
    here.inverse_moments * (torque + gyroscopic(s.model.dimension, w, here.inverse_moments))
}

/// Δω of a step, rad/s, and the rounds that it took.
#[derive(Clone, Copy, Debug)]
pub struct Gain {
    pub spin: DVec3,
    pub rounds: u32,
    pub settled: bool,
}

/// A step that is not settled after so many rounds is counted.
pub const MOST_ROUNDS: u32 = 25;

/// Rounds of predictor and corrector (2.24)-(2.31), until none changes Δω by more than a small part of ω. The torque is along the
/// principal axes. Damping is solved for, as in (2.19), so that the iteration has to find the products of ω alone.
pub fn gained(s: &State, here: &Clump, torque: DVec3, before: DVec3) -> Gain {
    let gain_at = |w: DVec3| spin_gained(s, here.spin, spin_acceleration(s, here, w, torque));
    let (mut gain, mut rounds, mut settled) = (before, 0, false);
    while !settled && rounds < MOST_ROUNDS {
        let predicted = gain_at(here.spin + 0.5 * gain);
        gain = gain_at(here.spin + 0.5 * predicted);
        rounds += 1;
        let scale = largest(here.spin).max(largest(gain));
        settled = !(largest(gain - predicted) > spin_tolerance(s) * scale);
    }
    Gain { spin: gain, rounds, settled }
}

/// The moment along the axes in which the clump spins.
pub fn own_torque(here: &Clump, torque: DVec3) -> DVec3 {
    turned(conjugate(here.attitude), torque)
}

/// Spin at step n, rad/s, in the axes in which the clump spins; the torque is along those of the scene.
pub fn spin_of_clump_now(s: &State, c: usize, here: &Clump, torque: DVec3) -> DVec3 {
    if !is_round(s, here.inverse_moments) {
        return here.spin + 0.5 * gained(s, here, own_torque(here, torque), s.spin_gain[c].0).spin;
    }
    if here.motion.inverse_mass == 0.0 {
        return here.spin;
    }
    half_spun(s, here.spin, here.inverse_moments * torque)
}

/// How far the attitude turns in a step (2.40): a turn about the axes of the scene comes from the left, one about those of the
/// body from the right. What rounding has done to its length is undone.
pub fn attitude_step(s: &State, c: usize, here: &Clump, w: DVec3) -> DVec4 {
    let q = here.attitude;
    let rest = s.attitude_residue.get(c).map_or(DVec4::ZERO, |r| r.0);
    let turn = attitude_gain(0.25 * s.params.dt * w);
    let way = if is_round(s, here.inverse_moments) { product(turn, q) } else { product(q, turn) };
    way + 0.5 * attitude_defect(s.attitude[c].0, rest) * q
}

/// Clumps and their members have the velocities next, where they are, that a law gives with the contacts of a clump.
pub fn set_motions(s: &mut State, law: impl Fn(&State, usize, &Clump, &Gathered) -> (DVec3, DVec3) + Sync) {
    let of = |c| law(s, c, &clump(s, c), &contacts_of_clump(s, c, clump(s, c).attitude));
    let motions: Vec<(DVec3, DVec3)> = (0..s.sizes.clumps).into_par_iter().with_min_len(64).map(of).collect();
    for (c, (v, w)) in motions.into_iter().enumerate() {
        set_motion(s, c, &clump(s, c), v, w);
    }
}

/// A clump and its members have these velocities next, where they are.
fn set_motion(s: &mut State, c: usize, here: &Clump, v: DVec3, w: DVec3) {
    s.clump_motion_next[c] = Motion { v, inverse_mass: here.motion.inverse_mass };
    s.clump_spin_next[c].0 = w;
    let spin = global_spin(s, here.inverse_moments, here.attitude, w);
    for label in labels(s, c) {
        let i = s.whereabouts[label] as usize;
        let v = v + surface_velocity(spin, arm_of(s, here.attitude, label));
        s.motion_next[i] = Motion { v, inverse_mass: here.motion.inverse_mass };
        s.spin_next[i].0 = spin;
    }
}

/// w over the inverse moments; on the device a spin in the plane has no components that could be 0 / 0.
fn spins_over(w: DVec3, inverse_moments: DVec3) -> DVec3 {
    DVec3::select(inverse_moments.cmpeq(DVec3::ZERO), DVec3::ZERO, w / inverse_moments)
}

/// What a free clump has by itself, as [`energies`].
pub fn energies_of_clump(s: &State, c: usize) -> Energies {
    let (p, here) = (&s.params, clump(s, c));
    let inverse_mass = here.motion.inverse_mass;
    if inverse_mass == 0.0 {
        return Energies::default();
    }
    let all = contacts_of_clump(s, c, here.attitude);
    let v = at_step(s, &here.motion, all.force);
    let w = spin_of_clump_now(s, c, &here, all.torque);
    let kinetic = 0.5 * v.length_squared() / inverse_mass + 0.5 * spin_dot(w, spins_over(w, here.inverse_moments));
    let spin = global_spin(s, here.inverse_moments, here.attitude, w);
    Energies {
        kinetic,
        potential: -p.gravity.dot(here.center.x + here.center.residue) / inverse_mass,
        net_force: (all.force + p.gravity / inverse_mass).length(),
        dissipation: 2.0 * p.damping * kinetic + dashpots_late(s, c, here.attitude, v, spin),
    }
}
