//! Twin of `shaders/dem/place_members.wgsl`: members follow from where their clumps are.

use crate::body::blocks::{BLOCK, by_body};
use crate::{
    body::{
        grains::{arm_of, clump, global_spin},
        rotation::surface_velocity,
    },
    space::{
        boundary::wrap,
        dimension::{arm_increment, outside, rotation_increment},
        precision::{Point, arm_end, position_low_of},
    },
    state::{Position, PositionLow, Spin, State, Velocity},
};
use glam::DVec4;
use rayon::prelude::*;
use std::mem::take;

/// What a member is after a step, and how far it went.
struct Next {
    point: Point,
    velocity: Velocity,
    spin: Spin,
    stride: f64,
}

pub fn place_members(s: &mut State) {
    if s.halt[0] != 0 {
        s.halt_next[0] = 1;
        return;
    }
    let spent = place_all_members(s);
    s.halt_next[0] = s.halt_next[0].max(u32::from(spent));
}

/// Members come to where their clumps are. Whether the lists are spent, or a member is lost.
pub fn place_all_members(s: &mut State) -> bool {
    let (mut position, mut low) = (take(&mut s.position_next), take(&mut s.position_low_next));
    let (mut velocity, mut spin) = (take(&mut s.velocity_next), take(&mut s.spin_next));
    let mut displacement = take(&mut s.displacement);
    let (bad, spent) = by_body(&mut position, s)
        .zip(by_body(&mut low, s))
        .zip(by_body(&mut velocity, s))
        .zip(by_body(&mut spin, s))
        .zip(by_body(&mut displacement, s))
        .enumerate()
        .map(|(block, ((((position, low), velocity), spin), displacement))| {
            let (mut bad, mut spent) = (0, false);
            for k in 0..position.len() {
                let i = block * BLOCK + k;
                let next = placed(s, i);
                position[k] = Position { x: next.point.x, radius: s.position[i].radius };
                if let Some(low) = low.get_mut(k) {
                    *low = PositionLow { x: next.point.low, radius: position_low_of(s, i).radius };
                }
                (velocity[k], spin[k]) = (next.velocity, next.spin);
                displacement[k] += next.stride;
                let lost =
                    outside(next.point.x, s.params.lower, s.params.upper) || !(next.stride <= s.params.step_limit);
                if lost {
                    bad = bad.max(s.params.bodies - s.id[i]);
                }
                spent |= lost || !(displacement[k] <= s.params.displacement_limit);
            }
            (bad, spent)
        })
        .reduce(|| (0, false), |a, b| (a.0.max(b.0), a.1 | b.1));
    (s.position_next, s.position_low_next, s.velocity_next, s.spin_next, s.displacement) =
        (position, low, velocity, spin, displacement);
    s.counters[0].lost_body = s.counters[0].lost_body.max(bad);
    spent
}

fn placed(s: &State, i: usize) -> Next {
    let member_id = s.id[i] as usize;
    let c = s.clump_of_id[member_id] as usize;
    let before = clump(s, c);
    let v = s.clump_velocity_next[c].v;
    let spin = global_spin(s, before.inverse_moments, before.orientation, s.clump_spin_next[c].0);
    let arm = arm_of(s, before.orientation, member_id);
    let gain = arm_increment(rotation_increment(0.25 * s.params.dt * spin), arm);
    let low = s.center_low_next.get(c).copied().unwrap_or_default();
    let rest = s.orientation_low_next.get(c).map_or(DVec4::ZERO, |r| r.0);
    let center = Point { x: s.center_next[c], low };
    let stride = s.params.dt * v + gain;
    Next {
        point: wrap(s, arm_end(s, center, s.orientation_next[c].0, rest, s.member_offset[member_id].0)),
        velocity: Velocity {
            v: v + surface_velocity(spin, arm + 0.5 * gain),
            inverse_mass: before.velocity.inverse_mass,
        },
        spin: Spin(spin),
        stride: stride.length(),
    }
}
