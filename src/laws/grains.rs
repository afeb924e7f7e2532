//! Twin of `shaders/grains/`: what a grain is, a body or a clump of bodies that moves and turns as one.

use super::{
    boundary::wrapped,
    contact::{Body, Gathered, body, closed_contacts, contacts_of, motion_now},
    dimension::{all_equal, attitude_gain, conjugate, moment, product, spin_dot, turned},
    leapfrog::at_step,
    precision::{Point, Turning, attitude_defect, moved, turned_on},
    predictor_corrector::spin_of_clump_now,
    rotation::{spin_energy, surface_velocity},
};
use crate::{
    model::{Grains, Method, Model},
    state::{Attitude, Motion, State},
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

/// The bodies of the grain of body i.
pub fn members(s: &State, i: usize) -> impl Iterator<Item = usize> + '_ {
    let clumped = s.model.grains == Grains::Clumps;
    let labels = if clumped { labels(s, s.owner[s.number[i] as usize] as usize) } else { i..i + 1 };
    labels.map(move |label| if clumped { s.whereabouts[label] as usize } else { label })
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
    /// rad/s, along the axes that [`spins_in_scene`] says.
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

/// Whether a clump's spin is kept along the axes of the scene, and not along its own: where no product of angular velocities turns up
/// in (2.21)-(2.23), and in contact dynamics, where impulses change it there.
pub fn spins_in_scene(model: &Model, inverse_moments: DVec3) -> bool {
    model.method == Method::ContactDynamics || all_equal(model.dimension, inverse_moments)
}

/// Spin along the axes of the scene, rad/s.
pub fn global_spin(s: &State, inverse_moments: DVec3, q: DVec4, w: DVec3) -> DVec3 {
    if spins_in_scene(&s.model, inverse_moments) { w } else { turned(q, w) }
}

/// The same spin along the principal axes, rad/s.
pub fn own_spin(s: &State, here: &Clump, w: DVec3) -> DVec3 {
    if spins_in_scene(&s.model, here.inverse_moments) { turned(conjugate(here.attitude), w) } else { w }
}

/// J, of a free clump that spins so along its principal axes.
fn turning_energy(here: &Clump, w: DVec3) -> f64 {
    0.5 * spin_dot(w, spins_over(w, here.inverse_moments))
}

/// From the centre of the clump to a member, m.
#[inline(always)]
pub fn arm_of(s: &State, q: DVec4, label: usize) -> DVec3 {
    turned(q, s.offset[label].0)
}

/// Force and moment, about the clump's centre, of what `pull` and `twist` hold for its members.
pub fn gathered_by_clump(s: &State, c: usize, q: DVec4) -> Gathered {
    let mut sum = Gathered::default();
    for label in labels(s, c) {
        let i = s.whereabouts[label] as usize;
        let force = s.pull[i];
        sum.force += force;
        sum.torque += s.twist[i].0 + moment(arm_of(s, q, label), force);
    }
    sum
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

/// How far the attitude turns in a step (2.40): a turn about the axes of the scene comes from the left, one about those of the
/// body from the right. What rounding has done to its length is undone.
pub fn attitude_step(s: &State, c: usize, here: &Clump, w: DVec3) -> DVec4 {
    let q = here.attitude;
    let rest = s.attitude_residue.get(c).map_or(DVec4::ZERO, |r| r.0);
    let turn = attitude_gain(0.25 * s.params.dt * w);
    let way = if spins_in_scene(&s.model, here.inverse_moments) { product(turn, q) } else { product(q, turn) };
    way + 0.5 * attitude_defect(s.attitude[c].0, rest) * q
}

/// A step of a clump is not settled after so many rounds.
pub const MOST_ROUNDS: u32 = 25;

/// A step of a clump has taken this many.
pub fn count_rounds(s: &mut State, count: u32, settled: bool) {
    s.rounds[0].most = s.rounds[0].most.max(count);
    s.rounds[0].capped += u32::from(!settled);
}

/// Velocity and, in the axes in which it spins, spin of a clump at step n.
pub fn clump_motion_now(s: &State, c: usize, here: &Clump, sum: &Gathered) -> (DVec3, DVec3) {
    match s.model.method {
        Method::DiscreteElements => (at_step(s, &here.motion, sum.force), spin_of_clump_now(s, c, here, sum.torque)),
        Method::ContactDynamics => (here.motion.v, here.spin),
    }
}

/// What a clump is after a step with these velocities.
pub struct Moved {
    center: Point,
    motion: Motion,
    spin: DVec3,
    attitude: Turning,
}

impl Moved {
    pub fn of(s: &State, c: usize, here: &Clump, v: DVec3, w: DVec3) -> Moved {
        let residue = s.attitude_residue.get(c).map_or(DVec4::ZERO, |r| r.0);
        Moved {
            center: wrapped(s, moved(s, here.center.x, here.center.residue, s.params.dt * v)),
            motion: Motion { v, inverse_mass: here.motion.inverse_mass },
            spin: w,
            attitude: turned_on(s, s.attitude[c].0, residue, attitude_step(s, c, here, w)),
        }
    }

    pub fn keep(self, s: &mut State, c: usize) {
        s.center_next[c] = self.center.x;
        s.clump_motion_next[c] = self.motion;
        s.clump_spin_next[c].0 = self.spin;
        s.attitude_next[c] = Attitude(self.attitude.q);
        if !s.center_residue_next.is_empty() {
            s.center_residue_next[c] = self.center.residue;
            s.attitude_residue_next[c] = Attitude(self.attitude.residue);
        }
    }
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
pub fn set_motion(s: &mut State, c: usize, here: &Clump, v: DVec3, w: DVec3) {
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
pub fn spins_over(w: DVec3, inverse_moments: DVec3) -> DVec3 {
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
    let (v, w) = clump_motion_now(s, c, &here, &all);
    let kinetic = 0.5 * v.length_squared() / inverse_mass + turning_energy(&here, own_spin(s, &here, w));
    let spin = global_spin(s, here.inverse_moments, here.attitude, w);
    Energies {
        kinetic,
        potential: -p.gravity.dot(here.center.x + here.center.residue) / inverse_mass,
        net_force: (all.force + p.gravity / inverse_mass).length(),
        dissipation: 2.0 * p.damping * kinetic + dashpots_late(s, c, here.attitude, v, spin),
    }
}
