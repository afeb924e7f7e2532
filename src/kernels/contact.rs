//! Twin of `shaders/contact.wgsl`: force and moment of all contacts of one grain, in ascending order of the other's id.

use super::rows;
use crate::{
    laws::{
        dashpot::dashpot_force,
        dimension::moment,
        friction::{forget_spring, tangential_force},
        materials::pair_of,
        normal::normal_force,
        precision::residue_of,
        rotation::{spin_of, surface_velocity},
        touch::{touch_grain, unit_or},
        walls::{touch_wall, wall_normal_before, wall_velocity},
    },
    model::Rotation,
    state::{NONE, Spin, State},
};
use glam::DVec3;
use rayon::prelude::*;

pub fn contact(s: &mut State) {
    let (mut force, mut torque) = (std::mem::take(&mut s.force), std::mem::take(&mut s.torque));
    let mut spring = std::mem::take(&mut s.spring);
    let bodies = force.par_iter_mut().zip(rows(&mut spring, &s.slot_start)).enumerate();
    let of_body = |((i, (force, springs)), torque): ((usize, (&mut DVec3, &mut [DVec3])), &mut Spin)| {
        let gathered = contacts_of(s, i, springs);
        (*force, torque.0) = (gathered.force, gathered.torque);
        if gathered.crossed { (s.sizes.bodies - i) as u32 } else { 0 }
    };
    let bad = match s.model.rotation {
        Rotation::None => bodies.map(|body| of_body((body, &mut Spin::default()))).max(),
        Rotation::Sphere => bodies.zip(&mut torque).map(of_body).max(),
    };
    (s.force, s.torque, s.spring) = (force, torque, spring);
    s.counters[0].bad_body = s.counters[0].bad_body.max(bad.unwrap_or(0));
}

/// Sums over the contacts of a grain.
#[derive(Default)]
struct Gathered {
    /// N
    force: DVec3,
    /// N m
    torque: DVec3,
    /// Whether the centre is beyond a wall.
    crossed: bool,
}

/// All contacts of grain i; `springs` are those of its slots, none in a frictionless model.
fn contacts_of(s: &State, i: usize, springs: &mut [DVec3]) -> Gathered {
    let bodies = s.sizes.bodies;
    let here = &s.place[i];
    let moving = &s.motion[i];
    let spinning = spin_of(s, i);
    let residue_here = residue_of(s, i);
    let mut sum = Gathered::default();
    let begin = s.slot_start[i] as usize;
    for (k, &id) in s.neighbour[begin..s.slot_start[i + 1] as usize].iter().enumerate() {
        if id == NONE {
            break;
        }
        let j = id as usize;
        let touch = if j < bodies {
            touch_grain(s, i, j, here, &s.place[j], residue_of(s, j) - residue_here)
        } else {
            let touch = touch_wall(&s.wall[j - bodies], here.x, residue_here, here.radius);
            sum.crossed |= touch.gap < -here.radius;
            touch
        };
        if !(touch.gap < 0.0) {
            forget_spring(springs.get_mut(k));
            continue;
        }
        let n = touch.n;
        let arm = (here.radius + 0.5 * touch.gap) * n; // erratum E7: one shared point, mid-overlap
        let mut inverse_mass = moving.inverse_mass;
        let (v_rel, n_before) = if j < bodies {
            let there = &s.place[j];
            let v = moving.v - s.motion[j].v;
            inverse_mass += s.motion[j].inverse_mass;
            let arm_there = -(there.radius + 0.5 * touch.gap) * n;
            (
                v + (surface_velocity(spinning, arm) - surface_velocity(spin_of(s, j), arm_there)),
                unit_or((here.radius + there.radius + touch.gap) * n + s.params.dt * v, n),
            )
        } else {
            let wall = &s.wall[j - bodies];
            (
                (moving.v - wall_velocity(wall, here.x + arm)) + surface_velocity(spinning, arm),
                wall_normal_before(s, wall, here.x - s.params.dt * moving.v),
            )
        };
        let pair = pair_of(s, i, j);
        let pressing =
            normal_force(&pair, touch.gap) + dashpot_force(s.model.dashpot, &pair, v_rel.dot(n), inverse_mass);
        let f = -pressing * n + tangential_force(s, springs.get_mut(k), &pair, n, n_before, v_rel, pressing);
        sum.force += f;
        sum.torque += moment(arm, f);
    }
    sum
}
