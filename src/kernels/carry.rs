//! Twin of `shaders/carry.wgsl`: members follow from where their clumps are.

use super::{BLOCK, by_body};
use crate::{
    laws::{
        boundary::wrapped,
        dimension::{arm_gain, attitude_gain, outside},
        grains::{arm_of, clump, global_spin},
        precision::{Point, carried, residue_of},
        rotation::surface_velocity,
    },
    state::{Motion, Place, Residue, Spin, State},
};
use glam::DVec4;
use rayon::prelude::*;
use std::mem::take;

/// What a member is after a step, and how far it went.
struct Next {
    point: Point,
    motion: Motion,
    spin: Spin,
    stride: f64,
}

pub fn carry(s: &mut State) {
    if s.halt[0] != 0 {
        s.halt_next[0] = 1;
        return;
    }
    let spent = follow_clumps(s);
    s.halt_next[0] = s.halt_next[0].max(u32::from(spent));
}

/// Members come to where their clumps are. Whether the lists are spent, or a member is lost.
pub fn follow_clumps(s: &mut State) -> bool {
    let (mut place, mut residue) = (take(&mut s.place_next), take(&mut s.residue_next));
    let (mut motion, mut spin) = (take(&mut s.motion_next), take(&mut s.spin_next));
    let mut travel = take(&mut s.travel);
    let (bad, spent) = by_body(&mut place, s)
        .zip(by_body(&mut residue, s))
        .zip(by_body(&mut motion, s))
        .zip(by_body(&mut spin, s))
        .zip(by_body(&mut travel, s))
        .enumerate()
        .map(|(block, ((((place, residue), motion), spin), travel))| {
            let (mut bad, mut spent) = (0, false);
            for k in 0..place.len() {
                let i = block * BLOCK + k;
                let next = followed(s, i);
                place[k] = Place { x: next.point.x, radius: s.place[i].radius };
                if let Some(residue) = residue.get_mut(k) {
                    *residue = Residue { x: next.point.residue, radius: residue_of(s, i).radius };
                }
                (motion[k], spin[k]) = (next.motion, next.spin);
                travel[k] += next.stride;
                let lost =
                    outside(next.point.x, s.params.lower, s.params.upper) || !(next.stride <= s.params.step_limit);
                if lost {
                    bad = bad.max(s.params.bodies - s.number[i]);
                }
                spent |= lost || !(travel[k] <= s.params.drift_limit);
            }
            (bad, spent)
        })
        .reduce(|| (0, false), |a, b| (a.0.max(b.0), a.1 | b.1));
    (s.place_next, s.residue_next, s.motion_next, s.spin_next, s.travel) = (place, residue, motion, spin, travel);
    s.counters[0].bad_body = s.counters[0].bad_body.max(bad);
    spent
}

fn followed(s: &State, i: usize) -> Next {
    let label = s.number[i] as usize;
    let c = s.owner[label] as usize;
    let before = clump(s, c);
    let v = s.clump_motion_next[c].v;
    let spin = global_spin(s, before.inverse_moments, before.attitude, s.clump_spin_next[c].0);
    let arm = arm_of(s, before.attitude, label);
    let gain = arm_gain(attitude_gain(0.25 * s.params.dt * spin), arm);
    let residue = s.center_residue_next.get(c).copied().unwrap_or_default();
    let rest = s.attitude_residue_next.get(c).map_or(DVec4::ZERO, |r| r.0);
    let center = Point { x: s.center_next[c], residue };
    let way = s.params.dt * v + gain;
    Next {
        point: wrapped(s, carried(s, center, s.attitude_next[c].0, rest, s.offset[label].0)),
        motion: Motion { v: v + surface_velocity(spin, arm + 0.5 * gain), inverse_mass: before.motion.inverse_mass },
        spin: Spin(spin),
        stride: way.length(),
    }
}
