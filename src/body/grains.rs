//! Twin of `shaders/body/grains/`: what a grain is, a body or a clump of bodies that moves and turns as one.

use crate::{
    body::{ForceTorque, bodies::Velocities, rotation::surface_velocity},
    space::{
        boundary::{carried, past_flow, wrap},
        dimension::{all_equal, conjugate, largest, moment, quaternion_product, rotate, rotation_increment},
        precision::{Point, SplitOrientation, add_rotation, displaced, norm_defect, requantised, spin_tolerance},
    },
};
use crate::{
    model::{Grains, Method, Model},
    state::{Orientation, State, Velocity},
};
use glam::{DVec3, DVec4};
use std::ops::Range;

/// Whether bodies i and j belong to one grain.
#[inline(always)]
pub fn same_grain(s: &State, i: usize, j: usize) -> bool {
    match s.model.grains {
        Grains::Spheres => i == j,
        Grains::Clumps => s.clump_of_id[s.id[i] as usize] == s.clump_of_id[s.id[j] as usize],
    }
}

/// The bodies of the grain of body i.
pub fn members(s: &State, i: usize) -> impl Iterator<Item = usize> + '_ {
    let clumped = s.model.grains == Grains::Clumps;
    let labels = if clumped { member_ids(s, s.clump_of_id[s.id[i] as usize] as usize) } else { i..i + 1 };
    labels.map(move |member_id| if clumped { s.index_of_id[member_id] as usize } else { member_id })
}

/// All there is to know of a clump.
#[derive(Clone, Copy, Debug)]
pub struct Clump {
    pub center: Point,
    /// Unit quaternion (x, y, z, w).
    pub orientation: DVec4,
    pub velocity: Velocity,
    /// rad/s, along the axes that [`spins_in_scene`] says.
    pub spin: DVec3,
    /// 1/(kg m²)
    pub inverse_moments: DVec3,
}

/// Clump c, of whose position one array has the leading digits and another the rest; the rest is there in single
/// precision only.
pub fn clump(s: &State, c: usize) -> Clump {
    let low = s.center_low.get(c).copied().unwrap_or_default();
    let rest = s.orientation_low.get(c).map_or(DVec4::ZERO, |r| r.0);
    Clump {
        center: Point { x: s.center[c], low },
        orientation: s.orientation[c].0 + rest,
        velocity: s.clump_velocity[c],
        spin: s.clump_spin[c].0,
        inverse_moments: s.inverse_moments[c].0,
    }
}

/// Numbers of the members of clump c.
pub fn member_ids(s: &State, c: usize) -> Range<usize> {
    s.first_member[c] as usize..s.first_member[c + 1] as usize
}

/// Whether a clump's spin is kept along the axes of the scene, and not along its own: where no product of angular
/// velocities turns up in (2.21)-(2.23), and in contact dynamics, where impulses change it there.
pub fn spins_in_scene(model: &Model, inverse_moments: DVec3) -> bool {
    model.method == Method::ContactDynamics || all_equal(model.dimension, inverse_moments)
}

/// Spin along the axes of the scene, rad/s.
pub fn global_spin(s: &State, inverse_moments: DVec3, q: DVec4, w: DVec3) -> DVec3 {
    if spins_in_scene(&s.model, inverse_moments) { w } else { rotate(q, w) }
}

/// The same spin along the principal axes, rad/s.
pub fn own_spin(s: &State, here: &Clump, w: DVec3) -> DVec3 {
    if spins_in_scene(&s.model, here.inverse_moments) { rotate(conjugate(here.orientation), w) } else { w }
}

/// From the centre of the clump to a member, m.
#[inline(always)]
pub fn arm_of(s: &State, q: DVec4, member_id: usize) -> DVec3 {
    rotate(q, s.member_offset[member_id].0)
}

/// From the centre of the grain of body i to the body, m.
pub fn arm_in_grain(s: &State, i: usize) -> DVec3 {
    match s.model.grains {
        Grains::Spheres => DVec3::ZERO,
        Grains::Clumps => {
            let c = s.clump_of_id[s.id[i] as usize] as usize;
            arm_of(s, clump(s, c).orientation, s.id[i] as usize)
        }
    }
}

/// Force and moment, about the clump's centre, of what `member_force` and `member_torque` hold for its members.
pub fn clump_load(s: &State, c: usize, q: DVec4) -> ForceTorque {
    let mut sum = ForceTorque::default();
    for member_id in member_ids(s, c) {
        let i = s.index_of_id[member_id] as usize;
        let force = s.member_force[i];
        sum.force += force;
        sum.torque += s.member_torque[i].0 + moment(arm_of(s, q, member_id), force);
    }
    sum
}

/// How far the attitude turns in a step (2.40): a turn about the axes of the scene comes from the left, one about those
/// of the body from the right. What rounding has done to its length is undone.
pub fn orientation_increment(s: &State, c: usize, here: &Clump, w: DVec3) -> DVec4 {
    let q = here.orientation;
    let rest = s.orientation_low.get(c).map_or(DVec4::ZERO, |r| r.0);
    let turn = rotation_increment(0.25 * s.params.dt * w);
    let increment = if spins_in_scene(&s.model, here.inverse_moments) {
        quaternion_product(turn, q)
    } else {
        quaternion_product(q, turn)
    };
    increment + 0.5 * norm_defect(s.orientation[c].0, rest) * q
}

/// Δω of a step, rad/s, and the rounds that it took.
#[derive(Clone, Copy, Debug)]
pub struct SpinIncrement {
    pub spin: DVec3,
    pub rounds: u32,
    pub settled: bool,
}

/// A step of a clump is not settled after so many rounds.
pub const MAX_ITERATIONS: u32 = 25;

/// Whether rounds that look for the change of a spin have found it: the last of them has moved it by a small part of
/// itself only, or by no less than the round before and by what the rounding of the spin may do. Errors that were small
/// beside the spin, and not beside its change, would take energy, in every step the same way.
pub fn has_settled(s: &State, moved: f64, moved_before: f64, change: DVec3, spin: DVec3) -> bool {
    let (change, spin, tolerance) = (largest(change), largest(spin), spin_tolerance(s));
    let (small, rounding) = (tolerance * change.max(SMALL_CHANGE * spin), tolerance * change.max(spin));
    !(moved > small) || (!(moved < moved_before) && !(moved > rounding))
}

/// Of a spin: below it no change is found with more digits.
const SMALL_CHANGE: f64 = 1e-3;

/// A step of a clump has taken this many.
pub fn count_iterations(s: &mut State, count: u32, settled: bool) {
    s.rotation_iterations[0].most = s.rotation_iterations[0].most.max(count);
    s.rotation_iterations[0].capped += u32::from(!settled);
}

/// Clump c changes its velocity and its spin by this much.
pub fn changed_clump_velocities(s: &State, c: usize, here: &Clump, change: DVec3, spin_change: DVec3) -> Velocities {
    let low = s.clump_velocity_low.get(c).copied().unwrap_or_default();
    Velocities::changed(s, here.velocity, here.spin, low, [change, spin_change])
}

/// A clump has these velocities next.
fn store_clump_velocity(s: &mut State, c: usize, next: Velocities) {
    s.clump_velocity_next[c] = next.velocity;
    s.clump_spin_next[c] = next.spin;
    if let Some(low) = s.clump_velocity_low_next.get_mut(c) {
        *low = next.low;
    }
}

/// The attitude of clump c with all its parts.
fn split_orientation(s: &State, c: usize) -> SplitOrientation {
    let part = |of: &[Orientation]| of.get(c).map_or(DVec4::ZERO, |part| part.0);
    SplitOrientation { q: s.orientation[c].0, low: part(&s.orientation_low), rest: part(&s.orientation_rest) }
}

/// What a clump is after a step in which its velocities change by this much.
pub struct Moved {
    center: Point,
    velocities: Velocities,
    orientation: SplitOrientation,
}

impl Moved {
    pub fn of(s: &State, c: usize, here: &Clump, change: DVec3, spin_change: DVec3) -> Moved {
        let velocities = changed_clump_velocities(s, c, here, change, spin_change);
        let (v, w) = (velocities.velocity.v, velocities.spin.0);
        let start = requantised(s, here.center);
        Moved {
            center: wrap(
                s,
                s.model.boundary,
                displaced(s, start.x, start.low, s.params.dt * carried(s, s.model.boundary, start.x, v)),
            ),
            velocities,
            orientation: add_rotation(s, &split_orientation(s, c), orientation_increment(s, c, here, w)),
        }
    }

    pub fn store(self, s: &mut State, c: usize) {
        s.center_next[c] = self.center.x;
        store_clump_velocity(s, c, self.velocities);
        s.orientation_next[c] = Orientation(self.orientation.q);
        if !s.center_low_next.is_empty() {
            s.center_low_next[c] = self.center.low;
            s.orientation_low_next[c] = Orientation(self.orientation.low);
            s.orientation_rest_next[c] = Orientation(self.orientation.rest);
        }
    }
}

/// A clump has these velocities next, and its members those that belong to them, where they are.
pub fn set_clump_velocity(s: &mut State, c: usize, here: &Clump, next: Velocities) {
    store_clump_velocity(s, c, next);
    let spin = global_spin(s, here.inverse_moments, here.orientation, next.spin.0);
    for member_id in member_ids(s, c) {
        let i = s.index_of_id[member_id] as usize;
        let arm = arm_of(s, here.orientation, member_id);
        let v = past_flow(s, s.model.boundary, next.velocity.v + surface_velocity(spin, arm), arm);
        s.velocity_next[i] = Velocity { v, inverse_mass: next.velocity.inverse_mass };
        s.spin_next[i].0 = spin;
    }
}

/// w over the inverse moments; on the device a spin in the plane has no components that could be 0 / 0.
pub fn spins_over(w: DVec3, inverse_moments: DVec3) -> DVec3 {
    DVec3::select(inverse_moments.cmpeq(DVec3::ZERO), DVec3::ZERO, w / inverse_moments)
}
