//! Twin of `shaders/dem/place_members.wgsl`: members follow from where their clumps are.

use crate::body::blocks::{BLOCK, by_body};
use crate::{
    body::{
        bodies::{Limits, NextPositions},
        grains::{arm_of, clump, global_spin},
        rotation::surface_velocity,
    },
    space::{
        boundary::{approach, past_next_flow, wrap},
        dimension::{arm_increment, rotation_increment, spin_squared},
        precision::{Point, arm_end},
    },
    state::{HALTED, Spin, State, Velocity},
};
use glam::DVec4;
use rayon::prelude::*;
use std::mem::take;

/// What a member is after a step, and how far it went.
struct Placed {
    point: Point,
    velocity: Velocity,
    spin: Spin,
    stride: f64,
    /// Whether it turns too far to be followed.
    hopeless: bool,
}

pub fn place_members(s: &mut State) {
    if s.halt[0] >= HALTED {
        s.halt_next[0] = HALTED;
        return;
    }
    if place_all_members(s) {
        s.halt_next[0] = HALTED;
    }
}

/// Members come to where their clumps are. Whether the run has to halt.
pub fn place_all_members(s: &mut State) -> bool {
    let (mut position, mut low) = (take(&mut s.position_next), take(&mut s.position_low_next));
    let (mut velocity, mut spin) = (take(&mut s.velocity_next), take(&mut s.spin_next));
    let mut displacement = take(&mut s.displacement);
    let limits = by_body(&mut position, s)
        .zip(by_body(&mut low, s))
        .zip(by_body(&mut velocity, s))
        .zip(by_body(&mut spin, s))
        .zip(by_body(&mut displacement, s))
        .enumerate()
        .map(|(block, ((((position, low), velocity), spin), displacement))| {
            let members = 0..position.len();
            let mut next = NextPositions { position, low, displacement };
            let of_member = |k| {
                let i = block * BLOCK + k;
                let placed = place_member(s, i);
                (velocity[k], spin[k]) = (placed.velocity, placed.spin);
                next.commit_position(s, (i, k), placed.point, placed.stride, placed.hopeless)
            };
            members.map(of_member).fold(Limits::default(), Limits::and)
        })
        .reduce(Limits::default, Limits::and);
    (s.position_next, s.position_low_next, s.velocity_next, s.spin_next, s.displacement) =
        (position, low, velocity, spin, displacement);
    s.counters[0].lost_body = s.counters[0].lost_body.max(limits.lost_body);
    limits.halt
}

fn place_member(s: &State, i: usize) -> Placed {
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
    let middle = arm + 0.5 * gain;
    Placed {
        point: wrap(
            s,
            s.model.boundary,
            arm_end(s, center, s.orientation_next[c].0, rest, s.member_offset[member_id].0),
        ),
        velocity: Velocity {
            v: past_next_flow(s, s.model.boundary, v + surface_velocity(spin, middle), middle),
            inverse_mass: before.velocity.inverse_mass,
        },
        spin: Spin(spin),
        stride: approach(s, s.model.boundary, (s.params.dt * v + gain).length(), s.position[i].radius + arm.length()),
        hopeless: !(s.params.dt * spin_squared(spin).sqrt() <= s.params.turn_limit),
    }
}
