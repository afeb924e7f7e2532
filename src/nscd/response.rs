//! Twin of `shaders/nscd/response/`: what impulses do to grains in contact dynamics. A sphere answers to those of its
//! own contacts; members hand theirs to their clump, which answers with its full inertia, and get the velocities of its
//! surface.

use crate::{
    body::{
        ForceTorque,
        grains::{Clump, arm_of, clump, clump_load, own_spin, spins_over},
        rotation::{inverse_inertia, spin_of, surface_velocity},
    },
    contact::materials::pair_of,
    nscd::contact::{FreeMotion, damping_factor, free_spin_change, free_velocity_change, impulse_inverse_mass},
    space::{
        boundary::past_flow,
        dimension::{conjugate, largest, moment, rotate, spin_dot, spin_squared},
        precision::{low_of, spin_low_of},
    },
};
use crate::{
    model::Grains,
    solve::natural_map::{OrientedContact, UpdateScales, largest_eigenvalue, update_scales},
    state::{InverseEffectiveMass, Spin, State, Velocity, VelocityLow},
    units::Quantity,
};
use glam::{DMat3, DVec3};
use rayon::prelude::*;
use std::ops::Mul;

/// Body i at the end of the step if nothing touched its grain. From `free_velocities` to `move_clumps`
/// `clump_velocity_next` and `clump_spin_next` have by how much velocities would change in the step then.
pub fn free_motion(s: &State, i: usize) -> FreeMotion {
    match s.model.grains {
        Grains::Spheres => {
            let (now, w) = (s.velocity[i], spin_of(s, i));
            let [low, spin_low] = lows_of(s, now.v, w, s.velocity_low.get(i));
            let rest = low + free_velocity_change(s, &now);
            FreeMotion { v: now.v, rest, spin: w + (spin_low + free_spin_change(s, &now, w)) }
        }
        Grains::Clumps => {
            let member_id = s.id[i] as usize;
            let c = s.clump_of_id[member_id] as usize;
            let here = clump(s, c);
            let [low, spin_low] = lows_of(s, here.velocity.v, here.spin, s.clump_velocity_low.get(c));
            let spin = here.spin + (spin_low + s.clump_spin_next[c].0);
            let arm = arm_of(s, here.orientation, member_id);
            let surface = past_flow(s, s.model.boundary, surface_velocity(spin, arm), arm);
            FreeMotion { v: here.velocity.v, rest: low + s.clump_velocity_next[c].v + surface, spin }
        }
    }
}

/// What a velocity and a spin have beyond f32.
fn lows_of(s: &State, v: DVec3, w: DVec3, low: Option<&VelocityLow>) -> [DVec3; 2] {
    low.map_or([DVec3::ZERO; 2], |low| [low_of(s, Quantity::Velocity, v, low.v), spin_low_of(s, w, low.spin)])
}

/// The number of the grain that body i is, or belongs to.
pub fn grain_of(s: &State, i: usize) -> u32 {
    match s.model.grains {
        Grains::Spheres => s.id[i],
        Grains::Clumps => s.clump_of_id[s.id[i] as usize],
    }
}

/// Inverse inertia that impulses act on, along the axes of the scene, 1/(kg m²).
pub fn inverse_inertia_of(s: &State, here: &Clump) -> DMat3 {
    let of = |axis: DVec3| rotate(here.orientation, here.inverse_moments * rotate(conjugate(here.orientation), axis));
    damping_factor(s) * DMat3::from_cols(of(DVec3::X), of(DVec3::Y), of(DVec3::Z))
}

/// Velocity, m/s, of the point at the end of an arm from member i for an impulse there, N s.
fn delassus_block(s: &State, i: usize, arm: DVec3) -> DMat3 {
    let member_id = s.id[i] as usize;
    let here = clump(s, s.clump_of_id[member_id] as usize);
    let (inverse_mass, inertia) = (impulse_inverse_mass(s, i), inverse_inertia_of(s, &here));
    let arm = arm_of(s, here.orientation, member_id) + arm;
    let column = |axis: DVec3| point_response(inverse_mass, inertia, arm, axis);
    DMat3::from_cols(column(DVec3::X), column(DVec3::Y), column(DVec3::Z))
}

/// Velocity, m/s, that an impulse, N s, gives the point of a grain where it acts, at the end of an arm from its centre.
pub fn point_response(
    inverse_mass: f64,
    inverse_inertia: impl Mul<DVec3, Output = DVec3>,
    arm: DVec3,
    impulse: DVec3,
) -> DVec3 {
    inverse_mass * impulse + (inverse_inertia * arm.cross(impulse)).cross(arm)
}

/// What an impulse does to bodies i and j, which may be a wall, and the largest eigenvalue of W, 1/kg.
pub fn inverse_effective_mass_of(s: &State, i: usize, j: usize, gap: f64, n: DVec3) -> (InverseEffectiveMass, f64) {
    let arms = |i: usize| s.position.get(i).map_or(0.0, |position| position.radius + 0.5 * gap);
    let (own, other) = (arms(i), arms(j));
    match s.model.grains {
        Grains::Spheres => {
            let weight = |i: usize| s.velocity.get(i).map_or(0.0, |_| impulse_inverse_mass(s, i));
            let rotational = |i: usize, arm: f64| {
                s.position.get(i).map_or(0.0, |position| arm * arm * inverse_inertia(s, position, weight(i)))
            };
            let normal = weight(i) + weight(j);
            let tangential = normal + (rotational(j, other) + rotational(i, own));
            (InverseEffectiveMass { arm: own, arm_to: other, normal, tangential }, tangential)
        }
        Grains::Clumps => {
            let mut w = delassus_block(s, i, own * n);
            if j < s.sizes.bodies {
                w += delassus_block(s, j, -other * n);
            }
            if s.model.dims() == 2 {
                // Nothing moves out of the plane.
                (w.x_axis.z, w.y_axis.z, w.z_axis) = (0.0, 0.0, DVec3::ZERO);
            }
            let UpdateScales { normal, tangential } = update_scales(&w, n, pair_of(s, i, j).friction);
            (InverseEffectiveMass { arm: own, arm_to: other, normal, tangential }, largest_eigenvalue(&w))
        }
    }
}

/// The largest eigenvalue of W_kk + C, 1/kg; of clumps, or more.
pub fn natural_map_scale(s: &State, entry: usize, side: &OrientedContact, compliance: &UpdateScales) -> f64 {
    match s.model.grains {
        Grains::Spheres => side.normal.max(side.tangential),
        Grains::Clumps => s.delassus_eigenvalue[entry] + compliance.normal.max(compliance.tangential),
    }
}

/// What an impulse does to a point of body i at most, along the normal and across, 1/kg.
pub fn largest_response(s: &State, i: usize) -> UpdateScales {
    let (inverse_mass, radius) = (impulse_inverse_mass(s, i), s.position[i].radius);
    match s.model.grains {
        Grains::Spheres => {
            let turning = radius * radius * inverse_inertia(s, &s.position[i], inverse_mass);
            UpdateScales { normal: inverse_mass, tangential: inverse_mass + turning }
        }
        Grains::Clumps => {
            let member_id = s.id[i] as usize;
            let turning = damping_factor(s) * largest(s.inverse_moments[s.clump_of_id[member_id] as usize].0);
            let most = inverse_mass + (s.member_offset[member_id].0.length() + radius).powi(2) * turning;
            UpdateScales { normal: most, tangential: most }
        }
    }
}

/// The body that stands for the grain of body i while sweeps go on: of a clump, the first member.
pub fn standing_for(s: &State, i: usize) -> usize {
    match s.model.grains {
        Grains::Spheres => i,
        Grains::Clumps => s.index_of_id[s.first_member[grain_of(s, i) as usize] as usize] as usize,
    }
}

/// Velocity and spin that impulses give sphere i at the end of the step.
pub fn response(s: &State, i: usize, sum: &ForceTorque) -> (Velocity, DVec3) {
    let inverse_mass = impulse_inverse_mass(s, i);
    let inertia = inverse_inertia(s, &s.position[i], inverse_mass);
    (Velocity { v: inverse_mass * sum.force, inverse_mass }, inertia * sum.torque)
}

/// Clumps will answer to the impulses of their members.
pub fn store_member_load(s: &mut State, sums: impl Iterator<Item = ForceTorque>) {
    for (i, sum) in sums.enumerate() {
        (s.member_force[i], s.member_torque[i]) = (sum.force, Spin(sum.torque));
    }
}

/// Velocity and spin with which body i begins a pass.
pub fn extrapolated_velocity_of(s: &State, i: usize) -> (DVec3, DVec3) {
    (s.extrapolated_velocity[i].v, s.extrapolated_spin.get(i).map_or(DVec3::ZERO, |spin| spin.0))
}

/// A body as a contact of a colour holds it.
#[derive(Clone, Copy, Debug)]
pub struct ContactBody {
    /// Of the body; of a clump, for all of which the first member stands while sweeps go on, that of the first member.
    pub velocity: Velocity,
    pub spin: DVec3,
    /// m, from its centre to the contact point.
    pub arm: DVec3,
    /// m, from the centre of the grain to its centre.
    member_arm: DVec3,
    /// Its index.
    first: usize,
}

/// Body i with the velocities that sweeps have left it, at the end of an arm from its centre.
pub fn contact_body(s: &State, i: usize, arm: DVec3) -> ContactBody {
    let (first, member_arm, arm) = match s.model.grains {
        Grains::Spheres => (i, DVec3::ZERO, arm),
        Grains::Clumps => {
            let c = grain_of(s, i) as usize;
            let (q, member_id) = (clump(s, c).orientation, s.first_member[c] as usize);
            let member_arm = arm_of(s, q, member_id);
            (s.index_of_id[member_id] as usize, member_arm, (arm_of(s, q, s.id[i] as usize) + arm) - member_arm)
        }
    };
    ContactBody {
        velocity: s.extrapolated_velocity[first],
        spin: extrapolated_velocity_of(s, first).1,
        arm,
        member_arm,
        first,
    }
}

/// What an impulse there makes of the velocity and the spin that stand for the grain.
pub fn apply_impulse(s: &State, i: usize, body: &ContactBody, impulse: DVec3) -> VelocityUpdate {
    let inverse_mass = body.velocity.inverse_mass;
    let (v, spin) = match s.model.grains {
        Grains::Spheres => {
            let inertia = inverse_inertia(s, &s.position[i], inverse_mass);
            (inverse_mass * impulse, inertia * moment(body.arm, impulse))
        }
        Grains::Clumps => {
            let inertia = inverse_inertia_of(s, &clump(s, grain_of(s, i) as usize));
            let spin = inertia * moment(body.member_arm + body.arm, impulse);
            (inverse_mass * impulse + surface_velocity(spin, body.member_arm), spin)
        }
    };
    VelocityUpdate { first: body.first, v: body.velocity.v + v, spin: body.spin + spin }
}

/// Velocity and spin of a body from now on.
#[derive(Clone, Copy, Debug)]
pub struct VelocityUpdate {
    first: usize,
    v: DVec3,
    spin: DVec3,
}

impl VelocityUpdate {
    pub fn store(&self, s: &mut State) {
        s.extrapolated_velocity[self.first].v = self.v;
        if let Some(spin) = s.extrapolated_spin.get_mut(self.first) {
            spin.0 = self.spin;
        }
    }
}

/// Kinetic energy of a body with these velocities, twice, J.
pub fn kinetic_metric(s: &State, i: usize, inverse_mass: f64, v: DVec3, w: DVec3) -> f64 {
    let inertia = inverse_inertia(s, &s.position[i], inverse_mass);
    let of = |squared: f64, inverse: f64| if inverse == 0.0 { 0.0 } else { squared / inverse };
    of(v.length_squared(), inverse_mass) + of(spin_squared(w), inertia)
}

/// How a clump moves.
#[derive(Clone, Copy, Debug)]
pub struct RigidVelocity {
    pub v: DVec3,
    /// Along the axes of the scene.
    pub spin: DVec3,
}

/// The product of two of them, J, with the inertia that impulses act on: of one with itself, twice its kinetic energy.
pub fn clump_kinetic_metric(s: &State, here: &Clump, a: &RigidVelocity, b: &RigidVelocity) -> f64 {
    if here.velocity.inverse_mass == 0.0 {
        return 0.0;
    }
    let turning = spin_dot(own_spin(s, here, a.spin), spins_over(own_spin(s, here, b.spin), here.inverse_moments));
    (a.v.dot(b.v) / here.velocity.inverse_mass + turning) / damping_factor(s)
}

/// From a to b.
pub fn velocity_difference(a: &RigidVelocity, b: &RigidVelocity) -> RigidVelocity {
    RigidVelocity { v: b.v - a.v, spin: b.spin - a.spin }
}

/// What the impulses that its members hold add to how a clump moves.
pub fn impulse_response(s: &State, c: usize, here: &Clump) -> RigidVelocity {
    let sum = clump_load(s, c, here.orientation);
    RigidVelocity {
        v: damping_factor(s) * here.velocity.inverse_mass * sum.force,
        spin: inverse_inertia_of(s, here) * sum.torque,
    }
}

/// How its surface moves where a member is.
pub fn member_velocity(s: &State, here: &Clump, velocity: &RigidVelocity, member_id: usize) -> Velocity {
    let v = velocity.v + surface_velocity(velocity.spin, arm_of(s, here.orientation, member_id));
    Velocity { v, inverse_mass: damping_factor(s) * here.velocity.inverse_mass }
}

/// How a clump moves whose first member has these velocities.
pub fn from_first_member(s: &State, c: usize, here: &Clump, first: DVec3, spin: DVec3) -> RigidVelocity {
    let arm = arm_of(s, here.orientation, s.first_member[c] as usize);
    RigidVelocity { v: first - surface_velocity(spin, arm), spin }
}

/// As a pass starts from it, or sweeps have left it.
pub fn extrapolated_clump(s: &State, c: usize, here: &Clump) -> RigidVelocity {
    let (v, spin) = extrapolated_velocity_of(s, s.index_of_id[s.first_member[c] as usize] as usize);
    from_first_member(s, c, here, v, spin)
}

/// Of every clump.
pub fn clump_velocities(s: &State, of: impl Fn(&State, usize, &Clump) -> RigidVelocity + Sync) -> Vec<RigidVelocity> {
    (0..s.sizes.clumps).into_par_iter().with_min_len(64).map(|c| of(s, c, &clump(s, c))).collect()
}
