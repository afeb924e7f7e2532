//! Twin of `shaders/answer/`: what impulses do to grains in contact dynamics. A sphere answers to those of its own contacts; members
//! hand theirs to their clump, which answers with its full inertia, and get the velocities of its surface.

use super::{
    contact::Gathered,
    dimension::{conjugate, moment, spin_dot, spin_squared, turned},
    grains::{Clump, arm_of, clump, gathered_by_clump, own_spin, spins_over},
    materials::pair_of,
    rigid::{freed, freed_spin, held},
    rotation::{inverse_inertia, spin_of, surface_velocity},
};
use crate::{
    cd::contact::largest_eigenvalue,
    model::Grains,
    state::{Lever, Motion, Spin, State},
};
use glam::{DMat3, DVec3};
use rayon::prelude::*;

/// Velocity of body i at the end of the step if nothing touched it, and the inverse mass that impulses meet.
pub fn free_motion(s: &State, i: usize) -> Motion {
    match s.model.grains {
        Grains::Spheres => freed(s, &s.motion[i]),
        Grains::Clumps => s.motion_next[i], // since `release`
    }
}

/// The same for the spin of a sphere.
pub fn free_spin(s: &State, i: usize) -> DVec3 {
    freed_spin(s, &s.motion[i], spin_of(s, i))
}

/// The number of the grain that body i is, or belongs to.
pub fn grain_of(s: &State, i: usize) -> u32 {
    match s.model.grains {
        Grains::Spheres => s.number[i],
        Grains::Clumps => s.owner[s.number[i] as usize],
    }
}

/// Inverse inertia that impulses meet, along the axes of the scene, 1/(kg m²).
pub fn inverse_inertia_of(s: &State, here: &Clump) -> DMat3 {
    let of = |axis: DVec3| turned(here.attitude, here.inverse_moments * turned(conjugate(here.attitude), axis));
    held(s) * DMat3::from_cols(of(DVec3::X), of(DVec3::Y), of(DVec3::Z))
}

/// Velocity, m/s, of the point at the end of an arm from member i for an impulse there, N s.
fn block_of(s: &State, i: usize, arm: DVec3) -> DMat3 {
    let label = s.number[i] as usize;
    let here = clump(s, s.owner[label] as usize);
    let (inverse_mass, inertia) = (free_motion(s, i).inverse_mass, inverse_inertia_of(s, &here));
    let arm = arm_of(s, here.attitude, label) + arm;
    let of = |axis: DVec3| inverse_mass * axis + (inertia * arm.cross(axis)).cross(arm);
    DMat3::from_cols(of(DVec3::X), of(DVec3::Y), of(DVec3::Z))
}

/// What an impulse does to bodies i and j, which may be a wall, and the largest eigenvalue of W, 1/kg.
pub fn lever_of(s: &State, i: usize, j: usize, gap: f64, n: DVec3) -> (Lever, f64) {
    let arms = |i: usize| s.place.get(i).map_or(0.0, |place| place.radius + 0.5 * gap);
    let (own, other) = (arms(i), arms(j));
    match s.model.grains {
        Grains::Spheres => {
            let weight = |i: usize| s.motion.get(i).map_or(0.0, |_| free_motion(s, i).inverse_mass);
            let turned = |i: usize, arm: f64| {
                s.place.get(i).map_or(0.0, |place| arm * arm * inverse_inertia(s, place, weight(i)))
            };
            let normal = weight(i) + weight(j);
            let tangential = normal + (turned(j, other) + turned(i, own));
            (Lever { own, other, normal, tangential }, tangential)
        }
        Grains::Clumps => {
            let mut w = block_of(s, i, own * n);
            if j < s.sizes.bodies {
                w += block_of(s, j, -other * n);
            }
            if s.model.dims() == 2 {
                // Nothing moves out of the plane.
                (w.x_axis.z, w.y_axis.z, w.z_axis) = (0.0, 0.0, DVec3::ZERO);
            }
            let across = DMat3::IDENTITY - DMat3::from_cols(n * n.x, n * n.y, n * n.z);
            let (normal, tangential) = (n.dot(w * n), largest_eigenvalue(&(across * w * across)));
            // More than W has there: so much that the two are nowhere less than W, which joins them, and that friction at its
            // limit, which answers to the normal impulse, makes it overshoot by half at most.
            let turned_aside = ((w * n) / normal - n).length();
            let joined = turned_aside * (normal / tangential).sqrt();
            let more = (1.0 + joined).max((1.0 + pair_of(s, i, j).friction * turned_aside) / 1.5);
            let lever = Lever { own, other, normal: more * normal, tangential: (1.0 + joined) * tangential };
            (lever, largest_eigenvalue(&w))
        }
    }
}

/// The largest eigenvalue of W_kk, 1/kg.
pub fn weight_of(s: &State, slot: usize, tangential: f64) -> f64 {
    match s.model.grains {
        Grains::Spheres => tangential,
        Grains::Clumps => s.mobility[slot],
    }
}

/// Velocity and spin that impulses give sphere i at the end of the step.
pub fn answer(s: &State, i: usize, sum: &Gathered) -> (Motion, DVec3) {
    let free = free_motion(s, i);
    let inertia = inverse_inertia(s, &s.place[i], free.inverse_mass);
    (Motion { v: free.v + free.inverse_mass * sum.force, ..free }, free_spin(s, i) + inertia * sum.torque)
}

/// Clumps will answer to the impulses of their members.
pub fn hold(s: &mut State, sums: impl Iterator<Item = Gathered>) {
    for (i, sum) in sums.enumerate() {
        (s.pull[i], s.twist[i]) = (sum.force, Spin(sum.torque));
    }
}

/// Velocity and spin with which body i begins a pass.
pub fn ahead(s: &State, i: usize) -> (DVec3, DVec3) {
    (s.ahead[i].v, s.ahead_spin.get(i).map_or(DVec3::ZERO, |spin| spin.0))
}

/// A body as a contact of a colour holds it.
#[derive(Clone, Copy, Debug)]
pub struct Grip {
    /// Of the body; of a clump, for all of which the first member stands while sweeps go on, that of the first member.
    pub motion: Motion,
    pub spin: DVec3,
    /// m, from its centre to the contact point.
    pub arm: DVec3,
    /// m, from the centre of the grain to its centre.
    lead: DVec3,
    /// Its index.
    first: usize,
}

/// Body i with the velocities that sweeps have left it, at the end of an arm from its centre.
pub fn gripped(s: &State, i: usize, arm: DVec3) -> Grip {
    let (first, lead, arm) = match s.model.grains {
        Grains::Spheres => (i, DVec3::ZERO, arm),
        Grains::Clumps => {
            let c = grain_of(s, i) as usize;
            let (q, label) = (clump(s, c).attitude, s.first_member[c] as usize);
            let lead = arm_of(s, q, label);
            (s.whereabouts[label] as usize, lead, (arm_of(s, q, s.number[i] as usize) + arm) - lead)
        }
    };
    Grip { motion: s.ahead[first], spin: ahead(s, first).1, arm, lead, first }
}

/// What an impulse there makes of the velocity and the spin that stand for the grain.
pub fn pushed(s: &State, i: usize, grip: &Grip, impulse: DVec3) -> Push {
    let inverse_mass = grip.motion.inverse_mass;
    let (v, spin) = match s.model.grains {
        Grains::Spheres => {
            let inertia = inverse_inertia(s, &s.place[i], inverse_mass);
            (inverse_mass * impulse, inertia * moment(grip.arm, impulse))
        }
        Grains::Clumps => {
            let inertia = inverse_inertia_of(s, &clump(s, grain_of(s, i) as usize));
            let spin = inertia * moment(grip.lead + grip.arm, impulse);
            (inverse_mass * impulse + surface_velocity(spin, grip.lead), spin)
        }
    };
    Push { first: grip.first, v: grip.motion.v + v, spin: grip.spin + spin }
}

/// Velocity and spin of a body from now on.
#[derive(Clone, Copy, Debug)]
pub struct Push {
    first: usize,
    v: DVec3,
    spin: DVec3,
}

impl Push {
    pub fn keep(&self, s: &mut State) {
        s.ahead[self.first].v = self.v;
        if let Some(spin) = s.ahead_spin.get_mut(self.first) {
            spin.0 = self.spin;
        }
    }
}

/// Kinetic energy of a body with these velocities, twice, J.
pub fn metric(s: &State, i: usize, inverse_mass: f64, v: DVec3, w: DVec3) -> f64 {
    let inertia = inverse_inertia(s, &s.place[i], inverse_mass);
    let of = |squared: f64, inverse: f64| if inverse == 0.0 { 0.0 } else { squared / inverse };
    of(v.length_squared(), inverse_mass) + of(spin_squared(w), inertia)
}

/// How a clump moves.
#[derive(Clone, Copy, Debug)]
pub struct Course {
    pub v: DVec3,
    /// Along the axes of the scene.
    pub spin: DVec3,
}

/// The product of two of them, J, with the inertia that impulses meet: of one with itself, twice its kinetic energy.
pub fn metric_of_clump(s: &State, here: &Clump, a: &Course, b: &Course) -> f64 {
    if here.motion.inverse_mass == 0.0 {
        return 0.0;
    }
    let turning = spin_dot(own_spin(s, here, a.spin), spins_over(own_spin(s, here, b.spin), here.inverse_moments));
    (a.v.dot(b.v) / here.motion.inverse_mass + turning) / held(s)
}

/// From a to b.
pub fn course_change(a: &Course, b: &Course) -> Course {
    Course { v: b.v - a.v, spin: b.spin - a.spin }
}

/// What the impulses that its members hold add to how a clump moves.
pub fn push_of(s: &State, c: usize, here: &Clump) -> Course {
    let sum = gathered_by_clump(s, c, here.attitude);
    Course { v: freed(s, &here.motion).inverse_mass * sum.force, spin: inverse_inertia_of(s, here) * sum.torque }
}

/// How a clump moves with them.
pub fn course_of(s: &State, c: usize, here: &Clump) -> Course {
    let push = push_of(s, c, here);
    Course { v: s.clump_motion_next[c].v + push.v, spin: s.clump_spin_next[c].0 + push.spin }
}

/// How its surface moves where a member is.
pub fn member_motion(s: &State, here: &Clump, course: &Course, label: usize) -> Motion {
    let v = course.v + surface_velocity(course.spin, arm_of(s, here.attitude, label));
    Motion { v, inverse_mass: freed(s, &here.motion).inverse_mass }
}

/// How a clump moves whose first member has these velocities.
pub fn course_by(s: &State, c: usize, here: &Clump, first: DVec3, spin: DVec3) -> Course {
    let arm = arm_of(s, here.attitude, s.first_member[c] as usize);
    Course { v: first - surface_velocity(spin, arm), spin }
}

/// As a pass starts from it, or sweeps have left it.
pub fn course_ahead(s: &State, c: usize, here: &Clump) -> Course {
    let (v, spin) = ahead(s, s.whereabouts[s.first_member[c] as usize] as usize);
    course_by(s, c, here, v, spin)
}

/// Of every clump.
pub fn courses(s: &State, of: impl Fn(&State, usize, &Clump) -> Course + Sync) -> Vec<Course> {
    (0..s.sizes.clumps).into_par_iter().with_min_len(64).map(|c| of(s, c, &clump(s, c))).collect()
}
